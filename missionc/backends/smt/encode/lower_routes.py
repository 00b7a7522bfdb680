"""Encoding of routes: the roadmap states linked to a state, and the routes that start there."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from functools import partial
from typing import Protocol

import numpy as np

from missionc.backends.smt.encode.clauses import NOTHING, TRUE, Literals
from missionc.backends.smt.encode.kinds_of_links import kinds_of, links_from
from missionc.backends.smt.encode.lower_on_demand import choose, join
from missionc.backends.smt.encode.occupancy import Agents, Define, Occupancy, Tables
from missionc.base.late_dataclass import Record
from missionc.base.trace import Indices
from missionc.ir import Graph
from missionc.ir.kernel.nodes import Node

Ahead = Callable[[Agents, Indices, Indices], Literals]
"""Function from a kind of agents and cells to the literals of a condition."""


class Route(Record):
    """Route over ``through`` agents of the graph to an ``end`` agent."""

    graph: Graph
    through: Node
    end: Node

    @property
    def members(self) -> Agents:
        return frozenset(self.graph.agents)


class OfPlaces(Protocol):
    """Interface of literals that some of the agents is in a state and satisfies a formula, or that each of them does.

    A cell is a pair of step and state (place), (cells,) each; literals are (cells,).
    """

    def among(self, node: Node, some: bool, agents: Agents, steps: Indices, places: Indices) -> Literals: ...


class Routes:
    """Literals about agents linked to the agent in a roadmap state; a cell is a pair of step and state (place),
    (cells,) each.

    ``most_links`` limits the links of a required route, to limit the number of clauses; ``shortened`` is true if some
    route would allow more links.
    """

    def __init__(self, occupancy: Occupancy, of_places: OfPlaces, most_links: int) -> None:
        self.occupancy, self.of_places, self.clauses = occupancy, of_places, occupancy.clauses
        self.most_links, self.shortened = most_links, False
        motion = occupancy.motion
        self._tables = Tables(motion.steps + 1, motion.places)
        self._groups: dict[Hashable, Tables] = {}
        self._isolated: dict[Route, Literals] = {}

    def agent_beside(
        self, graph: Graph, senders: Agents, body: Node, some: bool, steps: Indices, places: Indices
    ) -> Literals:
        """Literals that an agent linked to an agent of ``senders`` in the state satisfies the formula, or without
        ``some``, that all such agents do: (cells,)."""

        def ask(receivers: Agents, *cells: Indices) -> Literals:
            return self.of_places.among(body, some, receivers, *cells)

        return self._over_links((body, some), graph, senders, some, ask, steps, places)

    def route_beside(
        self, route: Route, senders: Agents, links: int, some: bool, steps: Indices, places: Indices
    ) -> Literals:
        """Literals that a route of at most ``links`` links starts at an agent linked to ``senders`` in the state, or
        without ``some``, that all such routes satisfy the conditions: (cells,)."""

        def cut_off(receivers: Agents, *cells: Indices) -> Literals:
            return self._cut_off(route, receivers, *cells)

        def start(receivers: Agents, *cells: Indices) -> Literals:
            return self._route(route, receivers, links, some, *cells)

        if not some and links >= len(route.members) - 2:
            return self._over_links((route, "cut off"), route.graph, senders, some, cut_off, steps, places)
        if some:
            self.shortened |= links > self.most_links
            links = min(links, self.most_links)
        return self._over_links((route, links, some), route.graph, senders, some, start, steps, places)

    def _route(
        self, route: Route, senders: Agents, links: int, some: bool, steps: Indices, places: Indices
    ) -> Literals:
        """Literals that a route of at most ``links`` links starts at an agent of ``senders`` in the state, or without
        ``some``, that all such routes satisfy the conditions: (cells,)."""

        def define(steps: Indices, places: Indices) -> Literals:
            def start_at(node: Node, rows: Indices) -> Literals:
                return self.of_places.among(node, some, senders, steps[rows], places[rows])

            if links == 0:
                return start_at(route.end, np.arange(len(steps)))
            return choose(
                self.clauses,
                some,
                len(steps),
                lambda rows: start_at(route.end, rows),
                lambda rows: start_at(route.through, rows),
                lambda rows: self.route_beside(route, senders, links - 1, some, steps[rows], places[rows]),
            )

        return self._tables.look_up(("route", route, senders, links, some), steps, places, define)

    def _cut_off(self, route: Route, senders: Agents, steps: Indices, places: Indices) -> Literals:
        """Literals that all routes, of any length, from an agent of ``senders`` in the state satisfy the conditions:
        (cells,).

        Such states form a set that no link of a route leaves without the condition, so no layers are needed. Each state
        depends on its neighbours, so all states of a step get literals together, for agents of every kind.
        """
        alike = kinds_of(route.graph)
        shape = (len(alike), self.occupancy.motion.steps + 1, self.occupancy.motion.places)
        table = self._isolated.setdefault(route, np.full(shape, NOTHING, dtype=np.int32))
        number = alike.index(senders)
        moments = np.unique(steps[table[number, steps, places] == NOTHING])
        if moments.size:
            step, place = np.repeat(moments, shape[2]), np.tile(np.arange(shape[2]), len(moments))
            table[:, moments] = TRUE
            possible = [self.occupancy.presence(kind, step, place) != -TRUE for kind in alike]
            for here, there in zip(table, possible, strict=True):
                here[step[there], place[there]] = self.clauses.fresh(int(there.sum()))
            for here, there, kind in zip(table, possible, alike, strict=True):
                self._say_cut_off(route, kind, here, step[there], place[there])
        return _looked_up(table[number], steps, places)

    def _say_cut_off(self, route: Route, senders: Agents, table: Literals, step: Indices, place: Indices) -> None:
        """Add the clauses that define the literals of ``_cut_off``, (steps + 1, places), for agents ``senders`` at the
        cells."""
        names = table[step, place]
        self.clauses.add(-names, self.of_places.among(route.end, False, senders, step, place))
        through = self.of_places.among(route.through, False, senders, step, place)
        alike = kinds_of(route.graph)
        for links, receivers in links_from(route.graph, senders):
            beyond_table = self._isolated[route][alike.index(receivers)]
            _, owner, linked = self.occupancy.motion.linked(links).beside(place)
            what = (route, "cut off"), receivers
            beyond = self._each(what, links, False, partial(_looked_up, beyond_table), step[owner], linked)
            self.clauses.add(-names[owner], through[owner], beyond)

    def _over_links(
        self, what: Hashable, graph: Graph, senders: Agents, some: bool, ask: Ahead, steps: Indices, places: Indices
    ) -> Literals:
        """Literals that the condition is true at some state linked to an agent of ``senders`` in the cell, or without
        ``some``, at every such state: (cells,)."""

        def onward(links: Graph, receivers: Agents, steps: Indices, places: Indices) -> Literals:
            return self._over_links_to((what, receivers), links, some, partial(ask, receivers), steps, places)

        ways = links_from(graph, senders)
        if len(ways) == 1:
            return onward(*ways[0], steps, places)

        def of_way(way: tuple[Graph, Agents], rows: Indices) -> Literals:
            return onward(*way, steps[rows], places[rows])

        return join(self.clauses, not some, len(steps), [partial(of_way, way) for way in ways])

    def _over_links_to(
        self, what: Hashable, graph: Graph, some: bool, ask: Define, steps: Indices, places: Indices
    ) -> Literals:
        """Literals that the condition on agents of one kind is true at some linked state, or without ``some``, at every
        linked state: (cells,)."""
        links = self.occupancy.motion.linked(graph)

        def define(steps: Indices, places: Indices) -> Literals:
            sizes, owner, linked = links.beside(places)
            literals = self._each(what, graph, some, ask, steps[owner], linked)
            return (self.clauses.any_of_ragged if some else self.clauses.all_of_ragged)(literals, sizes)

        return self._tables.look_up(("links", graph.rule, what), steps, links.same[places], define)

    def _each(self, what: Hashable, graph: Graph, some: bool, ask: Define, steps: Indices, linked: Indices) -> Literals:
        """Literals of the condition at each of the ``linked`` states; at a group of states, of the condition at some
        state of the group, or without ``some``, at every state."""
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
            if graph.rule not in self._groups:
                self._groups[graph.rule] = Tables(self.occupancy.motion.steps + 1, len(groups))
            tables = self._groups[graph.rule]
            result[~alone] = tables.look_up(what, steps[~alone], linked[~alone] - places, define)
        return result


def _looked_up(table: Literals, steps: Indices, places: Indices) -> Literals:
    literals: Literals = table[steps, places]
    return literals
