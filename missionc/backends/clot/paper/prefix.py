"""Optimistic truncation of goals to the agents planned so far: the others count as the best there is.

Negations are at the leaves, so a term is worth no less where every margin that reads an agent not
planned yet holds without limit. A goal that fails all the same cannot be kept by planning the
others; only then is a partial team given up. One exception: ``connected`` is asked of the planned
agents among themselves, which the sequence makes possible and a bound could not guide.

Source:
    [clot] IV-B.2, Γ_ℓ in (6), and IV-D.1 for partial teams.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import assert_never

from missionc.backends.clot.cost_graph.cost_graph import at_least
from missionc.backends.clot.optimise.active_set import Choices
from missionc.ir import Compare, Connected, DistanceBetween, DistanceTo, InFormation, Inside, Predicate, Touches
from missionc.kernel import nodes as kernel
from missionc.kernel.nodes import Node
from missionc.kernel.normal_form import rebuilt
from missionc.kernel.walk import children, postorder

HOLDS = kernel.All(())
"""What no planned agent can break."""

KNOWN, UNKNOWN = -1, -2
"""Rows of agents that need not be told apart: planned ones, and the others."""


def about(
    goals: Iterable[Node], planned: frozenset[int], choices: Choices, newest: int | None = None
) -> tuple[Node, ...]:
    """The goals for these agents alone; those that they cannot break are left out.

    Args:
        choices: what a witness decided; the goals ask for it then, and for nothing else.
        newest: of the planned agents the one that is being moved: ``connected``
            becomes a link of its own to any other, which takes a fraction of
            the work and is the same where the others are connected already.
    """
    roots = tuple(goals)
    made = _Prefix(postorder(roots), roots, planned, choices, newest).made
    return tuple(found for root in roots if (found := made[root]) is not HOLDS)


class _Prefix:
    def __init__(
        self,
        order: list[Node],
        roots: tuple[Node, ...],
        planned: frozenset[int],
        choices: Choices,
        newest: int | None,
    ) -> None:
        self.planned, self.newest = planned, newest
        self.chosen: dict[tuple[Node, int], set[int]] = {}
        for (term, agent, step), choice in choices.items():
            moved = choice - step if isinstance(term, kernel.Eventually | kernel.Until) else choice
            self.chosen.setdefault((term, agent), set()).add(moved)
        choosers = {term for term, _ in self.chosen}
        self.decided: set[Node] = set()
        for term in order:
            if term in choosers or not self.decided.isdisjoint(children(term)):
                self.decided.add(term)
        rows: dict[Node, set[int]] = {term: set() for term in order}
        for root in roots:
            rows[root].add(self._row(root, 0))
        for term in reversed(order):
            for part in children(term):
                rows[part] |= {self._below(term, row, part) for row in rows[term]}
        self.terms: dict[tuple[Node, int], Node] = {}
        self.leaves: dict[Predicate, Node] = {}
        for term in order:
            for row in rows[term]:
                self.terms[term, row] = self._term(term, row)
        self.made = {root: self.terms[root, self._row(root, 0)] for root in roots}

    def _row(self, term: Node, agent: int) -> int:
        if term in self.decided:
            return agent
        return KNOWN if agent == KNOWN or agent in self.planned else UNKNOWN

    def _below(self, term: Node, row: int, part: Node) -> int:
        match term:
            case kernel.At(agent):
                return self._row(part, agent)
            case kernel.Neighbour() | kernel.EveryNeighbour() | kernel.Route() | kernel.EveryRoute():
                return KNOWN
            case _:
                return self._row(part, row)

    def _term(self, term: Node, row: int) -> Node:
        parts = tuple(self.terms[part, self._below(term, row, part)] for part in children(term))
        chosen = self.chosen.get((term, row), set())
        only = next(iter(chosen)) if len(chosen) == 1 else None
        match term:
            case kernel.Atom(predicate) | kernel.Not(kernel.Atom(predicate)):
                return self._leaf(term, predicate, isinstance(term, kernel.Atom), row)
            case kernel.Is() | kernel.Not(kernel.Is()):
                return term
            case kernel.All():
                return _all(parts)
            case kernel.Any():
                return _any(parts) if only is None else parts[only]
            case kernel.AtLeast(count):
                return _at_least(count, parts)
            case kernel.Eventually(_, low, high):
                low, high = (low, high) if only is None else (only, only)
                return HOLDS if parts[0] is HOLDS else kernel.Eventually(parts[0], low, high)
            case kernel.Until(_, _, low, high):
                hold, end = parts
                if only is None:
                    return HOLDS if end is HOLDS and low == 0 else rebuilt(term, parts)
                before = HOLDS if hold is HOLDS or only == 0 else kernel.Always(hold, 0, only - 1)
                return _all((before, HOLDS if end is HOLDS else kernel.Always(end, only, only)))
            case kernel.Always() | kernel.Release() | kernel.At():
                return HOLDS if parts[-1] is HOLDS else rebuilt(term, parts)
            case kernel.EveryNeighbour(graph):
                members = tuple(agent for agent in graph.agents if agent in self.planned)
                if not self._is_planned(row) or parts[0] is HOLDS or len(members) < 2:
                    return HOLDS
                return kernel.EveryNeighbour(replace(graph, agents=members), parts[0])
            case kernel.Neighbour(graph) | kernel.Route(graph) | kernel.EveryRoute(graph):
                return rebuilt(term, parts) if self.planned.issuperset(graph.agents) else HOLDS
            case kernel.Not() | kernel.Reach() | kernel.EveryReach() | kernel.PathLength():
                raise AssertionError("not in a cost graph")
            case _:
                assert_never(term)

    def _is_planned(self, row: int) -> bool:
        return row == KNOWN or row in self.planned

    def _leaf(self, term: Node, predicate: Predicate, holds: bool, row: int) -> Node:
        """A predicate, or its negation, where all it reads is planned; of one about pairs, those that are."""
        match predicate:
            case Inside() | Touches():
                return term if self._is_planned(row) else HOLDS
            case Connected(_, agents):
                members = tuple(agent for agent in agents if agent in self.planned)
                if not holds:
                    return term if members == agents else HOLDS
                if len(members) < 2 or self.newest not in (None, *members):
                    return HOLDS
                return self._connected(predicate, members)
            case InFormation(formation):
                edges = tuple(edge for edge in formation.edges if {edge.first, edge.second} <= self.planned)
                if edges == formation.edges:
                    return term
                if not (holds and edges):
                    return HOLDS
                if predicate not in self.leaves:
                    self.leaves[predicate] = kernel.Atom(InFormation(replace(formation, edges=edges)))
                return self.leaves[predicate]
            case Compare(terms):
                for _, feature in terms:
                    match feature:
                        case DistanceBetween(first, second):
                            reads = self.planned.issuperset((first, second))
                        case DistanceTo(int(target)):
                            reads = target in self.planned and self._is_planned(row)
                        case _:
                            reads = self._is_planned(row)
                    if not reads:
                        return HOLDS
                return term
            case _:
                assert_never(predicate)

    def _connected(self, predicate: Connected, members: tuple[int, ...]) -> Node:
        if predicate not in self.leaves:
            if self.newest is None:
                self.leaves[predicate] = kernel.Atom(Connected(predicate.graph, members))
            else:
                linked = kernel.Neighbour(replace(predicate.graph, agents=members), HOLDS)
                self.leaves[predicate] = kernel.At(self.newest, linked)
        return self.leaves[predicate]


def _all(parts: tuple[Node, ...]) -> Node:
    left = tuple(part for part in parts if part is not HOLDS)
    return at_least(len(left), left) if left else HOLDS


def _any(parts: tuple[Node, ...]) -> Node:
    return HOLDS if HOLDS in parts else at_least(1, parts)


def _at_least(count: int, parts: tuple[Node, ...]) -> Node:
    left = tuple(part for part in parts if part is not HOLDS)
    count -= len(parts) - len(left)
    return at_least(count, left) if count > 0 else HOLDS
