"""Wider margins: a plan with narrow margins becomes one with wide margins that is little longer."""

from __future__ import annotations

import math

import numpy as np
import pytest

pytest.importorskip("torch")

from missionc.backends.acceptance import attempt
from missionc.backends.api import Budget, CutShort, Planned, Report
from missionc.backends.clot.optimise.control_points import splines, trace
from missionc.backends.clot.optimise.improve import duration, travelled
from missionc.backends.clot.widen import widen
from missionc.base.trace import Trace
from missionc.ir import Mission
from missionc.ir.kernel.nodes import Kernel
from missionc.verification.monitoring.normalised_margins import normalised_margins
from tests.support.transport_missions import checked

ROOM = """
mission room
time step 1 s, horizon 12 s
world (0, 0) to (10, 6)
region goal = box (6, 1) to (8, 5)
team rover[2] { radius 0.3 m  dynamics DYNAMICS  start at (1, 1.5), (1, 3.5) }
separation 0.2 m
require there: every rover: eventually[0, 9 s] goal
"""


def mission_of(dynamics: str = "single_integrator(speed <= 2 m/s)", more: str = "") -> tuple[Mission, Kernel]:
    return checked(ROOM.replace("DYNAMICS", dynamics) + more)


def narrow(mission: Mission) -> Trace:
    """Both rovers stop 2 cm inside the goal."""
    position = np.zeros((2, mission.steps + 1, 2))
    position[:, :, 0] = np.minimum(1 + np.arange(mission.steps + 1), 6.02)
    position[0, :, 1], position[1, :, 1] = 1.5, 3.5
    made = splines(mission)
    return trace(mission, made, made.through(position))


def least(mission: Mission, kernel: Kernel, plan: Trace) -> float:
    return min(normalised_margins(mission, kernel.requirements, plan).values())


def widened(mission: Mission, kernel: Kernel, work: float = 5.0, deadline: float = math.inf) -> tuple[Planned, Planned]:
    plan = Planned(narrow(mission), Report())
    assert attempt(mission, kernel, plan.trace).is_plan
    return plan, widen(mission, kernel, plan, Budget(deadline, work=work))


@pytest.mark.parametrize("dynamics", ["single_integrator(speed <= 2 m/s)", "unicycle(speed 0..2 m/s, turn <= 2 rad/s)"])
def test_a_narrow_plan_becomes_wide_and_hardly_longer(dynamics: str) -> None:
    mission, kernel = mission_of(dynamics)
    plan, wide = widened(mission, kernel)
    assert attempt(mission, kernel, wide.trace).is_plan
    assert least(mission, kernel, plan.trace) == pytest.approx(0.02)
    assert least(mission, kernel, wide.trace) >= 0.15
    assert travelled(wide.trace) <= 1.1 * travelled(plan.trace)
    assert 0 < wide.report.work <= 5.5


def test_a_wider_plan_ends_no_later_if_duration_counts() -> None:
    mission, kernel = mission_of(more="minimize duration\n")
    plan, wide = widened(mission, kernel)
    assert wide.trace is not plan.trace
    assert duration(wide.trace) <= duration(plan.trace)


@pytest.mark.parametrize(("work", "deadline", "ended"), [(0.0, math.inf, None), (5.0, 0.0, CutShort.TIME)])
def test_without_work_or_time_the_plan_stays(work: float, deadline: float, ended: CutShort | None) -> None:
    plan, wide = widened(*mission_of(), work, deadline)
    assert wide.trace is plan.trace
    assert wide.report.cut_short is ended
