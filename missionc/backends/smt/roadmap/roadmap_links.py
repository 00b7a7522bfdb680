"""Communication links between roadmap states, grouped to share clauses.

With velocities and headings, many states are near each other and have mostly the same links. States are therefore
ordered so that neighbours are adjacent. If a whole aligned run of that order is linked to a state, it is one group.

Source:
    de Berg et al., "Computational Geometry" (2008), 10.3: runs are the nodes of a segment tree, over the leaves of a
    kd-tree (5.2).
"""

from __future__ import annotations

import numpy as np

from missionc.base.late_dataclass import Record
from missionc.base.trace import Array, Flags, Indices
from missionc.geometry.vectors import distinct
from missionc.ir import Graph
from missionc.ir.language.margins.links import places_linked

DENSE = 32
"""Number of links per state above which groups save more than they cost."""

BLOCK = 1 << 20
"""Number of pairs of states processed at once."""

WIDTH = 4
"""Number of states, or groups, in a group."""


class Links(Record, eq=False):
    """For each roadmap state (place), the other states linked to it.

    No two agents are ever at one point. States at the same point therefore have equal links, and none to each other.

    Args:
        first: index of each state's first link, (places + 1,); of several states at a point, only the first has links.
        linked: linked states, and groups after them, (links,): index ``places + i`` stands for group ``i``.
        groups: states and groups in each group, (groups, 4).
        same: first state at the same point, (places,).
    """

    first: Indices
    linked: Indices
    groups: Indices
    same: Indices

    def beside(self, places: Indices) -> tuple[Indices, Indices, Indices]:
        """Links of these states, in sequence.

        Returns:
            number of links of each state, (places,); owner of each link, as a position in ``places``; and the linked
            state, in the same order.
        """
        places = self.same[places]
        sizes = np.diff(self.first)[places]
        owner = np.repeat(np.arange(len(places)), sizes)
        within = np.arange(len(owner)) - np.repeat(np.cumsum(sizes) - sizes, sizes)
        return sizes, owner, self.linked[self.first[places][owner] + within]


def links_between(graph: Graph, position: Array) -> Links:
    """Links of a graph between states at these positions, (places, dim), metres."""
    first, point = distinct(position)
    points = position[first]
    order, levels, groups = np.arange(len(position)), 0, np.zeros((0, WIDTH), dtype=np.int64)
    if _linked_to_each(graph, points, position) > DENSE:
        order = _neighbours_together(position)
        levels = max(1, (len(position).bit_length() - 1) // 2)
        groups = _groups(order, levels)
    sizes, linked = LinkPlaces(graph, points, first, point).links(order, levels)
    return Links(np.concatenate([[0], np.cumsum(sizes)]), linked, groups, first[point])


def _linked_to_each(graph: Graph, points: Array, position: Array) -> float:
    """Mean number of states, at (places, dim), metres, that are linked to one of the points, (points, dim), metres."""
    sampled = 128  # points at which links are counted
    some = points[:: max(1, len(points) // sampled)]
    linked = places_linked(graph, some[:, None, :], position[None, :, :])
    return float(linked.sum() / max(1, len(some)))


class LinkPlaces(Record, eq=False):
    """States and their distinct positions.

    Args:
        points: distinct positions, (points, dim), metres.
        first: first state at each position, (points,).
        point: index of each state's position, (places,).
    """

    graph: Graph
    points: Array
    first: Indices
    point: Indices

    def links(self, order: Indices, levels: int) -> tuple[Indices, Indices]:
        """Number of links of each state, (places,), and all links, state by state.

        Args:
            order: order of the states, (places,); groups are runs of it.
            levels: number of levels of groups.
        """
        places, column_of = len(order), self.point[order]
        sizes, links = np.zeros(places, dtype=np.int64), [np.zeros(0, dtype=np.int64)]
        by_place = np.argsort(self.first)
        block = max(1, BLOCK // max(1, places))
        for start in range(0, len(by_place), block):
            rows = by_place[start : start + block]
            near = places_linked(self.graph, self.points[rows, None, :], self.points[None, :, :])
            near[np.arange(len(rows)), rows] = False
            whole: Flags = np.zeros((len(rows), _padded(places, levels)), dtype=np.bool_)
            whole[:, :places] = near[:, column_of]
            parts = []
            for level in range(levels + 1):
                above = whole[:, :0]
                if level < levels:
                    above = np.asarray(whole.reshape(len(rows), -1, WIDTH).all(axis=-1))
                    whole &= ~np.repeat(above, WIDTH, axis=1)
                parts.append(whole if level else whole[:, :places])
                whole = above
            row, column = np.nonzero(np.concatenate(parts, axis=1))
            sizes[self.first[rows]] = np.bincount(row, minlength=len(rows))
            links.append(np.where(column < places, order[np.minimum(column, places - 1)], column))
        return sizes, np.concatenate(links)


def _groups(order: Indices, levels: int) -> Indices:
    """Members of each group, (groups, 4), level by level; incomplete runs are unused."""
    places = len(order)
    width = _padded(places, levels)
    below = np.concatenate([order, np.zeros(width - places, dtype=np.int64)])
    groups, first = [], places
    for _ in range(levels):
        groups.append(below.reshape(-1, WIDTH))
        below = first + np.arange(len(groups[-1]))
        first += len(below)
    return np.concatenate(groups)


def _padded(places: int, levels: int) -> int:
    """Number of states rounded up to whole groups at every level."""
    run = int(WIDTH**levels)
    return -(-places // run) * run


def _neighbours_together(position: Array) -> Indices:
    """Order of states, (places,), in which near states are adjacent: recursive bisection across the longer side.

    Args:
        position: (places, dim), metres.
    """
    order = np.arange(len(position))
    size = 1 << max(0, len(position) - 1).bit_length()
    while size > WIDTH:
        for start in range(0, len(order), size):
            part = order[start : start + size]
            sides: Array = np.ptp(position[part], axis=0)
            order[start : start + size] = part[np.argsort(position[part, int(sides.argmax())], kind="stable")]
        size //= 2
    return order
