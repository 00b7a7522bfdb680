"""Margins of headings: distances of agents or headings from the boundary of the allowed directions.

Consider a wedge of half angle ``a`` and a point at distance ``d`` from its tip, at the angle ``t`` from its axis. The
signed distance of the point to the border of the wedge is ``d sin(a - t)``. It is ``d`` if ``a - t`` is more than a
right angle, and ``-d`` if ``t - a`` is.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from missionc.base.trace import Array
from missionc.ir.places import Beacon


def turn(heading: Array, towards: Array | float) -> Array:
    """Absolute angle between two directions, rad, in [0, pi]: (...) twice -> (...)."""
    turns: Array = np.abs((heading - towards + math.pi) % (2 * math.pi) - math.pi)
    return turns


def of_direction(heading: Array, towards: float, within: float) -> Array:
    """Margin of a heading within the angle ``within`` of the direction ``towards``, rad: (...) -> (...).

    The margin changes by at most the change of the heading.
    """
    return within - turn(heading, towards)


def of_place(heading: Array, x: Array, y: Array, within: float) -> Array:
    """Margin of an agent facing a point at the relative position (x, y) within the angle ``within``, rad: (...), metres
    -> (...), metres.

    The margin changes by at most the distance that the agent moves.
    """
    spare = np.clip(within - turn(heading, np.arctan2(y, x)), -math.pi / 2, math.pi / 2)
    return np.asarray(np.hypot(x, y) * np.sin(spare))


def of_motion(xp: Any, vx: Any, vy: Any, towards: tuple[Any, Any], within: float) -> Any:
    """Least change of a velocity to leave the cone of half angle ``within``, rad, around a unit vector: (...), m/s ->
    (...), m/s.

    The function works on any array library, and is differentiable if the agent moves.
    """
    ahead, aside = vx * towards[0] + vy * towards[1], xp.abs(vx * towards[1] - vy * towards[0])
    spare = ahead * math.sin(within) - aside * math.cos(within)
    near = ahead * math.cos(within) + aside * math.sin(within) >= 0
    speed = (ahead**2 + aside**2 + 1e-24) ** 0.5
    return xp.where(near, spare, xp.where(spare >= 0, speed, -speed))


def of_velocity(xp: Any, position: Any, velocity: Any, towards: float | Beacon, within: float) -> Any:
    """Margin of the motion's direction within an angle of a direction: (..., dim) twice, metres, m/s -> (...), m/s.

    It has the sign of the predicate's margin for a moving agent, and is 0 at rest.
    """
    apart = 1e-9  # metres: the direction to a nearer place is arbitrary
    along: tuple[Any, Any]
    if isinstance(towards, Beacon):
        x, y = (towards.position[axis] - position[..., axis] for axis in (0, 1))
        far = xp.sqrt(x * x + y * y + apart**2)
        along = x / far, y / far
    else:
        along = math.cos(towards), math.sin(towards)
    return of_motion(xp, velocity[..., 0], velocity[..., 1], along, within)
