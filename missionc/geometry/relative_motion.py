"""Exact closest approach of two moving agents within one step."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from missionc.base.trace import Array
from missionc.geometry.dynamics import Motions
from missionc.geometry.vectors import dot, norm

HALVINGS = 40
"""Number of bisection steps: they narrow a time to 1e-12 of a step, so that the least distance is exact to rounding."""

NEGLIGIBLE = 1e-12
"""Curvature of a motion within a step, metres, below which the motion counts as straight."""


def closest_approach(
    first: Motions,
    second: Motions,
    step: float,
    metric: Array | None = None,
) -> Array:
    """Least distance of two agent centres over one step, each moving with constant acceleration.

    Args:
        first, second: motions (...), metres and seconds; their shapes broadcast.
        step: duration of the step, seconds.
        metric: factor on each axis of the difference, (..., dim); None for 1.

    Returns:
        (...), metres in the metric: the minimum over the whole step, both ends included.
    """
    offset = np.asarray(second.position - first.position, dtype=float)
    velocity = np.asarray(second.velocity - first.velocity, dtype=float) * step
    bend = np.asarray(second.acceleration - first.acceleration, dtype=float) * (0.5 * step * step)
    if metric is not None:
        offset, velocity, bend = offset * metric, velocity * metric, bend * metric
    offset, velocity, bend = np.broadcast_arrays(offset, velocity, bend)
    nearest = _straight(offset, velocity)
    bends = np.abs(bend) > NEGLIGIBLE
    if bends.any():
        curved = bends.any(axis=-1)
        nearest[curved] = _curved(offset[curved], velocity[curved], bend[curved])
    return nearest


def _straight(offset: Array, velocity: Array) -> Array:
    """Least ``|offset + velocity u|`` for u in [0, 1]: (..., dim) twice, metres -> (...), metres."""
    square = dot(velocity, velocity)
    moment = np.clip(-dot(offset, velocity) / np.where(square > 0, square, 1.0), 0.0, 1.0)
    least: Array = norm(offset + velocity * moment[..., None])
    return least


def _curved(offset: Array, velocity: Array, bend: Array) -> Array:
    """Least ``|offset + velocity u + bend u²|`` for u in [0, 1]: (..., dim) each, metres -> (...), metres.

    The squared distance is a quartic. Its derivative is a cubic, which is monotone between the roots of its own
    derivative. Bisection therefore finds every root; a closed form would lose precision near double roots.
    """
    cubic = (
        2 * dot(bend, bend),
        3 * dot(velocity, bend),
        dot(velocity, velocity) + 2 * dot(offset, bend),
        dot(offset, velocity),
    )

    def slope(moment: Array) -> Array:
        value: Array = ((cubic[0] * moment + cubic[1]) * moment + cubic[2]) * moment + cubic[3]
        return value

    def distance(moment: Array) -> Array:
        length: Array = norm(offset + (velocity + bend * moment[..., None]) * moment[..., None])
        return length

    middle = -cubic[1] / (3 * cubic[0])
    spread = np.sqrt(np.maximum(middle**2 - cubic[2] / (3 * cubic[0]), 0.0))
    borders = [
        np.zeros_like(middle),
        np.clip(middle - spread, 0.0, 1.0),
        np.clip(middle + spread, 0.0, 1.0),
        np.ones_like(middle),
    ]
    least: Array = np.minimum(distance(borders[0]), distance(borders[3]))
    for low, high in pairwise(borders):
        rising = slope(high) > slope(low)
        for _ in range(HALVINGS):
            half = 0.5 * (low + high)
            above = (slope(half) > 0) == rising
            low, high = np.where(above, low, half), np.where(above, half, high)
        least = np.minimum(least, distance(0.5 * (low + high)))
    return least
