"""Geodesic bounds in the plane: shortest path length between two sets around bodies, and widest passage."""

from __future__ import annotations

import heapq
import math
from collections.abc import Iterator

import numpy as np
import shapely
from numpy.typing import NDArray

from missionc.base.late_dataclass import Record
from missionc.base.trace import Array, Flags

HAIR = 1e-6
"""Depth, metres, by which a line of sight may cut into a body."""

TRIM = 0.05
"""Fraction of a body's clearance by which its border may be simplified inwards to reduce its corners."""

GREED = 3.0
"""Weight of the remaining distance in A* if any path suffices."""

MOST_PARTS = 8
"""Maximum number of parts of a set; a set with more parts is replaced by its convex hull."""

HALVINGS = 16
"""Number of bisection steps for the width of a passage."""

Geometries = NDArray[np.object_]


class VisibilityGraph(Record, eq=False):
    """Visibility graph of bodies: corners at which shortest paths bend, and the bodies that block lines of sight.

    Args:
        world: convex area that contains the paths.
        points: corners, (corners, 2), metres.
        beside: neighbours of each corner along its body's border, (corners, 2) each, metres.
        tree: interiors of the bodies, which block lines of sight.
    """

    bodies: shapely.Geometry
    world: shapely.Geometry
    points: Array
    beside: tuple[Array, Array]
    tree: shapely.STRtree

    @staticmethod
    def of(bodies: shapely.Geometry, world: shapely.Geometry) -> VisibilityGraph:
        rings = [shapely.get_coordinates(ring)[:-1] for ring in shapely.get_rings(shapely.get_parts(bodies))]
        points, before, after = (
            np.vstack([np.empty((0, 2)), *(np.roll(ring, by, axis=0) for ring in rings)]) for by in (0, 1, -1)
        )
        within = shapely.covers(world, shapely.points(points))
        tree = shapely.STRtree(shapely.get_parts(shapely.buffer(bodies, -HAIR)))
        return VisibilityGraph(bodies, world, points[within], (before[within], after[within]), tree)

    def geodesic(self, start: shapely.Geometry, goal: shapely.Geometry, longest: float = math.inf) -> float:
        """Lower bound of the path length between two sets outside the bodies' interiors, metres; infinite without a
        path.

        Paths longer than ``longest`` are ignored. If ``longest`` is given, the length of any path below it may be
        returned.

        Each part of a set is replaced by its convex hull, from which the bodies are removed. The result may be too
        small but is never too large.
        """
        pairs = [(here, there) for here in _parts(start) for there in _parts(goal)]
        return min((self._between(*pair, longest) for pair in pairs), default=math.inf)

    def _between(self, start: shapely.Geometry, goal: shapely.Geometry, longest: float) -> float:
        if any(each.geom_type == "Point" and not self.seen(np.array([each]))[0] for each in (start, goal)):
            return float(shapely.distance(start, goal))  # inside a body, where no path begins
        ends = [each for each in (start, goal) if each.area > 0 and bool(shapely.intersects(each, self.bodies))]
        if not ends:
            return self._shortest(start, goal, longest)
        others = shapely.difference(self.bodies, shapely.union_all(ends))
        return VisibilityGraph.of(others, self.world)._shortest(start, goal, longest)

    def _shortest(self, start: shapely.Geometry, goal: shapely.Geometry, longest: float) -> float:
        """Length of the shortest path between free convex sets, metres; it leaves and enters each set at the point
        nearest to the path's corner.

        Source:
            A* on the visibility graph; Lozano-Pérez and Wesley, 1979.
        """
        if self.seen(np.array([shapely.shortest_line(start, goal)]))[0]:
            return float(shapely.distance(start, goal))
        if math.isfinite(longest) and (some := self._searched(start, goal, longest, GREED)) <= longest:
            return some
        return self._searched(start, goal, longest, 1.0)

    def _searched(self, start: shapely.Geometry, goal: shapely.Geometry, longest: float, greed: float) -> float:
        """Length of a path over corners found by A*, metres; the least length if ``greed``, the weight of the remaining
        distance, is 1."""
        corners = shapely.points(self.points)
        left, begun = shapely.distance(corners, goal), shapely.distance(start, corners)
        near = np.flatnonzero(begun + left <= longest)
        best, arrives = np.full(len(corners), math.inf), np.zeros(len(corners), dtype=np.bool_)
        seen = near[self.seen(shapely.shortest_line(start, corners[near]))]
        best[seen] = begun[seen]
        arrives[near] = self.seen(shapely.shortest_line(corners[near], goal))
        queue = [(best[each] + greed * left[each], each) for each in np.flatnonzero(np.isfinite(best)).tolist()]
        heapq.heapify(queue)
        done = np.zeros(len(corners), dtype=bool)
        while queue:
            _, here = heapq.heappop(queue)
            if done[here]:
                continue
            if arrives[here]:
                return float(best[here] + left[here])
            done[here] = True
            further = best[here] + shapely.distance(corners[here], corners)
            nearer = np.flatnonzero(~done & (further < best) & (further + left <= longest))
            nearer = nearer[self._bends(here, nearer)]
            for each in nearer[self.seen(shapely.shortest_line(corners[here], corners[nearer]))].tolist():
                best[each] = further[each]
                heapq.heappush(queue, (best[each] + greed * left[each], each))
        return math.inf

    def seen(self, lines: Geometries) -> Flags:
        """Return true for each line, (lines,), that meets no interior of a body."""
        free = np.ones(len(lines), dtype=bool)
        free[np.unique(self.tree.query(lines, predicate="intersects")[0])] = False
        return free

    def _bends(self, here: int, there: NDArray[np.intp]) -> Flags:
        """Return true for each corner to which a shortest path may run from corner ``here``: (corners,), boolean.

        The line between the corners must cut into the body at neither of them.
        """
        line = self.points[there] - self.points[here]
        sides = [
            [line[:, 0] * (each - at)[:, 1] - line[:, 1] * (each - at)[:, 0] for each in (before, after)]
            for at, before, after in (
                (self.points[[here]], *(side[[here]] for side in self.beside)),
                (self.points[there], *(side[there] for side in self.beside)),
            )
        ]
        here_free, there_free = (first * second >= -HAIR for first, second in sides)
        free: Flags = here_free & there_free
        return free


