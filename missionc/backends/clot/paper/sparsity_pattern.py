"""The sparsity pattern of robustness: the values of a term that can change when one waypoint of one agent is moved.

A leaf at a step reads the agents there (a speed also where they go next), a
window reads the steps it spans. So the values of a term at a step can change
for few of the waypoints, the ones at a small offset from it, and those are
all that need to be worked out again.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TypeAlias, assert_never

import numpy as np

from missionc.base.trace import Flags
from missionc.ir import (
    Graph,
    Predicate,
)
from missionc.kernel import nodes as kernel
from missionc.kernel.nodes import Node, UntilNode, WindowNode
from missionc.kernel.walk import children, postorder

Rows: TypeAlias = tuple[int, ...] | None
"""Agents whose value changes; None where a value is the team's."""


@dataclass(frozen=True, slots=True, eq=False)
class TermPattern:
    """The sparsity pattern of one term: its values that a moved waypoint can change.

    Args:
        first: the first step at which the term's value is needed.
        low: the first offset: the waypoint's step less the value's.
        touched: (rows, steps, offsets), where a value reads the waypoint; 1
            for rows where they are None.
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
        """The last offset."""
        return self.low + int(self.nonzero.shape[2]) - 1


@dataclass(frozen=True, slots=True, eq=False)
class SparsityPattern:
    """The sparsity pattern of ``goals``: what moving a waypoint of ``agent`` changes in them.

    Args:
        order: every term below the goals once, each after those below it.
        needed: the first and the last step at which each term's value is needed.
        of: of the terms that can change at all.
    """

    goals: tuple[Node, ...]
    order: Sequence[Node]
    agent: int
    needed: dict[Node, tuple[int, int]]
    of: dict[Node, TermPattern]


@dataclass(frozen=True, slots=True, eq=False)
class Window:
    """What a temporal term reads: ``end`` from ``low`` to ``high`` ahead, ``hold`` at the steps before it.

    ``first`` is the first step ahead that is read.
    """

    hold: Node | None
    end: Node
    first: int
    low: int
    high: int | None

    def width(self, needed: tuple[int, int], steps: int) -> int:
        """How many steps it spans from ``first`` on, for the first step at which it is needed."""
        last = steps - 1 - needed[0] if self.high is None else self.high
        return last - self.first + 1


def window(term: WindowNode | UntilNode) -> Window:
    """The one form of all temporal terms."""
    match term:
        case kernel.Always(body, low, high) | kernel.Eventually(body, low, high):
            return Window(None, body, low, low, high)
        case kernel.Until(first, end, low, high) | kernel.Release(first, end, low, high):
            return Window(first, end, 0, low, high)
        case _:
            assert_never(term)


def sparsity_pattern(goals: Iterable[Node], agent: int, agents: int, steps: int) -> SparsityPattern:
    """The sparsity pattern of these goals, at step 0, by the waypoints of an agent.

    Raises:
        ValueError: a goal looks past the last step.
    """
    wanted = tuple(goals)
    order = postorder(wanted)
    needed = _needed(wanted, order, steps)
    known: dict[Node, TermPattern] = {}
    team: dict[Node, bool] = {}
    for term in order:
        team[term] = _of_team(term, team)
        found = _reading(term, agent, agents, steps, needed[term], known, team[term])
        if found is not None:
            known[term] = found
    return SparsityPattern(wanted, order, agent, needed, known)


def _needed(goals: tuple[Node, ...], order: Sequence[Node], steps: int) -> dict[Node, tuple[int, int]]:
    """The steps at which each term's value is laid out.

    What holds until something else is laid out at the last step of its window as well, where it is not asked. A window
    below it that would run past the mission from there is laid out as far as the mission goes.
    """
    needed: dict[Node, tuple[int, int]] = dict.fromkeys(goals, (0, 0))
    asked: dict[Node, int] = dict.fromkeys(goals, 0)
    for term in reversed(order):
        first, last = needed[term]
        final = dict.fromkeys(children(term), asked[term])
        if isinstance(term, WindowNode | UntilNode):
            shape = window(term)
            if asked[term] + (shape.low if shape.high is None else shape.high) >= steps:
                raise ValueError("a window runs past the last step")
            first = first + shape.first
            last = steps - 1 if shape.high is None else min(last + shape.high, steps - 1)
            until = steps - 1 if shape.high is None else asked[term] + shape.high
            final = dict.fromkeys(children(term), until)
            if shape.hold is not None and shape.hold is not shape.end:
                final[shape.hold] = until - 1
        for part in children(term):
            before = needed.get(part, (first, last))
            needed[part] = (min(first, before[0]), max(last, before[1]))
            asked[part] = max(asked.get(part, 0), final[part])
    return needed


def _of_team(term: Node, team: dict[Node, bool]) -> bool:
    """Whether the term has one value for all agents."""
    match term:
        case kernel.Atom(predicate) | kernel.Not(kernel.Atom(predicate)):
            return predicate.about_team
        case kernel.Is() | kernel.Not():
            return False
        case kernel.Neighbour() | kernel.EveryNeighbour() | kernel.Route() | kernel.EveryRoute():
            return False
        case kernel.At():
            return True
        case _:
            return all(team[part] for part in children(term))


def _reading(
    term: Node,
    agent: int,
    agents: int,
    steps: int,
    needed: tuple[int, int],
    known: dict[Node, TermPattern],
    team: bool,
) -> TermPattern | None:
    first, count = needed[0], needed[1] - needed[0] + 1
    parts = [(part, known[part]) for part in children(term) if part in known]
    match term:
        case kernel.Is() | kernel.Not(kernel.Is()):
            return None
        case kernel.Atom(predicate) | kernel.Not(kernel.Atom(predicate)):
            return _of_leaf(predicate, agent, agents, first, count, steps)
        case kernel.Neighbour(graph) | kernel.EveryNeighbour(graph):
            if len(graph.agents) < 2:
                return None
            return _of_links(graph, graph.agents, first, count, [one for _, one in parts], agent)
        case kernel.Route(graph) | kernel.EveryRoute(graph):
            return _of_links(graph, tuple(range(agents)), first, count, [one for _, one in parts], agent)
        case _ if not parts:
            return None
        case kernel.At(index, body):
            found = known[body]
            here = slice(first - found.first, first - found.first + count)
            if found.rows is None:
                return TermPattern(None, first, found.low, found.nonzero[:, here])
            if index not in found.rows:
                return None
            row = found.rows.index(index)
            return TermPattern(None, first, found.low, found.nonzero[row : row + 1, here])
        case kernel.All() | kernel.Any() | kernel.AtLeast():
            rows = _union(agents, team, [one for _, one in parts])
            return _over(rows, first, count, [one for _, one in parts])
        case kernel.Always() | kernel.Eventually() | kernel.Until() | kernel.Release():
            rows = _union(agents, team, [one for _, one in parts])
            return _of_window(window(term), rows, needed, parts, steps)
        case kernel.Not() | kernel.Reach() | kernel.EveryReach() | kernel.PathLength():
            raise AssertionError("not in a cost graph")
        case _:
            assert_never(term)


def _of_leaf(predicate: Predicate, agent: int, agents: int, first: int, count: int, steps: int) -> TermPattern | None:
    """``rows`` are the agents whose value reads the moved agent."""
    rows: Rows
    if agent in predicate.others:
        rows = None if predicate.about_team else tuple(range(agents))
    elif predicate.reads_oneself(3):
        rows = (agent,)
    else:
        return None
    height = 1 if rows is None else len(rows)
    if not predicate.reads_speed:
        return TermPattern(rows, first, 0, np.ones((height, count, 1), dtype=bool))
    # The speed at a step reads the next one too; at the last step, the one before.
    nonzero = np.zeros((height, count, 3), dtype=bool)
    at = np.arange(first, first + count)
    own = 0 if rows is None else rows.index(agent)
    nonzero[own, :, 0] = (at == steps - 1) & (steps > 1)
    nonzero[:, :, 1] = True
    nonzero[own, :, 2] = at < steps - 1
    return TermPattern(rows, first, -1, nonzero)


def _union(agents: int, team: bool, parts: list[TermPattern]) -> Rows:
    if team:
        return None
    rows: set[int] = set()
    for part in parts:
        rows |= set(range(agents) if part.rows is None else part.rows)
    return tuple(sorted(rows))


def _over(rows: Rows, first: int, count: int, parts: list[TermPattern]) -> TermPattern:
    """The reading of a term that reads its own row of its parts."""
    low, high = min(part.low for part in parts), max(part.high for part in parts)
    nonzero = np.zeros((1 if rows is None else len(rows), count, high - low + 1), dtype=bool)
    for part in parts:
        mark(nonzero[:, :, part.low - low : part.high - low + 1], rows, part, first)
    return TermPattern(rows, first, low, nonzero)


def _of_links(
    graph: Graph, rows: tuple[int, ...], first: int, count: int, parts: list[TermPattern], agent: int
) -> TermPattern | None:
    """The reading of a term over links of a graph and its parts at other agents: what touches one row touches all."""
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
    return TermPattern(rows, first, low, nonzero)


def _of_window(
    shape: Window, rows: Rows, needed: tuple[int, int], parts: list[tuple[Node, TermPattern]], steps: int
) -> TermPattern:
    first, count = needed[0], needed[1] - needed[0] + 1
    width = shape.width(needed, steps)
    low = min(part.low for _, part in parts)
    high = max(part.high for _, part in parts)
    nonzero = np.zeros((1 if rows is None else len(rows), count, high - low + width), dtype=bool)
    for ahead in range(width):
        for term, part in parts:
            size = min(count, steps - (first + shape.first + ahead))
            later = nonzero[:, :size, ahead + part.low - low : ahead + part.high - low + 1]
            if term is shape.end and shape.first + ahead >= shape.low:
                mark(later, rows, part, first + shape.first + ahead)
            if term is shape.hold and ahead < width - 1:
                size = min(count, steps - 1 - (first + ahead))
                mark(later[:, :size], rows, part, first + ahead)
    return TermPattern(rows, first, shape.first + low, nonzero)


def mark(nonzero: Flags, rows: Rows, part: TermPattern, first: int) -> None:
    """Marks in (rows, steps, offsets) what a part touches, from step ``first`` on."""
    here = part.nonzero[:, first - part.first : first - part.first + nonzero.shape[1]]
    if rows is None or part.rows is None:
        nonzero |= here
    else:
        nonzero[[rows.index(row) for row in part.rows if row in rows]] |= here[
            [index for index, row in enumerate(part.rows) if row in rows]
        ]
