"""Sparsity pattern of robustness: values of a formula that change if one waypoint of one agent moves.

A leaf at a step reads the agents at that step (a speed also their next positions), and a window reads its steps. The
value of a formula at a step therefore changes only for waypoints at small offsets, and only those values are
recomputed.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import TypeAlias

import numpy as np

from missionc.backends.clot.cost_graph.cost_graph import signed_predicate
from missionc.base.late_dataclass import Record
from missionc.base.trace import Flags
from missionc.ir import Graph, Predicate
from missionc.ir.kernel.analysis import same_for_all
from missionc.ir.kernel.nodes import At, Atom, Node, Not, UntilNode, WindowNode
from missionc.ir.kernel.walk import Ask, asks, children, graph_of, postorder

Rows: TypeAlias = tuple[int, ...] | None
"""Agents whose value changes; None for a value of the team."""


class NodePattern(Record, eq=False):
    """Sparsity pattern of one formula: its values that a moved waypoint can change.

    Args:
        first: first step at which the formula's value is needed.
        low: first offset: the waypoint's step minus the value's step.
        nonzero: (rows, steps, offsets), True if a value reads the waypoint; 1 row if ``rows`` is None.
    """

    rows: Rows
    first: int
    low: int
    nonzero: Flags

    @property
    def steps(self) -> int:
        return int(self.nonzero.shape[1])

    @property
    def high(self) -> int:
        """Last offset of the pattern."""
        return self.low + int(self.nonzero.shape[2]) - 1


class SparsityPattern(Record, eq=False):
    """Sparsity pattern of ``goals`` for moved waypoints of ``agent``.

    Args:
        order: every formula below the goals once, children first.
        needed: first and last step at which each formula's value is needed.
        of: patterns of the formulas that can change.
        leaves: formulas of one time, and formulas over links.
    """

    goals: tuple[Node, ...]
    order: Sequence[Node]
    agent: int
    needed: dict[Node, tuple[int, int]]
    of: dict[Node, NodePattern]
    leaves: frozenset[Node]


def sparsity_pattern(goals: Iterable[Node], agent: int, agents: int, steps: int) -> SparsityPattern:
    """Sparsity pattern of goals at step 0 for the waypoints of an agent.

    Raises:
        ValueError: a goal looks past the last step.
    """
    wanted = tuple(goals)
    order = postorder(wanted)
    needed = _needed(wanted, order, steps)
    team = same_for_all(wanted)
    known: dict[Node, NodePattern] = {}
    for node in order:
        if node in needed:
            pattern = _pattern(node, agent, agents, steps, needed[node], known, team[node])
            if pattern is not None:
                known[node] = pattern
    return SparsityPattern(wanted, order, agent, needed, known, _leaves(order))


def _leaves(order: Sequence[Node]) -> frozenset[Node]:
    """Formulas without windows, or over links."""
    leaves: set[Node] = set()
    for node in order:
        timed = isinstance(node, WindowNode | UntilNode)
        if graph_of(node) or not (timed or any(part not in leaves for part in children(node))):
            leaves.add(node)
    return frozenset(leaves)


def _needed(goals: tuple[Node, ...], order: Sequence[Node], steps: int) -> dict[Node, tuple[int, int]]:
    """First and last step at which each formula's value is needed.

    A window is computed for every step from the first to the last needed step. A window past the mission's end is
    truncated there.
    """
    needed: dict[Node, tuple[int, int]] = dict.fromkeys(goals, (0, 0))
    latest: dict[Node, int] = dict.fromkeys(goals, 0)
    for node in reversed(order):
        for ask in asks(node) if node in needed else ():
            if latest[node] + (ask.low if ask.high is None else ask.high) >= steps:
                raise ValueError("a time window extends past the last step")
            first = needed[node][0] + ask.low
            last = min(needed[node][1] + (steps if ask.high is None else ask.high), steps - 1)
            before = needed.get(ask.node, (first, last))
            needed[ask.node] = min(first, before[0]), max(last, before[1])
            final = steps - 1 - ask.before_last if ask.high is None else latest[node] + ask.high
            latest[ask.node] = max(latest.get(ask.node, 0), final)
    return needed


def _pattern(
    node: Node,
    agent: int,
    agents: int,
    steps: int,
    needed: tuple[int, int],
    known: dict[Node, NodePattern],
    team: bool,
) -> NodePattern | None:
    first, count = needed[0], needed[1] - needed[0] + 1
    if isinstance(node, Atom) or (isinstance(node, Not) and isinstance(node.body, Atom)):
        return _of_leaf(signed_predicate(node)[0], agent, agents, first, count, steps)
    parts = [(ask, known[ask.node]) for ask in asks(node) if ask.node in known]
    if graph := graph_of(node):
        itself = any(ask.of_itself for ask in asks(node))
        rows = tuple(range(agents)) if itself else graph.agents
        if itself or len(rows) > 1:
            return _of_links(graph, rows, first, count, [part for _, part in parts], agent)
        return None
    if isinstance(node, At):
        parts = [(ask, _row(part, node.agent)) for ask, part in parts if part.rows is None or node.agent in part.rows]
    return _over(parts, _union(agents, team, [part for _, part in parts]), first, count, steps)


def _of_leaf(predicate: Predicate, agent: int, agents: int, first: int, count: int, steps: int) -> NodePattern | None:
    """Sparsity pattern of a predicate, whose rows are the agents whose value reads the moved agent; None if no value
    reads the moved agent."""
    rows: Rows
    if agent in predicate.others:
        rows = None if predicate.about_team else tuple(range(agents))
    elif predicate.reads_oneself(3):
        rows = (agent,)
    else:
        return None
    height = 1 if rows is None else len(rows)
    if not predicate.reads_speed:
        return NodePattern(rows, first, 0, np.ones((height, count, 1), dtype=bool))
    # The speed at a step also reads the next step; at the last step, the previous one.
    nonzero = np.zeros((height, count, 3), dtype=bool)
    at = np.arange(first, first + count)
    own = 0 if rows is None else rows.index(agent)
    nonzero[own, :, 0] = (at == steps - 1) & (steps > 1)
    nonzero[:, :, 1] = True
    nonzero[own, :, 2] = at < steps - 1
    return NodePattern(rows, first, -1, nonzero)


def _union(agents: int, team: bool, parts: list[NodePattern]) -> Rows:
    if team:
        return None
    rows: set[int] = set()
    for part in parts:
        rows |= set(range(agents) if part.rows is None else part.rows)
    return tuple(sorted(rows))


def _row(part: NodePattern, agent: int) -> NodePattern:
    """Sparsity pattern of a formula for one agent."""
    if part.rows is None:
        return part
    row = part.rows.index(agent)
    return replace(part, rows=None, nonzero=part.nonzero[row : row + 1])


def _over(parts: list[tuple[Ask, NodePattern]], rows: Rows, first: int, count: int, steps: int) -> NodePattern | None:
    """Sparsity pattern of a formula whose row reads the same row of its parts, at the steps of a window ahead."""
    reads = []
    for ask, part in parts:
        last = steps - 1 - first - ask.before_last if ask.high is None else ask.high
        reads += [(part, ahead, steps - ask.before_last) for ahead in range(ask.low, last + 1)]
    if not reads:
        return None
    low, high = min(part.low + ahead for part, ahead, _ in reads), max(part.high + ahead for part, ahead, _ in reads)
    nonzero = np.zeros((1 if rows is None else len(rows), count, high - low + 1), dtype=bool)
    for part, ahead, end in reads:
        here = slice(part.low + ahead - low, part.high + ahead - low + 1)
        mark(nonzero[:, : end - first - ahead, here], rows, part, first + ahead)
    return NodePattern(rows, first, low, nonzero)


def _of_links(
    graph: Graph, rows: tuple[int, ...], first: int, count: int, parts: list[NodePattern], agent: int
) -> NodePattern | None:
    """Sparsity pattern of a formula over links, whose parts are read at other agents: a change in one row affects all
    rows."""
    parts = [part for part in parts if part.rows is None or set(part.rows) & set(rows)]
    linked = agent in graph.agents
    if not parts and not linked:
        return None
    low, high = min([part.low for part in parts] + [0] * linked), max([part.high for part in parts] + [0] * linked)
    nonzero = np.zeros((len(rows), count, high - low + 1), dtype=bool)
    if linked:
        nonzero[:, :, -low] = True
    for part in parts:
        here = part.nonzero[:, first - part.first : first - part.first + count]
        nonzero[:, :, part.low - low : part.high - low + 1] |= here.any(axis=0)
    return NodePattern(rows, first, low, nonzero)


def mark(nonzero: Flags, rows: Rows, part: NodePattern, first: int) -> None:
    """Set the flags of the part's pattern in ``nonzero``, (rows, steps, offsets), from step ``first`` on."""
    here = part.nonzero[:, first - part.first : first - part.first + nonzero.shape[1]]
    if rows is None or part.rows is None:
        nonzero |= here
    else:
        nonzero[[rows.index(row) for row in part.rows if row in rows]] |= here[
            [index for index, row in enumerate(part.rows) if row in rows]
        ]
