"""Plans of first order that keep the limits of flyable steps are flown within the limits of their vehicle."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from missionc.backends.clot.cost_weights import spare
from missionc.backends.clot.optimise.control_points import splines
from missionc.backends.clot.optimise.flown_limits import FLOWN, flown_limits
from missionc.backends.clot.optimise.residuals import rows
from missionc.backends.clot.settings import Weights
from missionc.backends.clot.straighten import straightened
from missionc.base.source import Source
from missionc.base.trace import Array, Trace
from missionc.base.units import Seconds
from missionc.compiler import driver
from missionc.flight.trajectories.crazyflie import Flyable, crazyflie
from missionc.ir import PLAIN, DoubleIntegrator, Mission
from missionc.ir.lower.flyable_steps import StepLimits, step_limits
from missionc.ir.lower.tighten import with_flyable_speeds
from tests.support.legal_plans import NOTHING, straight

HALL = """
mission hall
time  step 1 s, horizon 16 s
world (0, 0) to (16, 4)
region far = box (9, 1) to (15, 3)
agent drone { vehicle crazyflie21  dynamics single_integrator(speed <= 1 m/s)  start at (1, 2) }
require there: drone: eventually[0, 13 s] far
"""


def hall(steps: int = 16) -> tuple[Mission, StepLimits]:
    mission = driver.check(Source("hall.mission", HALL)).mission
    assert mission is not None
    limits = step_limits(mission.agents[0], float(mission.step))
    assert limits is not None
    return replace(mission, steps=steps), limits


def gentle(limits: StepLimits, cruise: int) -> Array:
    """Speeds of steps that rise evenly as fast as they may, (steps,), and fall so."""
    speeds = [limits.rest]
    while speeds[-1] < limits.speed:
        speeds.append(min(limits.speed, speeds[-1] + (limits.change if len(speeds) > 1 else limits.turn)))
    return np.array([*speeds[:-1], *[limits.speed] * cruise, *speeds[-2::-1]])


def test_a_straight_plan_that_keeps_the_limits_is_flown_within_those_of_the_vehicle() -> None:
    _, limits = hall()
    way = np.append(0.0, np.cumsum(gentle(limits, 4)))
    mission, _ = hall(way.size - 1)
    path = np.stack([1 + way, np.full(way.size, 2.0)], axis=1)
    flown = crazyflie(mission, NOTHING, straight(path[None]))
    assert isinstance(flown, Flyable), flown
    at_once = np.minimum(1 + limits.speed * np.arange(way.size), path[-1, 0])
    path = np.stack([at_once, np.full(way.size, 2.0)], axis=1)
    assert not isinstance(crazyflie(mission, NOTHING, straight(path[None])), Flyable)


def test_only_vehicles_with_limits_have_any_and_second_order_keeps_its_own() -> None:
    mission, limits = hall()
    agent = mission.agents[0]
    assert limits.rest <= limits.change / 2
    assert limits.turn <= limits.change
    assert step_limits(replace(agent, vehicle=PLAIN), 1.0) is None
    bounded = step_limits(replace(agent, vehicle=replace(PLAIN, name="only", vertical_speed=0.5)), 1.0)
    assert bounded is not None
    assert bounded.climb < 0.5
    assert np.isinf([bounded.speed, bounded.change]).all()
    assert step_limits(replace(agent, dynamics=DoubleIntegrator(1.0, 1.0)), 1.0) is None


def broken(mission: Mission, position: Array) -> dict[str, float]:
    """The worst residual of each limit that is exceeded, metres of a step."""
    made = splines(mission)
    control = made.through(position)
    found = (rows(group, control, 0.0) for group in flown_limits(mission, made, Weights(), spare(mission)))
    return {part.name: float(part.value.max()) for part in found if part.value.size}


def test_residuals_say_which_limits_a_motion_exceeds() -> None:
    mission, limits = hall()
    speeds = gentle(limits, 30)[: mission.steps]
    speeds[-1] = 0.0
    way = np.append(1.0, 1 + np.cumsum(0.9 * speeds))
    level = np.full(way.size, 2.0)
    assert "flown rest" not in broken(mission, np.stack([way, level], axis=1)[None])
    at_once = 1 + 0.9 * np.minimum(np.arange(mission.steps + 1), 10)
    found = broken(mission, np.stack([at_once, level], axis=1)[None])
    assert set(found) == {"flown rest", "flown turn"}
    assert set(found) < set(FLOWN)
    assert found["flown rest"] == pytest.approx(0.9 - 0.98 * limits.rest)
    plain = replace(mission, agents=(replace(mission.agents[0], vehicle=PLAIN),))
    assert broken(plain, np.stack([at_once, level], axis=1)[None]) == {}


def test_a_plan_that_is_at_speed_at_once_is_straightened_into_one_that_comes_to_it() -> None:
    checked = driver.check(Source("hall.mission", HALL))
    assert checked.mission is not None
    assert checked.kernel is not None
    mission = with_flyable_speeds(checked.mission, 1.0)
    way = np.minimum(1 + 0.75 * np.arange(mission.steps + 1), 1 + 0.75 * 12)
    position = np.stack([way, np.full(way.size, 2.0)], axis=1)[None]
    velocity = np.concatenate([np.diff(position, axis=1), np.zeros((1, 1, 2))], axis=1)
    plan = Trace(Seconds(1.0), position, velocity, np.zeros((1, way.size)))
    before = broken(mission, plan.position)
    after = broken(mission, straightened(mission, checked.kernel, plan).position)
    assert max(before.values()) > 0.1
    assert max(after.values(), default=0.0) < 0.02
