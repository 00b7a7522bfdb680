"""Distance from obstacles to a column: the vertical line from the floor to a point, along which a vehicle takes off or
lands."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np

from missionc.base.trace import Array
from missionc.ir import Obstacle, Path, Shape, Vector
from missionc.ir.distances.signed_distance import signed_distance

FLOOR = 0.0
"""Height of the floor where vehicles take off, metres."""
FINE = 0.002
"""Spacing of the tested heights of a column, metres; between them an obstacle may be nearer by half of the spacing."""
MOST_HEIGHTS = 1 << 18
"""Maximum number of tested heights, enough for a column of 524 m; for higher columns the spacing is larger."""
STRIDE = 0.01
"""Distance, metres, that a moving obstacle travels between two tested times, when it may be nearer by half of it."""
MOST_MOMENTS = 2000
"""Maximum number of tested times; for longer movements the distance between tested times is larger."""
BLOCKS = (64, 16, 4, 1)
"""Block sizes of heights and times that one test covers; a block is divided if it may contain a smaller distance."""


def column_clearance(obstacle: Obstacle, point: Vector, begin: float, end: float) -> float:
    """Lower bound of the distance between an obstacle and the column below a point over a time interval, metres.

    Args:
        point: upper end of the column, metres; in a plane the column is this point.
        begin, end: seconds of mission time; before time 0, obstacles are at their initial positions.
    """
    moments, stride = _moments(obstacle, begin, end)
    column, fine = _column(point)
    there = _offsets(obstacle, moments, len(point))
    between = (stride + fine) / 2
    return _nearest(obstacle.shape, column, there, 2 * between) - between - obstacle.grown(end)


def _column(point: Vector) -> tuple[Array, float]:
    """Points of a column, (heights, dim), metres, and the greatest distance of consecutive points, metres."""
    if len(point) < 3:
        return np.array([point], dtype=np.float64), 0.0
    tall = abs(point[2] - FLOOR)
    fine = max(FINE, tall / MOST_HEIGHTS)
    heights = np.linspace(FLOOR, point[2], max(2, math.ceil(tall / fine) + 1))
    return np.column_stack([np.full(heights.shape, point[0]), np.full(heights.shape, point[1]), heights]), fine


def _offsets(obstacle: Obstacle, moments: Array, dimension: int) -> Array:
    """Offsets of an obstacle from its initial position at times (moments,), seconds: (moments, dim), metres."""
    there = np.zeros((moments.size, dimension))
    if isinstance(obstacle.motion, Path):
        for axis, offsets in enumerate(np.array(obstacle.motion.offsets).T):
            there[:, axis] = np.interp(np.maximum(moments, 0.0), np.array(obstacle.motion.times), offsets)
    return there


def _nearest(shape: Shape, column: Array, there: Array, apart: float) -> float:
    """Least signed distance between column points, (heights, dim), and a shape moved by offsets, (moments, dim);
    metres.

    Args:
        apart: spacing of consecutive points plus that of consecutive offsets, metres.
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
    """Tested times, (moments,), seconds, and the greatest distance that the obstacle travels between two of them,
    metres."""
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
