"""Flyable steps: limits on speeds and speed changes of first-order plans, so that smooth flights can follow them.

    in   an agent's dynamics and vehicle, the duration of a step
    out  limits on the velocities of steps and on their changes; None without limits

Such a plan changes its velocity instantly at the steps; its flight passes the same places at the same times with smooth
changes. The constants are measured on straight flights with even acceleration and braking, for steps of 0.1 to 2 s. A
change of velocity x between steps of duration d is flown with an acceleration of up to ``BEND`` x / d if the adjacent
changes are similar. The factor doubles for a single change, such as a start or stop at rest. The flight is up to
``CRUISE`` times as fast as the plan, and ``SETTING_OUT`` times at the start.
"""

from __future__ import annotations

import math
from itertools import accumulate

from missionc.base.late_dataclass import Record
from missionc.ir import Agent

ROUNDING = 1e-9
"""Share of a step that does not require another step on a path."""

BEND, CRUISE, SETTING_OUT = 1.7, 1.06, 1.6
ALONE = 0.5
"""Share of a limit for a single change: an agent turns, starts or stops at once."""
JERKY = 1.7
"""Jerk of a change of changes x in steps of duration d, over x / d²."""


BETWEEN_RESTS = 0.95
"""Share of the limits in the first and last step of a straight path next to paths with corners."""


class StepLimits(Record):
    """Limits on the velocities of steps, m/s.

    Args:
        speed: maximum in a step.
        rest: maximum in the first and the last step, which begin or end at rest.
        climb: maximum vertical speed in a step.
        change: maximum change between two steps.
        turn: maximum difference of consecutive changes.
    """

    speed: float
    rest: float
    climb: float
    change: float
    turn: float


def step_limits(agent: Agent, step: float) -> StepLimits | None:
    """Limits of a first-order agent in steps of ``step`` seconds; None if its vehicle has none.

    Also None for an agent that is planned faster than its vehicle; such a plan is time-scaled.
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
    """Distance along a straight path, metres, at each step, from 0 to ``length``.

    None if ``most`` steps do not suffice.

    The agent accelerates and brakes evenly, so that it can rest or turn at both ends.

    Args:
        step: seconds.
        speed: m/s, maximum besides the limits.
        fewest: minimum number of steps.
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
