"""Connectivity as a predicate: the graph over some agents is connected, also without any few of them.

Source:
    Diestel, "Graph Theory" (2017), 1.4: a graph is k-connected if it has more than k vertices and no set of fewer than
    k vertices separates it. If a smaller set separates it, so does some set of k - 1; only sets of k - 1 are tested.
"""

from __future__ import annotations

from dataclasses import replace
from functools import reduce
from itertools import combinations

from missionc.base.late_dataclass import dataclass
from missionc.ir.couplings import Graph
from missionc.ir.predicates.facts import PredicateFacts
from missionc.ir.predicates.views import Array, Borders, Changes, Measures, Phrases, Words


@dataclass(frozen=True, slots=True)
class Connected(PredicateFacts):
    """Connectivity predicate: routes among ``agents`` join any two of them, also after the loss of any ``order - 1`` of
    them.

    ``order`` is at least 1; above 1 it is less than the number of agents.
    """

    graph: Graph
    agents: tuple[int, ...]
    order: int = 1

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
        """Connectivity among the agents that are also in ``agents``; None if fewer than two remain.

        The connectivity of all agents does not imply the result, since routes may pass through the others.
        """
        members = tuple(agent for agent in self.agents if agent in agents)
        if members == self.agents:
            return self
        return Connected(self.graph, members, min(self.order, len(members) - 1)) if len(members) > 1 else None

    @property
    def parts(self) -> tuple[Connected, ...]:
        if self.order == 1:
            return (self,)
        rests = combinations(self.agents, len(self.agents) - self.order + 1)
        return tuple(Connected(self.graph, rest) for rest in rests)

    def margin(self, view: Measures) -> Array:
        """Margin of connectivity: worst link of the maximum spanning tree, over the worst loss of agents; (...),
        metres."""
        worst = [-view.weakest_link(part.restricted) for part in self.parts]
        return -reduce(view.larger, worst)

    def rate(self, view: Changes) -> Array:
        """Raise ``ValueError``: kernels express connectivity by routes, so its margin has no rate."""
        raise ValueError("a kernel has routes in the place of `connected`")

    def moved(self, borders: Borders) -> Connected:
        return Connected(borders.graph(self.graph), self.agents, self.order)

    def show(self, words: Words) -> str:
        order = "" if self.order == 1 else f", {self.order}"
        return f"connected({words.graph(self.graph, self.agents)}{order})"

    def phrases(self, words: Phrases) -> tuple[str, str]:
        over = "" if self.agents == self.graph.agents else f" over {words.agents(self.agents)}"
        some = "any one" if self.order == 2 else f"any {self.order - 1}"
        lost = "" if self.order == 1 else f", also without {some} of its agents"
        return f"`{self.graph.name}` is connected{over}{lost}", f"`{self.graph.name}` is not connected{over}{lost}"
