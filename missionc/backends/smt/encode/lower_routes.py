"""The encoding of routes: the places linked to a place, and the routes that start beside it."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from missionc.backends.smt.encode.clauses import NOTHING, TRUE, Literals
from missionc.backends.smt.encode.lower_on_demand import choose
from missionc.backends.smt.encode.occupancy import Agents, Define, Occupancy, Tables
from missionc.backends.smt.roadmap.roadmap import Indices
from missionc.ir import Graph
from missionc.kernel.nodes import Node


@dataclass(frozen=True, slots=True)
class Route:
    """Over ``through`` agents of the graph to an ``end`` agent."""

    graph: Graph
    through: Node
    end: Node

    @property
    def members(self) -> Agents:
        return frozenset(self.graph.agents)


class OfPlaces(Protocol):
    """Some of the agents is there of whom the formula holds; or it holds of each of them that is.

    Cells are a step and a place each, (cells,) twice, and literals (cells,).
    """

    def among(self, node: Node, some: bool, agents: Agents, steps: Indices, places: Indices) -> Literals: ...


class Routes:
    """Literals about the agents linked to whoever stands at a place. Cells are a step and a place each, (cells,) twice.

    ``most_links`` is how many links a route asked for may have at most, to keep
    the clauses few; ``shortened`` says whether any was to have more.
    """

    def __init__(self, occupancy: Occupancy, of_places: OfPlaces, most_links: int) -> None:
        self.occupancy, self.of_places, self.clauses = occupancy, of_places, occupancy.clauses
        self.most_links, self.shortened = most_links, False
        motion = occupancy.motion
        self._tables = Tables(motion.steps + 1, motion.places)
        self._groups: dict[Graph, Tables] = {}
        self._isolated: dict[Route, Literals] = {}

    def agent_beside(self, graph: Graph, body: Node, some: bool, steps: Indices, places: Indices) -> Literals:
        """At some linked place is an agent of the graph of whom the formula holds; or it holds of every one there."""
        members = frozenset(graph.agents)

        def ask(*cells: Indices) -> Literals:
            return self.of_places.among(body, some, members, *cells)

        return self._over_links((body, some), graph, some, ask, steps, places)

    def route_beside(self, route: Route, links: int, some: bool, steps: Indices, places: Indices) -> Literals:
        """A route of at most so many links starts at some linked place; or all that start there are as asked."""
        if not some and links >= len(route.members) - 2:
            return self._over_links(
                (route, "cut off"), route.graph, some, lambda *cells: self._cut_off(route, *cells), steps, places
            )
        if some:
            self.shortened |= links > self.most_links
            links = min(links, self.most_links)
        return self._over_links(
            (route, links, some),
            route.graph,
            some,
            lambda *cells: self._route(route, links, some, *cells),
            steps,
            places,
        )

    def _route(self, route: Route, links: int, some: bool, steps: Indices, places: Indices) -> Literals:
        """A route of at most so many links starts at an agent of the graph there; or all that do are as asked."""

        def define(steps: Indices, places: Indices) -> Literals:
            def start_at(node: Node, rows: Indices) -> Literals:
                return self.of_places.among(node, some, route.members, steps[rows], places[rows])

            if links == 0:
                return start_at(route.end, np.arange(len(steps)))
            return choose(
                self.clauses,
                some,
                len(steps),
                lambda rows: start_at(route.end, rows),
                lambda rows: start_at(route.through, rows),
                lambda rows: self.route_beside(route, links - 1, some, steps[rows], places[rows]),
            )

        return self._tables.look_up(("route", route, links, some), steps, places, define)

    def _cut_off(self, route: Route, steps: Indices, places: Indices) -> Literals:
        """All routes that start at an agent of the graph there are as asked, of whatever length.

        Such places are a set that no step of a route leaves unasked: to
        say so takes no layers. Each place is about those beside it, so all of a
        step are named together.
        """
        shape = (self.occupancy.motion.steps + 1, self.occupancy.motion.places)
        table = self._isolated.setdefault(route, np.full(shape, NOTHING, dtype=np.int32))
        moments = np.unique(steps[table[steps, places] == NOTHING])
        if moments.size:
            step, place = np.repeat(moments, shape[1]), np.tile(np.arange(shape[1]), len(moments))
            possible = self.occupancy.presence(route.members, step, place) != -TRUE
            table[moments] = TRUE
            step, place = step[possible], place[possible]
            table[step, place] = names = self.clauses.fresh(len(step))
            self.clauses.add(-names, self.of_places.among(route.end, False, route.members, step, place))
            through = self.of_places.among(route.through, False, route.members, step, place)
            _, owner, linked = self.occupancy.motion.linked(route.graph).beside(place)
            beyond = self._each(
                (route, "cut off"), route.graph, False, lambda *cells: table[cells], step[owner], linked
            )
            self.clauses.add(-names[owner], through[owner], beyond)
        return table[steps, places]

    def _over_links(
        self, what: Hashable, graph: Graph, some: bool, ask: Define, steps: Indices, places: Indices
    ) -> Literals:
        """What is asked holds at some linked place; or, not ``some``, at every one."""

        links = self.occupancy.motion.linked(graph)

        def define(steps: Indices, places: Indices) -> Literals:
            sizes, owner, linked = links.beside(places)
            literals = self._each(what, graph, some, ask, steps[owner], linked)
            return (self.clauses.any_of_ragged if some else self.clauses.all_of_ragged)(literals, sizes)

        return self._tables.look_up(("links", graph, what), steps, links.same[places], define)

    def _each(self, what: Hashable, graph: Graph, some: bool, ask: Define, steps: Indices, linked: Indices) -> Literals:
        """What is asked of each of these places; of a group, that it holds at some place of it, or at every one."""
        places, groups = self.occupancy.motion.places, self.occupancy.motion.linked(graph).groups
        if not len(groups):
            return ask(steps, linked)

        def define(steps: Indices, group: Indices) -> Literals:
            parts = groups[group]
            inside = self._each(what, graph, some, ask, np.repeat(steps, parts.shape[1]), parts.ravel())
            matrix = inside.reshape(parts.shape)
            return self.clauses.any_of(matrix) if some else self.clauses.all_of(matrix)

        result = np.empty(len(linked), dtype=np.int32)
        alone = linked < places
        result[alone] = ask(steps[alone], linked[alone])
        if not alone.all():
            if graph not in self._groups:
                self._groups[graph] = Tables(self.occupancy.motion.steps + 1, len(groups))
            tables = self._groups[graph]
            result[~alone] = tables.look_up(what, steps[~alone], linked[~alone] - places, define)
        return result
