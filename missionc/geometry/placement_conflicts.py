"""Placement conflicts of many given places at once: with obstacles, and between pairs."""

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
"""Number of places whose neighbours are searched at a time."""


def too_near(
    obstacle: Obstacle, time: float, places: Sequence[Vector], margins: Sequence[float]
) -> list[tuple[int, float]]:
    """Places closer to the obstacle at that time than their margin in metres, with their distance."""
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
    """Pairs of places no further apart than their agents' required separation, with their distance.

    Stops after about ``most`` pairs.
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
