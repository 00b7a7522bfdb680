"""Flyable steps: limits on speeds and speed changes of first-order plans, so that smooth flights can follow them.

    in   an agent's dynamics and vehicle, the duration of a step
    out  limits on the velocities of steps and on their changes; None without limits

A first-order plan changes its velocity instantly at the steps; its flight passes the same positions at the same times
with smooth changes. The constants are measured on straight flights with uniform acceleration and braking, for steps of
0.1 to 2 s. A change of velocity x between steps of duration d is flown with an acceleration of up to ``BEND`` x / d if
the adjacent changes are similar. The factor doubles for a single change, such as a start or stop at rest. The flight is
up to ``CRUISE`` times as fast as the plan, and ``SETTING_OUT`` times at the start.
"""

from __future__ import annotations

import math
from itertools import accumulate

from missionc.base.late_dataclass import Record
from missionc.ir import Agent

ROUNDING = 1e-9
"""Fraction of a step by which a path may exceed a whole number of steps without another step."""

BEND, CRUISE, SETTING_OUT = 1.7, 1.06, 1.6
ALONE = 0.5
"""Factor on a limit for a single velocity change without similar neighbours: a turn, start or stop."""
JERKY = 1.7
"""Jerk of the flight if velocity changes differ by x in steps of duration d, divided by x / d²."""


BETWEEN_RESTS = 0.95
"""Factor on the limits in the first and last step of a straight path that begins or ends at a corner."""


class StepLimits(Record):
    """Limits on the velocities of a first-order plan's steps, m/s.

    Args:
        speed: maximum speed of a step.
        rest: maximum speed of the first and the last step, which begin or end at rest.
        climb: maximum vertical speed of a step.
        change: maximum velocity change between two steps.
        turn: maximum difference of consecutive velocity changes.
    """

    speed: float
    rest: float
    climb: float
    change: float
    turn: float


def step_limits(agent: Agent, step: float) -> StepLimits | None:
    """Limits on the step velocities of a first-order agent; None without limits.

    There are no limits if the vehicle has no limits, or if the agent's top speed exceeds the vehicle's; such a plan is
    time-scaled.

    Args:
        step: duration of a step, seconds.
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
    """Distances along a straight path, metres, at each step, from 0 to ``length``; None if ``most`` steps do not
    suffice.

    The agent accelerates and brakes uniformly, so that it can be at rest or turn at both ends.

    Args:
        length: metres.
        step: duration of a step, seconds.
        speed: maximum speed besides the limits, m/s.
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
