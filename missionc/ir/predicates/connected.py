"""Connectivity as a predicate: the graph, over some of its agents, is connected."""

from __future__ import annotations

from dataclasses import replace

from missionc.base.late_dataclass import dataclass
from missionc.ir.couplings import Graph
from missionc.ir.predicates.facts import PredicateFacts
from missionc.ir.predicates.views import Array, Borders, Changes, Measures, Phrases, Words


@dataclass(frozen=True, slots=True)
class Connected(PredicateFacts):
    """Between any two of these agents there is a route over these agents."""

    graph: Graph
    agents: tuple[int, ...]

    @property
    def about_team(self) -> bool:
        return True

    @property
    def others(self) -> frozenset[int]:
        return frozenset(self.agents)

    @property
    def open_border(self) -> bool:
        return True

    @property
    def restricted(self) -> Graph:
        return self.graph if self.agents == self.graph.agents else replace(self.graph, agents=self.agents)

    def among(self, agents: frozenset[int]) -> Connected | None:
        """These connected among themselves, which does not follow from the whole: its routes may go over the others."""
        members = tuple(agent for agent in self.agents if agent in agents)
        return self if members == self.agents else Connected(self.graph, members) if len(members) > 1 else None

    def margin(self, view: Measures) -> Array:
        return view.weakest_link(self.restricted)

    def rate(self, view: Changes) -> Array:
        raise ValueError("a kernel has routes in the place of `connected`")

    def moved(self, borders: Borders) -> Connected:
        return Connected(borders.graph(self.graph), self.agents)

    def show(self, words: Words) -> str:
        return f"connected({words.graph(self.graph, self.agents)})"

    def phrases(self, words: Phrases) -> tuple[str, str]:
        over = "" if self.agents == self.graph.agents else f" over {words.agents(self.agents)}"
        return f"`{self.graph.name}` is connected{over}", f"`{self.graph.name}` is not connected{over}"
