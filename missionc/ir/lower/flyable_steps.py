"""Flyable steps: how fast a plan of first order may be, and change from step to step, to be flown smoothly.

    in   an agent's dynamics and vehicle, the duration of a step
    out  limits on the velocities of steps, and on how they differ; None where nothing is to be kept

Such a plan changes its velocity at the steps at once; its flight passes the same places at the same times, and does it
within them. Measured on straight flights that come to speed evenly and brake so, steps of 0.1 to 2 s: a change of
velocity x from a step of duration d to the next is flown with an acceleration of up to ``BEND`` x / d where those
before and after it are alike, and of twice that where it stands alone, as at both ends, which are at rest; and the
flight is up to ``CRUISE`` times as fast as the plan, ``SETTING_OUT`` times where it sets out.
"""

from __future__ import annotations

import math
from itertools import accumulate

from missionc.base.late_dataclass import Record
from missionc.ir import Agent

ROUNDING = 1e-9
"""A way is not given a step more for this share of one."""

BEND, CRUISE, SETTING_OUT = 1.7, 1.06, 1.6
ALONE = 0.5
"""The share of a change that may be a change alone, where an agent turns at once, sets out or halts."""
JERKY = 1.7
"""The jerk of a change of changes x in steps of duration d, over x / d^2."""


BETWEEN_RESTS = 0.95
"""The share of what may be done in the first step and the last on a straight way that others, with corners, adjoin."""


class StepLimits(Record):
    """What the velocities of steps keep to, m/s.

    Args:
        speed: in a step.
        rest: in the first step and the last, which begin and end at rest.
        climb: up or down, in a step.
        change: from a step to the next.
        turn: by how much a change and the next differ.
    """

    speed: float
    rest: float
    climb: float
    change: float
    turn: float


def step_limits(agent: Agent, step: float) -> StepLimits | None:
    """The limits of an agent of first order in steps of so many seconds; None where its vehicle has none.

    Nor are there any of one that is planned faster than its vehicle: where no plan is slower, it is flown stretched.
    """
    vehicle = agent.vehicle
    if (
        agent.dynamics.top_speed > vehicle.speed
        or agent.dynamics.has_momentum
        or math.isinf(min(vehicle.speed, vehicle.acceleration, vehicle.vertical_speed))
    ):
        return None
    change = vehicle.acceleration * step / BEND
    return StepLimits(
        vehicle.speed / CRUISE,
        min(change / 2, vehicle.speed / SETTING_OUT),
        vehicle.vertical_speed / CRUISE,
        change,
        min(ALONE * change, vehicle.jerk * step**2 / JERKY),
    )


def flown_way(
    length: float, limits: StepLimits, step: float, speed: float, fewest: int, most: int
) -> list[float] | None:
    """How far along a straight way, metres, an agent is at each step, from 0 to ``length``; None in ``most`` steps.

    It comes to speed and slows down evenly, so that it may have been at rest before, or stop, or turn at either end.

    Args:
        step: seconds.
        speed: m/s, at most, besides the limits.
        fewest: steps that it takes at least.
    """
    end, top = BETWEEN_RESTS * limits.rest, min(limits.speed, speed)
    if min(end, top) <= 0:
        return None
    for count in range(max(fewest, 1, math.ceil(length / (top * step) - ROUNDING)), most + 1):
        speeds = [min(top, end + limits.turn * min(at, count - 1 - at)) for at in range(count)]
        could = sum(speeds) * step
        if could >= length * (1 - ROUNDING):
            *along, _ = accumulate((length * each * step / could for each in speeds), initial=0.0)
            return [*along, length]
    return None
