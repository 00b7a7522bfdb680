"""Clearance of bodies from static and moving obstacles.

The body of an agent is the disc (in a volume the ball) of its radius around the agent's centre. It is clear if its
distance to every obstacle is at least the mission's clearance. In the plane this is exact for every plain shape; a disc
in an intersection or a difference counts as the polygon around it. In a volume, a prism is grown in the plane and in
height, which is slightly more than the true distance at its rims.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import assert_never

import numpy as np
import shapely
from numpy.typing import NDArray

from missionc import ir
from missionc.base.late_dataclass import Record
from missionc.base.trace import Array, Flags, Indices
from missionc.geometry.displacement import displaced
from missionc.geometry.dynamics import Motions
from missionc.ir.distances.signed_distance import signed_distance

ROUNDING = 5e-10
"""Distance, metres, by which a body may be nearer to an obstacle than required and still count as only touching it."""

NOTHING = 1e-12
"""Least clearance, metres, so that a body of radius zero may not be inside an obstacle."""

BULGE = 0.01
"""Largest deviation, metres, of a curved motion from the chords with which it is tested; the margin grows by as much. A
growing obstacle is tested in parts of a step with at most this growth, at its size at the end of each part."""

PARTS = 64
"""Maximum number of parts into which a step is divided because of an obstacle's growth."""

BLOCK = 1 << 17
"""Number of segments whose distances are computed at once."""

FEW = 16
"""Maximum number of solids that are compared with all segments; for more, a tree finds the near ones."""

CORNERS = 64
"""Number of corners of the polygon that approximates a disc cut by another shape."""


class Column(Record, eq=False):
    """Upright solid: the points within ``radius`` metres of a plane geometry, from height ``low`` to ``high``."""

    base: shapely.Geometry
    radius: float
    low: float
    high: float

    def bounds(self, dimension: int) -> tuple[Array, Array]:
        """Lowest and highest corner of the solid's bounding box, (dim,) each, metres."""
        west, south, east, north = shapely.bounds(self.base)
        low = (west - self.radius, south - self.radius, self.low)
        high = (east + self.radius, north + self.radius, self.high)
        return np.array(low[:dimension]), np.array(high[:dimension])


Solid = Column | ir.Ball
"""Part of an obstacle whose distance to segments is computed directly."""


def solids(shape: ir.Shape) -> tuple[Solid, ...]:
    """Solids whose union contains a shape, and equals it unless a disc or ball is cut by another shape."""
    everywhere = ir.Prism(-math.inf, math.inf)
    match shape:
        case ir.Box(low, high):
            heights = ir.Prism(low[2], high[2]) if len(low) == 3 else everywhere
            return (Column(shapely.box(low[0], low[1], high[0], high[1]), 0.0, heights.low, heights.high),)
        case ir.Disc(centre, radius, band):
            heights = band or everywhere
            return (Column(shapely.Point(centre[0], centre[1]), radius, heights.low, heights.high),)
        case ir.Polygon(corners, band):
            heights = band or everywhere
            return (Column(shapely.Polygon(corners), 0.0, heights.low, heights.high),)
        case ir.Ball():
            return (shape,)
        case ir.Union(left, right):
            return solids(left) + solids(right)
        case ir.Intersection(left, right):
            return tuple(both for one in solids(left) for other in solids(right) for both in _common(one, other))
        case ir.Difference(left, right):
            rest = solids(left)
            for other in solids(right):
                rest = tuple(piece for one in rest for piece in _without(one, other))
            return rest
        case _:
            assert_never(shape)


def clear_of(obstacles: tuple[Solid, ...], start: Array, end: Array, margin: Array) -> Flags:
    """Return true for each straight segment that keeps its required distance from static solids.

    Args:
        start: start of each segment, (segments, dim), metres; ``end`` likewise. Equal ends are a point.
        margin: required distance, (segments,), metres.

    Returns:
        (segments,), boolean.
    """
    clear = np.ones(len(start), dtype=bool)
    if not len(start) or not obstacles:
        return clear
    reach = margin[:, None]
    for number, near in _within_reach(obstacles, np.minimum(start, end) - reach, np.maximum(start, end) + reach):
        for block in range(0, len(near), BLOCK):
            here = near[block : block + BLOCK]
            here = here[clear[here]]
            clear[here] = ~_touches(obstacles[number], start[here], end[here], margin[here])
    return clear


