"""Formation predicates: the error of each edge, or the sum of the errors, is within the tolerance."""

from __future__ import annotations

import operator
from dataclasses import replace
from functools import reduce

from missionc.base.late_dataclass import dataclass
from missionc.ir.couplings import Formation
from missionc.ir.predicates.facts import PredicateFacts
from missionc.ir.predicates.views import Array, Borders, Changes, Measures, Phrases, Words


@dataclass(frozen=True, slots=True)
class InFormation(PredicateFacts):
    formation: Formation

    @property
    def about_team(self) -> bool:
        return True

    @property
    def others(self) -> frozenset[int]:
        return frozenset(self.formation.agents)

    @property
    def pairs(self) -> tuple[tuple[int, int], ...]:
        return tuple((edge.first, edge.second) for edge in self.formation.edges)

    def among(self, agents: frozenset[int]) -> InFormation | None:
        edges = tuple(edge for edge in self.formation.edges if {edge.first, edge.second} <= agents)
        if edges == self.formation.edges:
            return self
        return InFormation(replace(self.formation, edges=edges)) if edges else None

    @property
    def parts(self) -> tuple[InFormation, ...]:
        if self.formation.total and len(self.formation.edges) > 1:
            return (self,)
        edges = self.formation.edges
        return tuple(
            InFormation(replace(self.formation, agents=(edge.first, edge.second), edges=(edge,))) for edge in edges
        )

    @property
    def is_exact(self) -> bool:
        return True

    def margin(self, view: Measures) -> Array:
        """Margin of the formation: tolerance minus the largest edge error, or minus the sum of errors; (...), metres.

        Source:
            [clot] III-C, F_form, with absolute errors.
        """
        errors = [view.formation_error(edge) for edge in self.formation.edges] or [view.nothing(of_team=True)]
        return self.formation.tolerance - reduce(operator.add if self.formation.total else view.larger, errors)

    def rate(self, view: Changes) -> Array:
        """Upper bound on the rate of change of the margin: (...), m/s."""
        rates = [view.relative(*pair) for pair in self.pairs] or [0.0]
        return reduce(operator.add if self.formation.total else view.larger, rates)

    def moved(self, borders: Borders) -> InFormation:
        return InFormation(borders.formation(self.formation))

    def show(self, words: Words) -> str:
        return self.formation.name

    def phrases(self, words: Phrases) -> tuple[str, str]:
        within = f"within {words.number(self.formation.tolerance)} m{' in all' if self.formation.total else ''}"
        name = f"the formation `{self.formation.name}`"
        return f"{name} holds {within}", f"{name} does not hold {within}"
