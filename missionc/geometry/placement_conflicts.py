"""Conflicts of many given positions at once: positions too close to obstacles, and pairs too close to each other."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely

from missionc.geometry.clearance import clear_of, solids
from missionc.geometry.displacement import displaced
from missionc.geometry.required_separation import SpacingTable
from missionc.ir import Obstacle, Vector
from missionc.ir.distances.signed_distance import signed_distance

CHUNK = 32
"""Number of positions whose neighbours are searched at a time."""


def too_near(
    obstacle: Obstacle, time: float, places: Sequence[Vector], margins: Sequence[float]
) -> list[tuple[int, float]]:
    """Positions closer to the obstacle at ``time`` seconds than their margin in metres: index and distance of each."""
    points = np.asarray(places, dtype=np.float64)
    if len(points) == 0:
        return []
    points = points - np.array(displaced(obstacle, time, points.shape[1]))
    grown = obstacle.grown(time)
    clear = clear_of(solids(obstacle.shape), points, points, np.asarray(margins, dtype=float) + grown)
    near = np.flatnonzero(~clear)
    distances = signed_distance(np, obstacle.shape, points[near]) - grown
    return [(int(place), float(distance)) for place, distance in zip(near, distances, strict=True)]


def too_close(
    places: Sequence[Vector], agents: Sequence[int], spacing: SpacingTable, most: int
) -> list[tuple[int, int, float]]:
    """Pairs of positions closer than or as close as their agents' required separation: both indices and the distance.

    The search stops after about ``most`` pairs.
    """
    points, who = np.asarray(places, dtype=np.float64), np.asarray(agents, dtype=np.int64)
    if len(points) < 2:
        return []
    flat = shapely.points(points[:, :2])
    tree = shapely.STRtree(flat)
    pairs: list[tuple[int, int, float]] = []
    for begin in range(0, len(points), CHUNK):
        first, second = tree.query(flat[begin : begin + CHUNK], predicate="dwithin", distance=spacing.widest)
        first = first + begin
        first, second = first[first < second], second[first < second]
        between, metric = points[first] - points[second], spacing.metric(who[first], who[second])
        apart = np.linalg.norm(between, axis=1)
        seen = apart if metric is None else np.linalg.norm(between * metric, axis=1)
        close = np.flatnonzero(seen <= spacing.between(who[first], who[second]))
        pairs.extend((int(first[pair]), int(second[pair]), float(apart[pair])) for pair in close[: most - len(pairs)])
        if len(pairs) >= most:
            break
    return sorted(pairs)
