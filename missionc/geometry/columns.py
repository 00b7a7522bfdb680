"""Columns: the vertical line from the floor to a point in the air, and how far obstacles are from it."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np

from missionc.base.trace import Array
from missionc.ir import Obstacle, Path, Shape, Vector
from missionc.ir.distances.signed_distance import signed_distance

FLOOR = 0.0
"""Metres: where vehicles stand before they take off."""
FINE = 0.002
"""Metres between the heights of a column that are looked at: what lies in between is nearer by half of it at most."""
MOST_HEIGHTS = 1 << 18
"""Heights of a column that are looked at, of 524 m of it: of a higher one they are further apart, which counts."""
STRIDE = 0.01
"""Metres that a moving obstacle goes between two moments that are looked at; likewise."""
MOST_MOMENTS = 2000
"""Between a begin and an end; of an obstacle that goes further its whole stride counts."""
BLOCKS = (64, 16, 4, 1)
"""Heights, and moments, of which one is looked at: fewer where they may be nearer than what was seen."""


def column_clearance(obstacle: Obstacle, point: Vector, begin: float, end: float) -> float:
    """Metres between an obstacle and the column below a point at any moment from a begin to an end, at least.

    Args:
        point: of the world: in a plane, where nothing has a height, the column is its point.
        begin, end: seconds since the mission's beginning; before it obstacles stand as they do then.
    """
    moments, stride = _moments(obstacle, begin, end)
    column, fine = _column(point)
    there = _offsets(obstacle, moments, len(point))
    between = (stride + fine) / 2
    return _nearest(obstacle.shape, column, there, 2 * between) - between - obstacle.grown(end)


def _column(point: Vector) -> tuple[Array, float]:
    """(heights, dim), metres: its points, and how far they are from each other at most."""
    if len(point) < 3:
        return np.array([point], dtype=np.float64), 0.0
    tall = abs(point[2] - FLOOR)
    fine = max(FINE, tall / MOST_HEIGHTS)
    heights = np.linspace(FLOOR, point[2], max(2, math.ceil(tall / fine) + 1))
    return np.column_stack([np.full(heights.shape, point[0]), np.full(heights.shape, point[1]), heights]), fine


def _offsets(obstacle: Obstacle, moments: Array, dimension: int) -> Array:
    """(moments, dim), metres: where it is then, from where it was written."""
    there = np.zeros((moments.size, dimension))
    if isinstance(obstacle.motion, Path):
        for axis, offsets in enumerate(np.array(obstacle.motion.offsets).T):
            there[:, axis] = np.interp(np.maximum(moments, 0.0), np.array(obstacle.motion.times), offsets)
    return there


def _nearest(shape: Shape, column: Array, there: Array, apart: float) -> float:
    """The least signed distance of a shape at those offsets to the points of a column.

    Args:
        apart: metres between points that follow each other, with those between offsets that do.
    """
    sizes = (len(there), len(column))
    begins = np.stack([each.ravel() for each in np.meshgrid(*(np.arange(0, size, BLOCKS[0]) for size in sizes))])
    nearest = math.inf
    for block, smaller in pairwise((*BLOCKS, 0)):
        row, part = (np.minimum(begin + block // 2, size - 1) for begin, size in zip(begins, sizes, strict=True))
        seen = np.asarray(signed_distance(np, shape, column[part] - there[row]))
        nearest = min(nearest, float(seen.min()))
        if smaller:
            begins = begins[:, seen - block // 2 * apart <= nearest]
            within = np.stack([each.ravel() for each in np.meshgrid(*[np.arange(0, block, smaller)] * 2)])
            begins = (begins[:, :, None] + within[:, None]).reshape(2, -1)
            begins = begins[:, (begins < np.array(sizes)[:, None]).all(axis=0)]
    return nearest


def _moments(obstacle: Obstacle, begin: float, end: float) -> tuple[Array, float]:
    """Seconds, and how far it goes from one of them to the next at most."""
    if not isinstance(obstacle.motion, Path) or end <= begin:
        return np.array([begin]), 0.0
    times, offsets = obstacle.motion.times, obstacle.motion.offsets
    legs = zip(pairwise(times), pairwise(offsets), strict=True)
    fastest = max((math.dist(there, here) / (after - before) for (before, after), (here, there) in legs), default=0.0)
    begin, end = max(begin, 0.0), min(max(end, 0.0), max(times[-1], begin, 0.0))
    if fastest == 0 or end <= begin:
        return np.array([begin]), 0.0
    count = min(MOST_MOMENTS, max(1, math.ceil((end - begin) * fastest / STRIDE)))
    return np.linspace(begin, end, count + 1), (end - begin) * fastest / count