def _within_reach(obstacles: tuple[Solid, ...], low: Array, high: Array) -> Iterator[tuple[int, Indices]]:
    """For each obstacle, yield its index and the indices of the boxes, (some,), that may touch it.

    Args:
        low: lowest corners of the boxes, (boxes, dim), metres; ``high``: highest corners.
    """
    bounds = [_bounds(solid, low.shape[1]) for solid in obstacles]
    if len(obstacles) <= FEW:
        for number, (lowest, highest) in enumerate(bounds):
            yield number, np.flatnonzero(((low <= highest) & (high >= lowest)).all(axis=1))
        return
    tree = shapely.STRtree(_rectangles(np.array([each for each, _ in bounds]), np.array([each for _, each in bounds])))
    near, solid = tree.query(_rectangles(low, high))
    order = np.lexsort((near, solid))
    first = np.searchsorted(solid[order], np.arange(len(obstacles) + 1))
    for number in np.flatnonzero(np.diff(first)).tolist():
        yield number, near[order[first[number] : first[number + 1]]]


def _rectangles(low: Array, high: Array) -> NDArray[np.object_]:
    """Rectangles (shapely) of boxes in the plane: lowest and highest corners, (boxes, dim) each, metres -> (boxes,)."""
    rectangles: NDArray[np.object_] = shapely.box(low[:, 0], low[:, 1], high[:, 0], high[:, 1])
    return rectangles


def standing_solids(mission: ir.Mission) -> tuple[Solid, ...]:
    """Solids of all static obstacles; growing obstacles have their initial size."""
    return tuple(
        solid
        for obstacle in mission.obstacles
        if isinstance(obstacle.motion, ir.Still)
        for solid in solids(obstacle.shape)
    )


def clear_motions(obstacles: tuple[Solid, ...], motions: Motions, step: float, margin: float) -> Flags:
    """Return true for each motion that keeps ``margin`` metres from static solids for the whole step: (motions,),
    boolean."""
    clear = np.ones(len(motions.position), dtype=bool)
    for begin, until in pairwise(_chords(motions, 0.0, step)):
        clear &= clear_of(obstacles, motions.at(begin), motions.at(until), motions.bulge(until - begin) + margin)
    return clear


def clear_of_movers(mission: ir.Mission, motions: Motions, margin: float) -> Flags:
    """Return true if a motion that starts at a step keeps ``margin`` metres from moving or growing obstacles.

    Returns:
        (steps, motions), boolean, by the step at which the motion starts.
    """
    clear = np.ones((mission.steps, len(motions.position)), dtype=bool)
    for obstacle in mission.obstacles:
        if obstacle.constant:
            continue
        parts = solids(obstacle.shape)
        for step in range(mission.steps):
            now = step * mission.step
            for begin, until in _straight(obstacle, motions, now, now + mission.step):
                start = motions.at(begin - now) - displaced(obstacle, begin, mission.dimension)
                end = motions.at(until - now) - displaced(obstacle, until, mission.dimension)
                need = motions.bulge(until - begin) + margin + obstacle.grown(until)
                clear[step] &= clear_of(parts, start, end, need)
    return clear


def distance_to_obstacle(obstacle: ir.Obstacle, points: Array, time: float) -> Array:
    """Signed distances of points to an obstacle at its position and size at ``time`` seconds: (..., dim), metres ->
    (...), metres."""
    there = points - displaced(obstacle, time, points.shape[-1])
    return np.asarray(signed_distance(np, obstacle.shape, there)) - obstacle.grown(time)


def clear_places(mission: ir.Mission, position: Array, margin: float, steps: Sequence[int]) -> Flags:
    """Return true for each position that keeps ``margin`` metres from moving or growing obstacles at a step.

    Args:
        position: (places, dim), metres.
        steps: steps at which the positions are tested.

    Returns:
        (steps, places), boolean.
    """
    clear = np.ones((len(steps), len(position)), dtype=bool)
    for obstacle in mission.obstacles:
        if obstacle.constant:
            continue
        parts = solids(obstacle.shape)
        for row, step in enumerate(steps):
            time = step * mission.step
            place = position - displaced(obstacle, time, mission.dimension)
            clear[row] &= clear_of(parts, place, place, np.full(len(position), margin + obstacle.grown(time)))
    return clear


def _straight(obstacle: ir.Obstacle, motions: Motions, begin: float, until: float) -> Iterator[tuple[float, float]]:
    """Yield time intervals, seconds, in which the obstacle moves straight, the motions nearly, and the obstacle grows
    little."""
    path = obstacle.motion.times if isinstance(obstacle.motion, ir.Path) else ()
    corners = [begin, *(time for time in path if begin < time < until), until]
    for first, last in pairwise(corners):
        yield from pairwise(_chords(motions, first, last, obstacle.growth))


