"""Margins of headings: how far an agent is from facing too far aside.

The signed distance of a point to the border of a wedge of half angle ``a`` around an axis is ``d sin(a - t)``, where
the point is ``d`` from its tip and ``t`` off the axis; ``d`` itself where ``a - t`` is more than a right angle, and
``-d`` where ``t - a`` is.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from missionc.base.trace import Array


def turn(heading: Array, towards: Array | float) -> Array:
    """How far one direction is from another, rad, in [0, pi]: (...) twice -> (...)."""
    turns: Array = np.abs((heading - towards + math.pi) % (2 * math.pi) - math.pi)
    return turns


def of_direction(heading: Array, towards: float, within: float) -> Array:
    """The angle to spare, rad: (...) -> (...). It changes as much as the heading at most."""
    return within - turn(heading, towards)


def of_place(heading: Array, x: Array, y: Array, within: float) -> Array:
    """The metres to spare of who faces a place that is at (x, y) from it: (...) -> (...).

    They change as much as the agent moves, at most.
    """
    spare = np.clip(within - turn(heading, np.arctan2(y, x)), -math.pi / 2, math.pi / 2)
    return np.asarray(np.hypot(x, y) * np.sin(spare))


def of_motion(xp: Any, vx: Any, vy: Any, towards: tuple[Any, Any], within: float) -> Any:
    """By how much another velocity would lead too far aside of the direction of a unit vector, m/s: (...) -> (...).

    On any array library, with derivatives where the agent moves.
    """
    ahead, aside = vx * towards[0] + vy * towards[1], xp.abs(vx * towards[1] - vy * towards[0])
    spare = ahead * math.sin(within) - aside * math.cos(within)
    near = ahead * math.cos(within) + aside * math.sin(within) >= 0
    speed = (ahead**2 + aside**2 + 1e-24) ** 0.5
    return xp.where(near, spare, xp.where(spare >= 0, speed, -speed))
