"""Encoding of routes: the roadmap states linked to a state, and the routes that start there.

Links of a graph by kinds of agents, since the range depends on the two agents.

Encoding of routes bounded in metres: bounded search over states and remaining length.

Links between roadmap states have known lengths, in units into which the bound is divided. They are rounded up for
*some* route and down for *every* route, so that results in units hold in metres too. A single link is never rounded
past the bound: routes of at most one link are exact.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable
from functools import lru_cache, partial
from typing import Protocol, TypeAlias

import numpy as np

from missionc.backends.smt.encode.clauses import FALSE, NOTHING, TRUE, Literals
from missionc.backends.smt.encode.lower_motion import Agents, Define, Occupancy, Tables
from missionc.backends.smt.encode.lower_on_demand import choose, join
from missionc.backends.smt.roadmap.roadmap_links import BLOCK
from missionc.base.late_dataclass import Record
from missionc.base.trace import Array, Indices
from missionc.geometry.vectors import distinct
from missionc.ir import Graph
from missionc.ir.couplings import between, kinds, range_of
from missionc.ir.distances.signed_distance import distance_between
from missionc.ir.kernel.nodes import Node
from missionc.ir.language.margins.links import places_linked

KEPT = 256
"""Maximum number of cached graphs and kinds."""


@lru_cache(maxsize=KEPT)
def kinds_of(graph: Graph) -> tuple[Agents, ...]:
    """Partition of the graph's agents into kinds with equal link ranges."""
    return tuple(map(frozenset, kinds(graph)))


def kind_of(graph: Graph, agent: int) -> Agents:
    """Kind that contains an agent of the graph."""
    return next(kind for kind in kinds_of(graph) if agent in kind)


@lru_cache(maxsize=KEPT)
def links_from(graph: Graph, senders: Agents) -> tuple[tuple[Graph, Agents], ...]:
    """Possible receivers of links from agents of a kind: each kind of agents, with a graph that has the range of the
    pair.

    Kinds out of range, and links of an agent to itself, are omitted.
    """
    onward = []
    for receivers in kinds_of(graph):
        one, other = min(senders), max(receivers)
        if one != other and range_of(graph, one, other) > 0:
            onward.append((between(graph, one, other), receivers))
    return tuple(onward)


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


Way: TypeAlias = tuple[Graph, Agents]
"""Links of one range, and the agents that receive them."""

UNITS = 12
"""Number of units of a bound: a route of n links loses at most n - 1 units."""

ROUNDING = 1e-9
"""Relative rounding error of summed lengths."""


class MeasuredLinks(Record, eq=False):
    """For each roadmap state, the other states linked to it within a bound.

    Args:
        first: index of each state's first link, (places + 1,).
        linked: linked states, (links,).
        units: rounded length of each link, (links,).
    """

    first: Indices
    linked: Indices
    units: Indices

    def beside(self, places: Indices, most: int) -> tuple[Indices, Indices, Indices, Indices]:
        """Links of these states of at most ``most`` units.

        Returns:
            number of links of each state, (places,); and by link: its owner as a position in ``places``, the linked
            state, and its units.
        """
        sizes = np.diff(self.first)[places]
        owner = np.repeat(np.arange(len(places)), sizes)
        link = self.first[places][owner] + np.arange(len(owner)) - np.repeat(np.cumsum(sizes) - sizes, sizes)
        kept = self.units[link] <= most
        owner, link = owner[kept], link[kept]
        return np.bincount(owner, minlength=len(places)), owner, self.linked[link], self.units[link]


