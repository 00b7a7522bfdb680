"""Plans that cannot be flown as fast as they are: they are planned again slower, where the windows allow."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from missionc.backends.api import Budget, NotFound, Reason, Report
from missionc.backends.options import Options
from missionc.base.diagnostics import code
from missionc.base.diagnostics.model import Diagnostic
from missionc.base.source import Source
from missionc.base.trace import Trace
from missionc.base.units import Metres, Seconds
from missionc.compiler import driver
from missionc.compiler.front_end import Checked
from missionc.compiler.plan_request import PlanRequest
from missionc.compiler.results import Compiled, InvalidMission, Verified
from missionc.compiler.strategy import TIME_SCALING, speed_limited, tries
from missionc.compiler.time_scaling import plan_with_time_scaling
from missionc.ir import Mission
from missionc.ir.lower.flyable_steps import CRUISE
from missionc.ir.lower.tighten import with_flyable_speeds
from tests.support.small_missions import SMALL

CROSSING = """
mission crossing
time step 1 s, horizon 30 s
world (0, 0) to (20, 10)
region goal = box (15, 4) to (19, 8)
team drone[2] { vehicle crazyflie21  dynamics single_integrator(speed <= 2 m/s)  start at (2, 3), (2, 7) }
require there: every drone: eventually[0, 30 s] goal
"""


@pytest.fixture(scope="module")
def planned() -> Compiled:
    compiled = driver.compile(Source("small.mission", SMALL))
    assert isinstance(compiled.outcome, Verified)
    return compiled


def refused(finding: code.Code) -> Compiled:
    checked = driver.check(Source("small.mission", SMALL))
    return Compiled(checked, InvalidMission(), (Diagnostic(finding, "too much", None),), ())


NONE = InvalidMission()


class Again:
    """Plans at some shares of the speeds, and takes notes of what it is asked for."""

    def __init__(
        self, planned: Compiled, can: Callable[[float], bool], else_: InvalidMission | NotFound = NONE
    ) -> None:
        self.planned, self.can, self.else_ = planned, can, else_
        self.asked: list[float] = []

    def __call__(self, checked: Checked, request: PlanRequest) -> Compiled:
        self.asked.append(request.speed_fraction)
        if self.can(request.speed_fraction):
            return self.planned
        return replace(self.planned, outcome=self.else_)


def calmly(
    first: Compiled, again: Again, options: Options | None = None, left: float = 600.0
) -> tuple[Compiled, float]:
    now = time.monotonic()
    request = PlanRequest(Budget(now + left, seed=7), options or Options())
    found, of_found = plan_with_time_scaling(first, first.checked, again, request, now)
    return found, of_found.speed_fraction


@pytest.mark.parametrize("finding", [code.NEEDS_MORE_TIME, code.NOT_FLYABLE])
def test_a_plan_that_cannot_be_flown_is_planned_slower_until_one_can(planned: Compiled, finding: code.Code) -> None:
    again = Again(planned, lambda calm: calm < 0.8)
    found, calm = calmly(refused(finding), again)
    assert isinstance(found.outcome, Verified)
    assert calm == 0.7
    assert again.asked == [0.85, 0.7]
    assert found.outcome.report.notes[-1].startswith(
        "the first plan exceeds vehicle limits; this plan uses 70% of the top speeds"
    )


def test_where_nothing_slower_can_be_flown_the_first_refusal_stands(planned: Compiled) -> None:
    first, again = refused(code.NEEDS_MORE_TIME), Again(planned, lambda calm: False)
    assert calmly(first, again) == (first, 1.0)
    assert again.asked == list(TIME_SCALING.fractions)
    none = NotFound(Reason.SOLVER, "none", Report())
    again = Again(planned, lambda calm: False, none)
    assert calmly(first, again) == (first, 1.0)
    assert again.asked == [TIME_SCALING.fractions[0]], "slower, there is no plan either"


def test_a_plan_faster_than_vehicles_fly_is_not_looked_for_slower_since_that_has_been_tried(planned: Compiled) -> None:
    checked = driver.check(Source("crossing.mission", CROSSING))
    for speed, asked in ((1.5, []), (0.9, list(TIME_SCALING.fractions))):
        place = np.minimum(np.arange(31.0) * speed, 12.0)
        position = np.array([[2.0, 3.0], [2.0, 7.0]])[:, None] + place[:, None] * np.array([1.0, 0.0])
        plan = Trace(Seconds(1.0), position, np.zeros_like(position), np.zeros(position.shape[:2]))
        first = Compiled(checked, InvalidMission(plan), (Diagnostic(code.NEEDS_MORE_TIME, "too much", None),), ())
        again = Again(planned, lambda calm: False)
        assert calmly(first, again) == (first, 1.0)
        assert again.asked == asked


def test_nothing_else_is_planned_again(planned: Compiled) -> None:
    again = Again(planned, lambda calm: True)
    for first, options in (
        (planned, None),
        (refused(code.CANNOT_WRITE), None),
        (refused(code.NEEDS_MORE_TIME), Options(stretch=2)),
    ):
        assert calmly(first, again, options) == (first, 1.0)
    assert again.asked == []


def test_no_time_is_no_reason_to_begin(planned: Compiled) -> None:
    first, again = refused(code.NEEDS_MORE_TIME), Again(planned, lambda calm: True)
    assert calmly(first, again, left=-1.0) == (first, 1.0)
    assert again.asked == []


def test_calm_is_a_share_of_the_speeds_at_which_vehicles_fly() -> None:
    mission = driver.check(Source("crossing.mission", CROSSING)).mission
    assert mission is not None
    whole, half = (with_flyable_speeds(mission, calm).agents[0].dynamics.top_speed for calm in (1.0, 0.5))
    assert half == pytest.approx(whole / 2)
    assert whole < mission.agents[0].vehicle.speed


def paces(seconds: int, fraction: float = 1.0) -> list[tuple[float, Mission]]:
    text = CROSSING.replace("eventually[0, 30 s]", f"eventually[0, {seconds} s]")
    checked = driver.check(Source("crossing.mission", text))
    assert checked.mission is not None
    assert checked.kernel is not None
    return speed_limited(checked.mission, checked.kernel, fraction, stretched=False)


def test_paces_begin_with_the_slowest_at_which_all_can_be_in_time() -> None:
    """13 m: at 0.43 m/s, which can be flown from rest, they take 30 s; under way they fly 1 / 1.06 m/s at most."""
    most = 1 / CRUISE
    for seconds, slowest in ((30, 2 / 4.6), (28, 0.55 * most), (20, 0.7 * most), (15, most)):
        speeds = [each.agents[0].dynamics.top_speed for _, each in paces(seconds)]
        assert speeds[0] == pytest.approx(slowest)
        assert speeds == sorted(speeds)
        assert speeds[-1] == pytest.approx(most)
    ((share, slower),) = paces(30, 0.7)
    assert (share, slower.agents[0].dynamics.top_speed) == (0.7, pytest.approx(0.7 * most))


def test_plans_are_tried_at_the_slowest_pace_then_faster_then_with_less_margin() -> None:
    def tried(found: list[tuple[float, Mission]], fraction: float = 1.0) -> list[tuple[int, float]]:
        pace = [mission for _, mission in found]
        wanted = driver.check(Source("crossing.mission", CROSSING)).valid_mission
        return [(pace.index(each.mission), each.margin) for each in tries(wanted, found, Metres(0.05), fraction)]

    every = paces(30)
    assert len(every) == 5
    assert tried(every) == [(0, 1.0), (2, 1.0), (4, 1.0), (4, 0.0)]
    assert tried(every[:2]) == [(0, 1.0), (1, 1.0), (1, 0.0)]
    assert tried(every[:1]) == [(0, 1.0), (0, 0.5), (0, 0.0)]
    assert tried(every[:1], 0.7) == [(0, 1.0)]
