"""Witnesses of routes bounded in metres: the links of one route, or a violation of every route, at one step.

The existence of a route depends on one route: its links, agents and length. The absence depends on a violation of every
route, and one violation may apply to many routes.
"""

from __future__ import annotations

from collections.abc import Iterator
from heapq import heappop, heappush
from itertools import pairwise
from typing import Literal, TypeAlias

import numpy as np

from missionc.base.late_dataclass import Record
from missionc.base.trace import Array, Flags
from missionc.verification.monitoring.graph_routes import shortest

ROUNDING = 1e-9
"""Rounding difference of sums in another order, metres."""

Members: TypeAlias = tuple[int, ...]
"""Members of a graph, by index."""

Piece: TypeAlias = tuple[Literal["link", "through", "end", "shorter", "longer"], Members]
"""Condition of a route: a link of two members (or its absence), the through or end condition of one member, or a length
of the route below, or above, its bound."""


class RoutePoint(Record, eq=False):
    """Graph at one step, for routes of ``low`` to ``high`` metres.

    Args:
        links: link margins, (members, members), from and to, metres; ``lengths``: link lengths, likewise.
        closest: least allowed distances of the bodies, (members, members), metres.
        through: value of each agent on a route except the last, (members,), metres; ``end``: value of the last.
        one_way: True for directed links.
    """

    links: Array
    lengths: Array
    closest: Array
    through: Array
    end: Array
    low: float
    high: float
    one_way: bool = False

    def link(self, one: int, other: int) -> Piece:
        """Link condition from one member to another; for undirected links, both directions are the same."""
        return ("link", (one, other)) if self.one_way else ("link", (min(one, other), max(one, other)))


def that_make(place: RoutePoint, start: int, worth: float) -> set[Piece]:
    """Conditions that imply the best route from a member.

    Args:
        start: index of the member.
        worth: value of the best route, metres.
    """
    route = _route(place, start, worth - ROUNDING)
    pieces: set[Piece] = {("end", route[-1:])}
    for one, other in pairwise(route):
        pieces |= {place.link(one, other), ("through", (one,))}
    if len(route) > 1 and np.isfinite(place.high):
        pieces.add(("shorter", route))
    if place.low > 0:
        pieces.add(("longer", route))
    return pieces


def that_break(place: RoutePoint, start: int, worth: float) -> set[Piece]:
    """For each route from a member, its best violation, unless a violation selected for another route suffices.

    Args:
        place: graph with ``through`` and ``end`` in the form for violations.
        worth: value of the worst route's best violation, metres: a lower bound for all selected violations.
    """
    clear = 0.4  # metres of shortfall at one link or agent, from which the rest of a route does not count
    most = 300  # number of route beginnings considered, the shortest first
    enough = max(worth, clear) - ROUNDING
    parted, passed, closed = -place.links >= enough, place.through >= enough, place.end >= enough
    metres = _metres(place, ~parted & ~passed[:, None])
    reached = np.isfinite(shortest(metres.T[None], np.arange(len(parted))[None] == start)[0])
    border = np.argwhere(parted & (reached & ~passed)[:, None]).tolist()
    pieces = {place.link(one, other) for one, other in border if one != other}
    pieces |= {("through", (one,)) for one in np.flatnonzero(reached & passed).tolist()}
    pieces |= {("end", (one,)) for one in np.flatnonzero(reached & closed).tolist()}
    left = shortest(metres[None], ~closed[None])[0]
    queue: list[tuple[float, Members, float]] = [(left[start], (start,), 0.0)]
    for _ in range(most):
        if not queue:
            break
        _, route, length = heappop(queue)
        crossed = ((place.link(one, other), ("through", (one,))) for one, other in pairwise(route))
        if any(not pieces.isdisjoint(each) for each in crossed):
            continue
        here = route[-1]
        if (len(route) > 1 or place.low <= 0) and ("end", (here,)) not in pieces:
            pieces.add(max(_breaking(place, route, length), key=lambda each: each[0])[1])
        for after in np.flatnonzero(np.isfinite(metres[here] + left)).tolist():
            longer = length + metres[here, after]
            if after not in route and longer + left[after] <= place.high + enough + 2 * ROUNDING:
                heappush(queue, (longer + left[after], (*route, after), longer))
    return pieces


def _breaking(place: RoutePoint, route: Members, length: float) -> Iterator[tuple[float, Piece]]:
    """Yield every violation of a route, with its value, metres."""
    yield place.end[route[-1]], ("end", route[-1:])
    for one, other in pairwise(route):
        yield -place.links[one, other], place.link(one, other)
        yield place.through[one], ("through", (one,))
    if len(route) > 1:
        yield length - place.high, ("longer", route)
        if place.low > sum(place.closest[one, other] for one, other in pairwise(route)):
            yield place.low - length, ("shorter", route)


def _route(place: RoutePoint, start: int, enough: float) -> Members:
    """Route whose parts all have a value of at least ``enough``; shortest paths are tried first."""
    ends = place.end >= enough
    if place.low <= 0 and ends[start]:
        return (start,)
    metres = _metres(place, (place.links >= enough) & (place.through >= enough)[:, None])
    left = shortest(metres[None], ends[None])[0]
    stack: list[tuple[Members, float]] = [((start,), 0.0)]
    while stack:
        route, length = stack.pop()
        here = route[-1]
        if len(route) > 1 and ends[here] and (place.low <= 0 or length - place.low >= enough):
            return route
        whole = length + metres[here] + left
        onward = np.flatnonzero(np.isfinite(whole) & (whole <= place.high - enough))
        nearest_last = onward[np.argsort(-whole[onward], kind="stable")].tolist()
        stack.extend(((*route, after), length + metres[here, after]) for after in nearest_last if after not in route)
    raise AssertionError("no route is worth so much")


def _metres(place: RoutePoint, usable: Flags) -> Array:
    """Lengths of the usable links, (members, members), metres; infinite for others."""
    return np.where(usable & ~np.eye(len(usable), dtype=np.bool_), place.lengths, np.inf)
