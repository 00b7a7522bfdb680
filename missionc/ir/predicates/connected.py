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
