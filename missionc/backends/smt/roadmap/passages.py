"""Sampling of nodes in narrow passages, which uniform sampling may miss, by the bridge test.

    in   Ground, spacing of a uniform sampling
    out  points in free space with obstacles on both sides

A bridge is a short segment whose ends are blocked and whose midpoint is free. Its first end is on the border of an
obstacle, grown by the body, so that thin walls get as many bridges as thick walls.

Source:
    Hsu, Jiang, Reif, Sun, "The bridge test for sampling narrow passages with probabilistic roadmap planners" (2003).
"""

from __future__ import annotations

import math

import numpy as np
import shapely

from missionc.backends.smt.roadmap.sample_nodes import Ground
from missionc.backends.smt.settings import smt_settings
from missionc.base.trace import Array
from missionc.geometry.clearance import Solid
from missionc.geometry.sampling import far_apart
from missionc.ir import Ball

EACH = 8
"""Number of bridges from one point of a border."""

ASIDE = 1e-6
"""Distance inside the obstacle at which a bridge begins, metres."""


def passage_nodes(ground: Ground, spacing: float, most: int, taken: Array, generator: np.random.Generator) -> Array:
    """Points in passages narrower than ``spacing``: (at most ``most``, dim), metres, about one per body width.

    Args:
        spacing: metres.
        taken: existing nodes, (points, dim), metres.
    """
    borders = [_border(ground, solid, places, generator) for solid, places in _shares(ground)]
    none = np.zeros((0, ground.mission.dimension))
    start = np.repeat(np.concatenate([none, *borders]), EACH, axis=0)
    way = generator.standard_normal(start.shape)
    way /= np.maximum(np.linalg.norm(way, axis=1, keepdims=True), ASIDE)
    end = start + way * generator.uniform(0.0, spacing, size=(len(start), 1))
    middle = (start + end) / 2
    passage = ground.is_free(middle) & ground.keeps_within(middle)
    passage[passage] = ~(ground.is_free(end[passage]) & ground.keeps_within(end[passage]))
    passage[passage] = ~(ground.is_free(start[passage]) & ground.keeps_within(start[passage]))
    points = middle[passage]
    if len(points) == 0:
        return none
    order = far_apart(points, most, taken)
    chosen, width = points[order], 2 * max(ground.margin, ASIDE)
    others = np.concatenate([taken, chosen])
    apart = [
        float(np.min(np.linalg.norm(others[: len(taken) + before] - point, axis=1), initial=math.inf))
        for before, point in enumerate(chosen)
    ]
    wide: Array = chosen[np.array(apart) >= width]
    return wide


def _shares(ground: Ground) -> list[tuple[Solid, int]]:
    """Obstacles with their numbers of border points, which are proportional to the length of the border."""
    around = np.array(
        [
            2 * math.pi * each.radius if isinstance(each, Ball) else _perimeter(each.base) + 2 * math.pi * each.radius
            for each in ground.obstacles
        ]
    )
    places = np.maximum(
        np.ceil(around / max(float(around.sum()), ASIDE) * (smt_settings(ground.mission).roadmap.bridges / EACH)), 1
    )
    return list(zip(ground.obstacles, places.astype(int).tolist(), strict=True))


def _perimeter(base: shapely.Geometry) -> float:
    return float(shapely.length(base))


def _border(ground: Ground, solid: Solid, places: int, generator: np.random.Generator) -> Array:
    """Points just inside an obstacle's border, grown by the body: (places, dim), metres."""
    world, room = ground.mission.world, max(ground.margin - ASIDE, 0.0)
    if isinstance(solid, Ball):
        direction = generator.standard_normal((places, 3))
        direction /= np.linalg.norm(direction, axis=1, keepdims=True)
        around: Array = np.array(solid.centre) + direction * (solid.radius + room)
        return around
    border = shapely.boundary(shapely.buffer(solid.base, solid.radius + room))
    along = (np.arange(places) + generator.random(places)) * (shapely.length(border) / places)
    level: Array = shapely.get_coordinates(shapely.line_interpolate_point(border, along))
    if world.dimension == 2:
        return level
    low, high = max(solid.low - room, world.low[2]), min(solid.high + room, world.high[2])
    return np.column_stack([level, generator.uniform(low, max(low, high), size=places)])