def around(standing: shapely.Geometry, room: float, world: shapely.Geometry) -> VisibilityGraph:
    """Visibility graph of bodies grown by at most ``room`` metres, simplified to few corners."""
    return VisibilityGraph.of(_grown(standing, room), world)


def widest_passage(
    standing: shapely.Geometry, room: float, world: shapely.Geometry, start: shapely.Geometry, goal: shapely.Geometry
) -> float:
    """Upper bound of the clearance along any path between two sets, metres; at most ``room``."""
    open_, shut = 0.0, room
    for _ in range(HALVINGS):
        middle = (open_ + shut) / 2
        free = shapely.difference(world, shapely.buffer(standing, middle))
        joined = any(
            bool(shapely.intersects(part, start)) and bool(shapely.intersects(part, goal))
            for part in shapely.get_parts(free)
        )
        open_, shut = (middle, shut) if joined else (open_, middle)
    return open_


def _grown(standing: shapely.Geometry, room: float) -> shapely.Geometry:
    """Inner bound of the positions within ``room`` metres of the obstacles."""
    if room <= 0:
        return standing
    trim = room * TRIM / 2
    wide = shapely.buffer(standing, room - trim, quad_segs=1)
    return shapely.buffer(shapely.simplify(wide, trim), -trim, join_style="mitre")


def _parts(area: shapely.Geometry) -> Iterator[shapely.Geometry]:
    parts = [part for part in shapely.get_parts(area) if not part.is_empty]
    for part in parts if len(parts) <= MOST_PARTS else [area]:
        hull = shapely.convex_hull(part)
        yield shapely.buffer(hull, HAIR) if hull.geom_type == "LineString" else hull
