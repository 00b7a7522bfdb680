"""Encoding of routes bounded in metres: bounded search over states and remaining length.

Links between roadmap states have known lengths, in units into which the bound is divided. They are rounded up for
*some* route and down for *every* route, so that results in units hold in metres too. A single link is never rounded
past the bound: routes of at most one link are exact.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable
from typing import TypeAlias

import numpy as np

from missionc.backends.smt.encode.clauses import FALSE, NOTHING, TRUE, Literals
from missionc.backends.smt.encode.kinds_of_links import kinds_of, links_from
from missionc.backends.smt.encode.lower_on_demand import choose
from missionc.backends.smt.encode.lower_routes import OfPlaces, Route
from missionc.backends.smt.encode.occupancy import Agents, Occupancy, Tables
from missionc.backends.smt.roadmap.roadmap_links import BLOCK
from missionc.base.late_dataclass import Record
from missionc.base.trace import Array, Indices
from missionc.geometry.vectors import distinct
from missionc.ir import Graph
from missionc.ir.distances.signed_distance import distance_between
from missionc.ir.language.margins.links import places_linked

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
