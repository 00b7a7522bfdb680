"""Margins of comparisons: inequalities over an agent's state and distances, in metres.

The value is divided by how fast it can change when the agent moves: the norm of
the coordinates' weights, plus the size of each distance's weight. Where only
speed is compared it is divided by the speed's weight and stays in m/s.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Callable
from typing import assert_never

from missionc.ir import Altitude, Beacon, Compare, Coordinate, DistanceBetween, DistanceTo, Feature, Region, Speed
from missionc.world.signed_distance import Array, Namespace, distance_between, length, signed_distance


def margin(predicate: Compare, dimension: int, value: Callable[[Feature], Array]) -> Array:
    """The comparison's value, scaled; ``value`` gives each feature's, in arrays that broadcast."""
    total = sum((weight * value(feature) for weight, feature in predicate.terms), start=predicate.constant)
    return total / scale(predicate, dimension)


def scale(predicate: Compare, dimension: int) -> float:
    """How much the comparison's value can change for each metre the agent moves (m/s, where only speed counts)."""
    coordinates: dict[int, float] = defaultdict(float)
    distances: dict[Feature, float] = defaultdict(float)
    speed = 0.0
    for weight, feature in predicate.terms:
        match feature:
            case Coordinate(axis):
                coordinates[axis] += weight
            case Altitude():
                if dimension == 3:
                    coordinates[2] += weight
            case Speed():
                speed += weight
            case DistanceTo() | DistanceBetween():
                distances[feature] += weight
            case _:
                assert_never(feature)
    in_metres = math.hypot(*coordinates.values()) + sum(map(abs, distances.values()))
    return in_metres or abs(speed) or 1.0


def own_feature(
    xp: Namespace, feature: Feature, altitude: Array | float, position: Array, velocity: Array | None
) -> Array:
    """A feature that the agent's own state decides: (..., dim) -> (...).

    Args:
        altitude: of the agents in a plane mission, (...) or one number, metres.
        position: (..., dim), metres.
        velocity: (..., dim), m/s; None where no speed is compared.

    Raises:
        ValueError: the feature needs another agent, or a velocity that is not given.
    """
    match feature:
        case Coordinate(axis):
            return position[..., axis]
        case Altitude():
            return position[..., 2] if position.shape[-1] == 3 else altitude + 0.0 * position[..., 0]
        case Speed() if velocity is not None:
            return length(xp, [velocity[..., axis] for axis in range(velocity.shape[-1])])
        case DistanceTo(Region() as region):
            return signed_distance(xp, region.shape, position)
        case DistanceTo(Beacon() as beacon):
            return distance_between(xp, position, beacon.position)
        case _:
            raise ValueError(f"one agent's position does not decide {feature}")