class MetricRoutes:
    """Literals about routes with a length in metres; a cell is a pair of step and roadmap state (place), (cells,)
    each."""

    def __init__(self, occupancy: Occupancy, of_places: OfPlaces) -> None:
        self.occupancy, self.of_places, self.clauses = occupancy, of_places, occupancy.clauses
        self._shape = (occupancy.motion.steps + 1, occupancy.motion.places)
        self._tables = Tables(*self._shape)
        self._every: dict[tuple[Route, float], Literals] = {}
        self._lengths: dict[tuple[Hashable, float], tuple[Indices, Indices, Array]] = {}
        self._links: dict[tuple[Hashable, float, bool], MeasuredLinks] = {}

    def route_beside(
        self, route: Route, senders: Agents, metres: float, some: bool, steps: Indices, places: Indices
    ) -> Literals:
        """Literals that a route of at most ``metres`` from an agent of ``senders`` in the cell continues at a linked
        agent: (cells,).

        Without ``some``, the literals imply that every such route satisfies the conditions.
        """
        if some:
            return self._onward(route, senders, metres, UNITS, steps, places)
        self._name_every(route, metres, steps)

        def beyond(way: Way) -> Literals:
            links, receivers = way
            sizes, owner, linked, units = self._measured(links, metres, False).beside(places, UNITS)
            names = self._every[route, metres][self._number(route, receivers)]
            return self.clauses.all_of_ragged(names[steps[owner], UNITS - units, linked], sizes)

        return self._all_ways(route, senders, False, len(steps), beyond)

    def _all_ways(
        self, route: Route, senders: Agents, some: bool, count: int, ask: Callable[[Way], Literals]
    ) -> Literals:
        """Literals of a condition on links to some kind of agents (``some``), or on the links to every kind:
        (count,)."""
        ways = links_from(route.graph, senders)
        if len(ways) == 1:
            return ask(ways[0])
        columns = [np.full(count, FALSE if some else TRUE, dtype=np.int32), *map(ask, ways)]
        return (self.clauses.any_of if some else self.clauses.all_of)(np.stack(columns, axis=1))

    def _number(self, route: Route, agents: Agents) -> int:
        return kinds_of(route.graph).index(agents)

    # ------------------------------------------------------------- some route

    def _onward(
        self, route: Route, senders: Agents, metres: float, left: int, steps: Indices, places: Indices
    ) -> Literals:
        def define(steps: Indices, places: Indices) -> Literals:
            def start(way: Way) -> Literals:
                links, receivers = way
                sizes, owner, linked, units = self._measured(links, metres, True).beside(places, left)
                literals = np.full(len(owner), FALSE, dtype=np.int32)
                for unit in np.unique(units).tolist():
                    rows = np.flatnonzero(units == unit)
                    there = steps[owner[rows]], linked[rows]
                    literals[rows] = self._start(route, receivers, metres, left - unit, *there)
                return self.clauses.any_of_ragged(literals, sizes)

            return self._all_ways(route, senders, True, len(steps), start)

        return self._tables.look_up(("onward", route, senders, metres, left), steps, places, define)

    def _start(
        self, route: Route, senders: Agents, metres: float, left: int, steps: Indices, places: Indices
    ) -> Literals:
        """Literals that a route of at most ``left`` units starts at an agent of ``senders`` in the cell: (cells,)."""

        def define(steps: Indices, places: Indices) -> Literals:
            def start_at(node: object, rows: Indices) -> Literals:
                asked = route.end if node == "end" else route.through
                return self.of_places.among(asked, True, senders, steps[rows], places[rows])

            return choose(
                self.clauses,
                True,
                len(steps),
                lambda rows: start_at("end", rows),
                lambda rows: start_at("through", rows),
                lambda rows: self._onward(route, senders, metres, left, steps[rows], places[rows]),
            )

        return self._tables.look_up(("start", route, senders, metres, left), steps, places, define)

    # ------------------------------------------------------------ every route

    def _name_every(self, route: Route, metres: float, steps: Indices) -> None:
        """Create literals, for each remaining length, that all routes of that length from a state satisfy the
        conditions.

        No link within its length leads out of the set of such states. A link may have zero units, so all states of a
        step get literals together, for agents of every kind.
        """
        alike = kinds_of(route.graph)
        shape = (len(alike), self._shape[0], UNITS + 1, self._shape[1])
        table = self._every.setdefault((route, metres), np.full(shape, NOTHING, dtype=np.int32))
        moments = np.unique(steps[table[0, steps, 0, 0] == NOTHING])
        if not moments.size:
            return
        step, place = np.repeat(moments, shape[3]), np.tile(np.arange(shape[3]), len(moments))
        table[:, moments] = TRUE
        possible = [self.occupancy.presence(kind, step, place) != FALSE for kind in alike]
        for here, there in zip(table, possible, strict=True):
            for left in range(UNITS + 1):
                here[step[there], left, place[there]] = self.clauses.fresh(int(there.sum()))
        for kind, there in zip(alike, possible, strict=True):
            self._say_every(route, metres, kind, step[there], place[there])

    def _say_every(self, route: Route, metres: float, senders: Agents, step: Indices, place: Indices) -> None:
        """Add the clauses that define the literals of ``_name_every`` for agents ``senders`` at the cells."""
        table = self._every[route, metres]
        own = table[self._number(route, senders)]
        ends = self.of_places.among(route.end, False, senders, step, place)
        through = self.of_places.among(route.through, False, senders, step, place)
        for left in range(UNITS + 1):
            self.clauses.add(-own[step, left, place], ends)
        for links, receivers in links_from(route.graph, senders):
            there = table[self._number(route, receivers)]
            _, owner, linked, units = self._measured(links, metres, False).beside(place, UNITS)
            self.clauses.reserve((UNITS + 1) * (len(place) + len(owner)) // 2)
            for left in range(UNITS + 1):
                names = own[step, left, place]
                near = np.flatnonzero(units <= left)
                beyond = there[step[owner[near]], left - units[near], linked[near]]
                self.clauses.add(-names[owner[near]], through[owner[near]], beyond)

    # ---------------------------------------------------------------- lengths

    def _measured(self, graph: Graph, metres: float, up: bool) -> MeasuredLinks:
        """Links of at most ``metres``, with lengths in units rounded up (``up``) or down."""
        key = graph.rule, metres, up
        if key not in self._links:
            first, linked, length = self._within(graph, metres)
            share = length / metres * UNITS if metres > 0 else length
            if up:
                units = np.clip(np.ceil(share * (1 + ROUNDING)), 1, UNITS)
                units[length > metres] = UNITS + 1
            else:
                units = np.floor(share * (1 - ROUNDING))
            self._links[key] = MeasuredLinks(first, linked, units.astype(np.int64))
        return self._links[key]

    def _within(self, graph: Graph, metres: float) -> tuple[Indices, Indices, Array]:
        """Links of at most ``metres``: index of each state's first link, (places + 1,), linked states, and lengths,
        metres, (links,) each."""
        key = graph.rule, metres
        if key not in self._lengths:
            position = self.occupancy.motion.position
            _, point = distinct(position)
            sizes, linked, lengths = [np.zeros(0, np.int64)], [np.zeros(0, np.int64)], [np.zeros(0)]
            block = max(1, BLOCK // max(1, len(position)))
            for start in range(0, len(position), block):
                rows = np.arange(start, min(start + block, len(position)))
                here, there = position[rows, None, :], position[None, :, :]
                length = np.asarray(distance_between(np, here, there))
                near = places_linked(graph, here, there) & (length <= metres * (1 + ROUNDING))
                near &= point[rows, None] != point[None, :]
                row, column = np.nonzero(near)
                sizes.append(np.bincount(row, minlength=len(rows)))
                linked.append(column)
                lengths.append(length[row, column])
            begins = np.concatenate([[0], np.cumsum(np.concatenate(sizes))])
            self._lengths[key] = begins, np.concatenate(linked), np.concatenate(lengths)
        return self._lengths[key]
