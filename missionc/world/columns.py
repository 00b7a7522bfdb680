"""Columns: the vertical line from the floor to a point in the air, and how far obstacles are from it."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np

from missionc.ir import Obstacle, Path, Vector
from missionc.world.displacement import displaced, moved
from missionc.world.signed_distance import signed_distance

FLOOR = 0.0
"""Metres: where vehicles stand before they take off."""
FINE = 0.002
"""Metres between the heights of a column that are looked at: what lies in between is nearer by half of it at most."""
STRIDE = 0.01
"""Metres that a moving obstacle goes between two moments that are looked at; likewise."""
MOST_MOMENTS = 2000
"""Between a begin and an end; of an obstacle that goes further its whole stride counts."""


def column_clearance(obstacle: Obstacle, point: Vector, begin: float, end: float) -> float:
    """Metres between an obstacle and the column below a point at any moment from a begin to an end, at least.

    Args:
        point: of the world: in a plane, where nothing has a height, the column is its point.
        begin, end: seconds since the mission's beginning; before it obstacles stand as they do then.
    """
    dimension = len(point)
    moments, stride = _moments(obstacle, begin, end)
    nearest = min(_clearance(obstacle, time, point, dimension) for time in moments)
    return nearest - stride / 2 - obstacle.grown(end)


def _clearance(obstacle: Obstacle, time: float, point: Vector, dimension: int) -> float:
    """At one moment, of its shape alone."""
    shape = moved(obstacle.shape, displaced(obstacle, max(time, 0.0), dimension))
    if dimension < 3:
        return float(signed_distance(np, shape, np.array([point]))[0])
    heights = np.linspace(FLOOR, point[2], max(2, math.ceil(abs(point[2] - FLOOR) / FINE) + 1))
    column = np.column_stack([np.full(heights.shape, point[0]), np.full(heights.shape, point[1]), heights])
    return float(signed_distance(np, shape, column).min()) - FINE / 2


def _moments(obstacle: Obstacle, begin: float, end: float) -> tuple[list[float], float]:
    """Seconds, and how far it goes from one of them to the next at most."""
    if not isinstance(obstacle.motion, Path) or end <= begin:
        return [begin], 0.0
    times, offsets = obstacle.motion.times, obstacle.motion.offsets
    legs = zip(pairwise(times), pairwise(offsets), strict=True)
    fastest = max((math.dist(there, here) / (after - before) for (before, after), (here, there) in legs), default=0.0)
    begin, end = max(begin, 0.0), min(max(end, 0.0), max(times[-1], begin, 0.0))
    if fastest == 0 or end <= begin:
        return [begin], 0.0
    count = min(MOST_MOMENTS, max(1, math.ceil((end - begin) * fastest / STRIDE)))
    return np.linspace(begin, end, count + 1).tolist(), (end - begin) * fastest / count
