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

from missionc.backends.clot.cost_graph.cost_graph import (
    EveryLinked,
    Greatest,
    GreatestOver,
    Least,
    LeastOver,
    Length,
    Margin,
    Member,
    Of,
    Ranked,
    Release,
    SomeLinked,
    Term,
    Until,
    below,
    postorder,
)
from missionc.backends.clot.optimise.active_set import Choices
from missionc.ir import Compare, Connected, DistanceBetween, DistanceTo, InFormation, Inside, Touches

HOLDS = Least(())
"""What no planned agent can break."""

KNOWN, UNKNOWN = -1, -2
"""Rows of agents that need not be told apart: planned ones, and the others."""


def about(
    goals: Iterable[Term], planned: frozenset[int], choices: Choices, newest: int | None = None
) -> tuple[Term, ...]:
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
        order: tuple[Term, ...],
        roots: tuple[Term, ...],
        planned: frozenset[int],
        choices: Choices,
        newest: int | None,
    ) -> None:
        self.planned, self.newest = planned, newest
        self.chosen: dict[tuple[Term, int], set[int]] = {}
        for (term, agent, step), choice in choices.items():
            moved = choice - step if isinstance(term, GreatestOver | Until) else choice
            self.chosen.setdefault((term, agent), set()).add(moved)
        choosers = {term for term, _ in self.chosen}
        self.decided: set[Term] = set()
        for term in order:
            if term in choosers or not self.decided.isdisjoint(below(term)):
                self.decided.add(term)
        rows: dict[Term, set[int]] = {term: set() for term in order}
        for root in roots:
            rows[root].add(self._row(root, 0))
        for term in reversed(order):
            for part in below(term):
                rows[part] |= {self._below(term, row, part) for row in rows[term]}
        self.terms: dict[tuple[Term, int], Term] = {}
        self.leaves: dict[object, Margin | Of] = {}
        for term in order:
            for row in rows[term]:
                self.terms[term, row] = self._term(term, row)
        self.made = {root: self.terms[root, self._row(root, 0)] for root in roots}

    def _row(self, term: Term, agent: int) -> int:
        if term in self.decided:
            return agent
        return KNOWN if agent == KNOWN or agent in self.planned else UNKNOWN

    def _below(self, term: Term, row: int, part: Term) -> int:
        match term:
            case Of(agent):
                return self._row(part, agent)
            case SomeLinked() | EveryLinked() | Length():
                return KNOWN
            case _:
                return self._row(part, row)

    def _term(self, term: Term, row: int) -> Term:
        parts = tuple(self.terms[part, self._below(term, row, part)] for part in below(term))
        chosen = self.chosen.get((term, row), set())
        only = next(iter(chosen)) if len(chosen) == 1 else None
        match term:
            case Margin():
                return self._margin(term, row)
            case Member():
                return term
            case Least():
                return _least(parts)
            case Greatest():
                return _greatest(parts) if only is None else parts[only]
            case Ranked(count):
                return _ranked(count - sum(part is HOLDS for part in parts), parts)
            case LeastOver(_, low, high):
                return HOLDS if parts[0] is HOLDS else LeastOver(parts[0], low, high)
            case GreatestOver(_, low, high):
                low, high = (low, high) if only is None else (only, only)
                return HOLDS if parts[0] is HOLDS else GreatestOver(parts[0], low, high)
            case Until(_, _, low, high):
                hold, end = parts
                if only is None:
                    return HOLDS if end is HOLDS and low == 0 else Until(hold, end, low, high)
                before = HOLDS if hold is HOLDS or only == 0 else LeastOver(hold, 0, only - 1)
                return _least((before, HOLDS if end is HOLDS else LeastOver(end, only, only)))
            case Release(_, _, low, high):
                return HOLDS if parts[1] is HOLDS else Release(parts[0], parts[1], low, high)
            case Of(agent):
                return HOLDS if parts[0] is HOLDS else Of(agent, parts[0])
            case SomeLinked(graph):
                return SomeLinked(graph, parts[0]) if self.planned.issuperset(graph.agents) else HOLDS
            case EveryLinked(graph):
                members = tuple(agent for agent in graph.agents if agent in self.planned)
                if not self._is_planned(row) or parts[0] is HOLDS or len(members) < 2:
                    return HOLDS
                return EveryLinked(replace(graph, agents=members), parts[0])
            case Length(graph):
                if not self.planned.issuperset(graph.agents):
                    return HOLDS
                return replace(term, through=parts[0], end=parts[1])
            case _:
                assert_never(term)

    def _is_planned(self, row: int) -> bool:
        return row == KNOWN or row in self.planned

    def _margin(self, term: Margin, row: int) -> Term:
        """A margin where all it reads is planned; of one that is least over pairs, those that are."""
        match term.predicate:
            case Inside() | Touches():
                return term if self._is_planned(row) else HOLDS
            case Connected(_, agents) as predicate:
                members = tuple(agent for agent in agents if agent in self.planned)
                if not term.holds:
                    return term if members == agents else HOLDS
                if len(members) < 2 or self.newest not in (None, *members):
                    return HOLDS
                return self._connected(predicate, members)
            case InFormation(formation) as predicate:
                edges = tuple(edge for edge in formation.edges if {edge.first, edge.second} <= self.planned)
                if edges == formation.edges:
                    return term
                if not (term.holds and edges):
                    return HOLDS
                if predicate not in self.leaves:
                    self.leaves[predicate] = Margin(InFormation(replace(formation, edges=edges)), True)
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
                assert_never(term.predicate)

    def _connected(self, predicate: Connected, members: tuple[int, ...]) -> Margin | Of:
        if predicate not in self.leaves:
            if self.newest is None:
                self.leaves[predicate] = Margin(Connected(predicate.graph, members), True)
            else:
                linked = SomeLinked(replace(predicate.graph, agents=members), HOLDS)
                self.leaves[predicate] = Of(self.newest, linked)
        return self.leaves[predicate]


def _least(parts: tuple[Term, ...]) -> Term:
    left = tuple(part for part in parts if part is not HOLDS)
    return HOLDS if not left else left[0] if len(left) == 1 else Least(left)


def _greatest(parts: tuple[Term, ...]) -> Term:
    if any(part is HOLDS for part in parts):
        return HOLDS
    return parts[0] if len(parts) == 1 else Greatest(parts)


def _ranked(count: int, parts: tuple[Term, ...]) -> Term:
    left = tuple(part for part in parts if part is not HOLDS)
    if count <= 0:
        return HOLDS
    if count >= len(left):
        return _least(left) if count == len(left) else Greatest(())
    return _greatest(left) if count == 1 else Ranked(count, left)
