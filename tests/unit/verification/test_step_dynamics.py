"""Checks of dynamics, each as a whole, on motions made by hand in steps of half a second."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from missionc import ir
from missionc.base.trace import Trace
from missionc.base.units import Seconds
from missionc.verification.certificate import Check
from missionc.verification.plan.step_dynamics import check_dynamics, check_shape
from tests.support.legal_plans import mission_of, moved, pushed, straight

START = [1.0, 1.0]
# Half a metre east, a metre north, a metre and a half west.
TURNING = straight([[START, [1.5, 1.0], [1.5, 2.0], [0.0, 2.0]]], 0.5)
ME = ("drone[0]",)
AGREE = "position, velocity and time are consistent"


def checks(trace: Trace, dynamics: ir.Dynamics) -> dict[str, Check]:
    steps = trace.position.shape[1] - 1
    found = check_dynamics(mission_of(trace.position[:, 0].tolist(), steps, step=0.5, dynamics=dynamics), trace)
    assert all((each.subject, each.agents, each.tolerance) == (ME[0], ME, 1e-6) for each in found)
    return {each.name: each for each in found}


def says(check: Check) -> tuple[float, str, bool, float | None, str]:
    return round(check.margin, 9), check.unit, check.passed, check.at, check.detail


def test_the_shape_of_a_plan_is_that_of_its_mission() -> None:
    mission = mission_of([START], 3, step=0.5)
    detail = "1 agents, 4 states of 2 coordinates, 0.5 s apart, all finite"
    assert check_shape(mission, TURNING) == Check("shape", "plan", 0.0, "", 0.0, True, detail=detail)
    nan = np.full((1, 4), np.nan)
    for wrong in (
        replace(TURNING, position=TURNING.position[:, :3]),
        replace(TURNING, velocity=TURNING.velocity[:, :3]),
        replace(TURNING, velocity=TURNING.velocity[..., :1]),
        replace(TURNING, heading=TURNING.heading[:, :3]),
        replace(TURNING, heading=nan),
        replace(TURNING, position=TURNING.position + np.inf),
        replace(TURNING, velocity=TURNING.velocity + nan[..., None]),
        replace(TURNING, step=Seconds(0.5 + 1e-9)),
    ):
        assert check_shape(mission, wrong) == Check("shape", "plan", 0.0, "", 0.0, False, detail=detail)


def test_straight_motion_is_as_fast_as_it_says_and_no_faster_than_allowed() -> None:
    found = checks(TURNING, ir.SingleIntegrator(2.5))
    assert list(found) == ["motion", "speed"]
    assert says(found["motion"]) == (0.0, "m", True, 0.0, AGREE)
    assert says(found["speed"]) == (-0.5, "m/s", False, 1.0, "at most 2.5 m/s")


def test_a_state_that_motion_does_not_lead_to_is_named() -> None:
    off = checks(moved(TURNING, 0, 2, [0.3, 0.4]), ir.SingleIntegrator(9.0))["motion"]
    assert says(off) == (-0.5, "m", False, 0.5, AGREE)
    # The last velocity is that of the last motion; half a metre a second more is a quarter of a metre in a step.
    velocity = TURNING.velocity.copy()
    velocity[0, -1] += [0.3, 0.4]
    late = checks(replace(TURNING, velocity=velocity), ir.SingleIntegrator(9.0))["motion"]
    assert says(late) == (-0.25, "m", False, 1.5, AGREE)


def test_who_faces_ahead_moves_there_turns_slowly_and_no_slower_than_it_can() -> None:
    dynamics = ir.Unicycle(1.5, 4.0, 4.0)
    found = checks(TURNING, dynamics)
    assert list(found) == ["motion", "speed", "heading", "turn"]
    assert says(found["speed"]) == (-0.5, "m/s", False, 0.0, "1.5 to 4 m/s")
    assert (says(found["heading"])[0], found["heading"].passed) == (0.0, True)
    # A quarter of a turn, of 2 rad in a step.
    turn = found["turn"]
    assert says(turn) == (round(2 - math.pi / 2, 9), "rad", True, 0.0, "at most 2 rad from step to step")
    aside = TURNING.heading.copy()
    aside[0, 1] += math.pi / 3
    wrong = checks(replace(TURNING, heading=aside), dynamics)
    # A way of 1 m ends 1 m from where it would lead, 60 degrees aside.
    assert says(wrong["heading"]) == (-1.0, "m", False, 0.5, "it moves along its heading")
    assert says(wrong["turn"]) == (round(2 - math.pi * 5 / 6, 9), "rad", False, 0.0, "at most 2 rad from step to step")


def test_a_turn_is_the_shorter_way_round() -> None:
    heading = np.array([[3.0, -3.0, 0.0, 0.0]])
    turn = checks(replace(TURNING, heading=heading), ir.Unicycle(0.0, 4.0, 8.0))["turn"]
    assert says(turn)[0] == 1.0
    assert turn.at == 0.5
    few = checks(replace(TURNING, heading=heading[:, [0, 1, 1, 1]]), ir.Unicycle(0.0, 4.0, 8.0))["turn"]
    assert few.margin == pytest.approx(4.0 - (2 * math.pi - 6.0))
    assert "turn" not in checks(TURNING, ir.Unicycle(0.0, 4.0, math.inf))


def test_a_climb_turns_nobody() -> None:
    climbing = straight([[[1.0, 1.0, 1.0], [4.0, 5.0, 13.0]]], 0.5)
    assert says(checks(climbing, ir.Unicycle(0.0, 99.0, math.inf))["heading"])[0] == 0.0
    aside = checks(replace(climbing, heading=climbing.heading + math.pi), ir.Unicycle(0.0, 99.0, math.inf))
    assert says(aside["heading"])[0] == -10.0


def test_an_acceleration_is_constant_within_a_step_and_bounded() -> None:
    velocity, pushes = np.array([[1.0, 0.0]]), np.array([[[0.0, 0.0], [3.0, 4.0], [0.0, -2.0]]])
    trace = pushed(np.array([START]), velocity, pushes, 0.5)
    found = checks(trace, ir.DoubleIntegrator(2.0, 4.5))
    assert list(found) == ["motion", "speed", "acceleration"]
    constant = f"{AGREE} with constant acceleration"
    assert says(found["motion"]) == (0.0, "m", True, 0.0, constant)
    # (2.5, 2) m/s at the second step.
    assert says(found["speed"]) == (round(2 - math.hypot(2.5, 2.0), 9), "m/s", False, 1.0, "at most 2 m/s")
    assert says(found["acceleration"]) == (-0.5, "m/s^2", False, 0.5, "at most 4.5 m/s^2")
    off = checks(moved(trace, 0, 3, [0.3, 0.4]), ir.DoubleIntegrator(9.0, 9.0))["motion"]
    assert says(off) == (-0.5, "m", False, 1.0, constant)


def test_who_has_no_step_to_take_breaks_nothing() -> None:
    places = np.array([[START]])
    trace = Trace(Seconds(0.5), places, np.zeros_like(places), np.zeros((1, 1)))
    for dynamics in (ir.SingleIntegrator(2.5), ir.Unicycle(0.5, 4.0, 4.0)):
        assert all((each.margin, each.at) == (0.0, 0.0) for each in checks(trace, dynamics).values())


def test_every_agent_is_checked_on_its_own() -> None:
    both = straight([[START, [1.5, 1.0]], [[3.0, 3.0], [3.0, 5.0]]], 0.5)
    found = check_dynamics(mission_of([START, [3.0, 3.0]], 1, step=0.5, dynamics=ir.SingleIntegrator(3.0)), both)
    assert [(each.name, each.subject, each.margin) for each in found] == [
        ("motion", "drone[0]", 0.0),
        ("speed", "drone[0]", 2.0),
        ("motion", "drone[1]", 0.0),
        ("speed", "drone[1]", -1.0),
    ]