def _chords(motions: Motions, begin: float, until: float, growth: float = 0.0) -> list[float]:
    """Times, seconds, between which no motion deviates from its chord by more than ``BULGE``.

    The growth between two times is limited by ``BULGE`` too, but with at most ``PARTS`` parts.
    """
    bulge = float(motions.bulge(until - begin).max(initial=0.0))
    pieces = max(1, math.ceil(math.sqrt(bulge / BULGE)), min(math.ceil(growth * (until - begin) / BULGE), PARTS))
    return [*(begin + (until - begin) * piece / pieces for piece in range(pieces)), until]


def _bounds(solid: Solid, dimension: int) -> tuple[Array, Array]:
    if isinstance(solid, Column):
        return solid.bounds(dimension)
    return np.array(solid.centre) - solid.radius, np.array(solid.centre) + solid.radius


def _touches(solid: Solid, start: Array, end: Array, margin: Array) -> Flags:
    """Return true for each segment that comes closer than its margin to a solid: (segments, dim) twice, metres ->
    (segments,)."""
    if isinstance(solid, ir.Ball):
        along = end - start
        square = np.sum(along * along, axis=1)
        part = np.sum((solid.centre - start) * along, axis=1) / np.where(square > 0, square, 1.0)
        nearest = start + along * np.clip(part, 0.0, 1.0)[:, None]
        touches: Flags = np.linalg.norm(nearest - solid.centre, axis=1) < np.maximum(margin, NOTHING) + solid.radius
        return touches
    if start.shape[1] == 3:
        level, start, end = _within_heights(start, end, solid.low - margin, solid.high + margin)
    else:
        level = np.ones(len(start), dtype=bool)
    lines = shapely.linestrings(np.stack([start[:, :2], end[:, :2]], axis=1))
    close: Flags = shapely.distance(lines, solid.base) < np.maximum(margin, NOTHING) + solid.radius
    return level & close


def _within_heights(start: Array, end: Array, low: Array, high: Array) -> tuple[Flags, Array, Array]:
    """Parts of segments strictly between two heights, and for each segment whether it has such a part.

    Args:
        start, end: (segments, dim), metres.
        low, high: (segments,), metres.
    """
    climb = end[:, 2] - start[:, 2]
    slope = np.where(climb == 0, 1.0, climb)
    first, second = (low - start[:, 2]) / slope, (high - start[:, 2]) / slope
    enters = np.where(climb == 0, 0.0, np.clip(np.minimum(first, second), 0.0, 1.0))
    leaves = np.where(climb == 0, 1.0, np.clip(np.maximum(first, second), 0.0, 1.0))
    level = (np.minimum(start[:, 2], end[:, 2]) < high) & (np.maximum(start[:, 2], end[:, 2]) > low)
    along = end - start
    return level, start + along * enters[:, None], start + along * leaves[:, None]


def _around(column: Column) -> shapely.Geometry:
    """Polygon that contains the base of a column."""
    return column.base if column.radius == 0 else _regular(column, column.radius / math.cos(math.pi / CORNERS))


def _within(column: Column) -> shapely.Geometry:
    """Polygon inside the base of a column."""
    return column.base if column.radius == 0 else _regular(column, column.radius)


def _regular(column: Column, radius: float) -> shapely.Geometry:
    angles = np.arange(CORNERS) * (2 * math.pi / CORNERS)
    centre = shapely.get_coordinates(column.base)[0]
    return shapely.Polygon(centre + radius * np.stack([np.cos(angles), np.sin(angles)], axis=1))


def _common(one: Solid, other: Solid) -> tuple[Solid, ...]:
    if isinstance(one, ir.Ball) or isinstance(other, ir.Ball):
        return (one,) if isinstance(one, ir.Ball) else (other,)
    base = shapely.intersection(_around(one), _around(other))
    return _column(base, max(one.low, other.low), min(one.high, other.high))


def _without(one: Solid, other: Solid) -> tuple[Solid, ...]:
    if isinstance(one, ir.Ball) or isinstance(other, ir.Ball):
        return (one,)
    apart = min(one.high, other.high) <= max(one.low, other.low)
    if apart or shapely.disjoint(_around(one), _around(other)):
        return (one,)
    beside = _column(shapely.difference(_around(one), _within(other)), one.low, one.high)
    below = _column(_around(one), one.low, min(one.high, other.low))
    above = _column(_around(one), max(one.low, other.high), one.high)
    return beside + below + above


def _column(base: shapely.Geometry, low: float, high: float) -> tuple[Solid, ...]:
    return () if shapely.area(base) == 0 or low >= high else (Column(base, 0.0, low, high),)
