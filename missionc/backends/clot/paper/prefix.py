"""Robustness of goals if only some agents are planned: an optimistic bound, and the value with these agents as the
team.

*Optimistic*, to discard candidates: other agents count as the best possible. Negations are at the leaves, so the value
cannot decrease if every margin that reads an unplanned agent is infinite. A goal that still fails cannot be satisfied
by planning the others; only then is a partial team discarded.

*As a whole*, to guide and compare candidates: the planned agents are the team, so *some agent* means a planned agent.
Consider the goal "in the region, or some agent outside the region". The optimistic bound satisfies it for any partial
team, since a later agent may be outside. The value as a whole requires the planned agents to be in the region.

One exception in both: ``connected`` applies to the planned agents among themselves, which the sequence makes possible
and a bound could not guide. Predicates of the past (resources and flags) are left to the local optimisation, since they
have no separate value for a moved waypoint.

Source:
    [clot] IV-B.2, Γ_ℓ in (6), and IV-D.1 for partial teams.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import assert_never

from missionc.backends.clot.cost_graph.cost_graph import Unrolled, signed_predicate
from missionc.backends.clot.optimise.active_set import Choices
from missionc.ir import Predicate
from missionc.ir.kernel.nodes import (
    All,
    Always,
    Any,
    At,
    AtLeast,
    Atom,
    Is,
    Neighbour,
    NeighbourNode,
    Node,
    Not,
    RouteNode,
    Until,
    UntilNode,
    WindowNode,
)
from missionc.ir.kernel.normal_form import YES, folded
from missionc.ir.kernel.walk import children, postorder, rebuilt

HOLDS = YES
"""Formula that no planned agent can violate."""

KNOWN, UNKNOWN = -1, -2
"""Row numbers of agents that need not be distinguished: planned agents, and the others."""


def about(
    goals: Iterable[Node],
    planned: frozenset[int],
    choices: Choices,
    newest: int | None = None,
    as_whole: bool = False,
) -> tuple[Node, ...]:
    """Goals restricted to the planned agents, without goals that these agents cannot violate.

    Args:
        choices: choices of a witness, which replace the disjunctions.
        newest: planned agent that is being moved: ``connected`` becomes its link to any other, which is much cheaper
            and equivalent if the others are connected.
        as_whole: True to restrict *some agent* to planned agents, unless there are none.
    """
    return tuple(form for _, form in asked(goals, planned, choices, newest, as_whole))


def asked(
    goals: Iterable[Node],
    planned: frozenset[int],
    choices: Choices,
    newest: int | None = None,
    as_whole: bool = False,
) -> tuple[tuple[Node, Node], ...]:
    """Goals of ``about``, each preceded by the original goal."""
    roots = tuple(goals)
    made = _Prefix(postorder(roots), roots, planned, choices, newest, as_whole).made
    return tuple((root, form) for root in roots if (form := made[root]) is not HOLDS)


def spelled_out(goals: tuple[Node, ...], steps: int) -> tuple[Node, ...]:
    """Goals with ``until`` expanded: at some time ``end`` is true, and ``hold`` is true at every time before.

    In the rules for a moved waypoint, the mean is then of these two parts, not of one step and all that follow, which
    would halve the end's value at each step. An ``until`` evaluated at a later time with a window up to the last step
    stays unchanged.

    Args:
        steps: number of steps of the mission.

    Source:
        [clot] IV-A.1: ``until`` expands into a recursive combination.
    """
    made: dict[Node, Node] = {}
    for node in postorder(goals):
        parts = tuple(made[part] for part in children(node))
        made[node] = rebuilt(node, parts)
        if isinstance(node, Until) and node.low >= 0 and (node.high is not None or node in goals):
            hold, end = parts
            window = range(node.low, (steps if node.high is None else node.high) + 1)
            held = [(Always(hold, 0, moment - 1), Always(end, moment, moment)) for moment in window]
            made[node] = Any(
                tuple(All(both if moment else both[1:]) for moment, both in zip(window, held, strict=True))
            )
    return tuple(made[goal] for goal in goals)


class _Prefix:
    def __init__(
        self,
        order: list[Node],
        roots: tuple[Node, ...],
        planned: frozenset[int],
        choices: Choices,
        newest: int | None,
        as_whole: bool,
    ) -> None:
        self.planned, self.newest, self.as_whole = planned, newest, as_whole
        self.chosen: dict[tuple[Node, int], set[int]] = {}
        for (node, agent, step), choice in choices.items():
            moved = choice - step if isinstance(node, WindowNode | UntilNode) else choice
            self.chosen.setdefault((node, agent), set()).add(moved)
        choosers = {node for node, _ in self.chosen}
        self.decided: set[Node] = set()
        for node in order:
            if node in choosers or not self.decided.isdisjoint(children(node)):
                self.decided.add(node)
        rows: dict[Node, set[int]] = {node: set() for node in order}
        for root in roots:
            rows[root].add(self._row(root, 0))
        for node in reversed(order):
            for part in children(node):
                rows[part] |= {self._below(node, row, part) for row in rows[node]}
        self.leaves: dict[Predicate, Node] = {}
        self.forms: dict[tuple[Node, int], Node] = {}
        for node in order:
            for row in rows[node]:
                self.forms[node, row] = self._form(node, row)
        self.made = {root: self.forms[root, self._row(root, 0)] for root in roots}

    def _row(self, node: Node, agent: int) -> int:
        if node in self.decided:
            return agent
        return KNOWN if self._is_planned(agent) else UNKNOWN

    def _below(self, node: Node, row: int, part: Node) -> int:
        if isinstance(node, NeighbourNode | RouteNode):
            return KNOWN
        return self._row(part, node.agent if isinstance(node, At) else row)

    def _form(self, node: Node, row: int) -> Node:
        parts = tuple(self.forms[part, self._below(node, row, part)] for part in children(node))
        chosen = self.chosen.get((node, row), set())
        only = next(iter(chosen)) if len(chosen) == 1 else None
        assert not isinstance(node, Unrolled), "not in a cost graph"
        if isinstance(node, WindowNode | UntilNode):
            return self._windowed(node, parts, only)
        if isinstance(node, NeighbourNode) and node.every:
            members = tuple(agent for agent in node.graph.agents if agent in self.planned)
            if not self._is_planned(row) or parts[0] is HOLDS or len(members) < 2:
                return HOLDS
            return replace(node, graph=replace(node.graph, agents=members), body=parts[0])
        if isinstance(node, NeighbourNode | RouteNode):
            return rebuilt(node, parts) if self.planned.issuperset(node.graph.agents) else HOLDS
        match node:
            case Atom() | Not(Atom()):
                return self._leaf(node, row)
            case Is() | Not():
                return node
            case Any():
                return folded(node, self._asked(node, parts)) if only is None else parts[only]
            case All() | AtLeast() | At():
                return folded(node, parts)
            case _:
                assert_never(node)

    def _asked(self, node: Any, parts: tuple[Node, ...]) -> tuple[Node, ...]:
        """Parts of a disjunction without those about agents outside the planned team; all parts if none would
        remain."""
        if not self.as_whole:
            return parts
        each = zip(children(node), parts, strict=True)
        return tuple(made for part, made in each if made is not HOLDS or not self._of_another(part)) or parts

    def _of_another(self, part: Node) -> bool:
        return isinstance(part, At) and part.agent not in self.planned

    def _windowed(self, node: WindowNode | UntilNode, parts: tuple[Node, ...], only: int | None) -> Node:
        """Restricted form of a window operator.

        Args:
            parts: restricted children.
            only: number of steps ahead at which a schedule's witness satisfies ``Eventually`` or ``Until``; None
                without a witness.
        """
        *hold, end = parts
        if only is None or node.every:
            free = node.every or node.low == 0 or not hold
            return HOLDS if end is HOLDS and free else rebuilt(node, parts)
        before = tuple(HOLDS if each is HOLDS or only == 0 else Always(each, 0, only - 1) for each in hold)
        return folded(YES, (*before, HOLDS if end is HOLDS else Always(end, only, only)))

    def _is_planned(self, row: int) -> bool:
        return row == KNOWN or row in self.planned

    def _leaf(self, node: Node, row: int) -> Node:
        """Predicate (or negation) if all its agents are planned; for several agents, its restriction to the planned
        agents."""
        predicate, holds = signed_predicate(node)
        if predicate.reads_past or (predicate.reads_oneself(3) and not self._is_planned(row)):
            return HOLDS
        less = predicate.among(self.planned)
        if less is None or (less is not predicate and not holds):
            return HOLDS
        graph = less.restricted
        if graph is None or not holds or self.newest is None:
            return node if less is predicate else self.leaves.setdefault(less, Atom(less))
        if not {self.newest} < set(graph.agents):
            return HOLDS
        return self.leaves.setdefault(less, At(self.newest, Neighbour(graph, HOLDS)))
