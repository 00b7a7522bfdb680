"""Natural scales of margins: the length (for speeds, m/s) by which each margin is divided.

A margin divided by its natural scale is dimensionless, so that margins of different kinds are comparable. The scale is
the inradius of a region, the range of a graph, the tolerance of a formation, the bound of a distance, and the top speed
for speeds.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

from missionc.geometry.sampling import points_in
from missionc.ir import Compare, Mission, Predicate
from missionc.ir.places import Ball, Box, Disc, Shape, World
from missionc.ir.predicates.features import DistanceBetween, DistanceTo


def natural_scale(predicate: Predicate, mission: Mission) -> float:
    """Natural scale of a predicate's margin, in the unit of the margin; ``inf`` for a predicate without a natural
    scale."""
    if predicate.region is not None:
        return inradius(predicate.region.shape, mission.world)
    if predicate.formation is not None:
        return float(predicate.formation.tolerance)
    if predicate.graph is not None:
        return float(predicate.graph.radius)
    if predicate.reads_past:
        return math.inf
    if predicate.is_of_speed:
        return max(float(agent.dynamics.top_speed) for agent in mission.agents)
    if isinstance(predicate, Compare) and all(
        isinstance(each, DistanceTo | DistanceBetween) for _, each in predicate.terms
    ):
        return abs(predicate.constant) / sum(abs(weight) for weight, _ in predicate.terms) or body(mission)
    return body(mission)


def body(mission: Mission) -> float:
    """Natural scale of separation and clearance margins, metres: the largest body radius, or half of the separation if
    larger."""
    return max(max(float(agent.radius) for agent in mission.agents), float(mission.separation) / 2)


@lru_cache(maxsize=256)
def inradius(shape: Shape, world: World) -> float:
    """Radius of the largest ball in the part of a shape inside the world, metres; estimated for compound shapes."""
    match shape:
        case Box(low, high):
            sides = (min(b, d) - max(a, c) for a, b, c, d in zip(low, high, world.low, world.high, strict=True))
            return max(0.0, min(sides) / 2)
        case Disc(_, radius, None) | Ball(_, radius):
            return float(radius)
        case _:
            samples = 256
            _, depth = points_in(shape, world, samples, np.random.default_rng(0))
            return float(depth.max(initial=0.0))
