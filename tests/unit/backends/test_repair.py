"""Repair: a motion that nearly keeps a kernel becomes a plan near to it; what is far from one does not."""

from __future__ import annotations

import time

import numpy as np
import pytest

pytest.importorskip("torch")

from missionc.backends.acceptance import attempt
from missionc.backends.api import Budget, NotFound, Planned, Reason
from missionc.backends.clot.optimise.control_points import splines, trace
from missionc.backends.clot.repair import Repair
from missionc.backends.options import Options
from missionc.base.trace import Trace
from missionc.ir import Mission
from missionc.ir.lower.hold_throughout import hold_throughout
from tests.support.transport_missions import checked

HANDOVER = """
mission handover
time step 1 s, horizon 8 s
world (0, 0) to (10, 4)
region post = box (4, 1) to (6, 3)
agent first  { radius 0.1 m  dynamics single_integrator(speed <= 2 m/s)  start at (5, 1.6) }
agent second { radius 0.1 m  dynamics single_integrator(speed <= 2 m/s)  start at (9, 2.4) }
separation 0.1 m
require manned:  always[0, 8 s] ((first: post) or (second: post))
require leaves:  first: eventually[0, 8 s] x <= 2
"""
STEPS = 9
LEFT = [5, 5, 5, 3.4, 1.6, 1.6, 1.6, 1.6, 1.6]
CAME = [9, 8, 6.4, 4.6, 4.6, 5, 5, 5, 5]


def handover() -> tuple[Mission, Trace]:
    """The second comes in within the step in which the first leaves."""
    mission, _ = checked(HANDOVER)
    across = np.array([LEFT, CAME])
    up = np.broadcast_to([[1.6], [2.4]], (2, STEPS))
    made = splines(mission)
    return mission, trace(mission, made, made.through(np.stack([across, up], -1)))


def budget(seconds: float = 60.0) -> Budget:
    return Budget(time.monotonic() + seconds)


def test_who_takes_over_late_comes_earlier_and_little_else_changes() -> None:
    mission, motion = handover()
    _, kernel = checked(HANDOVER)
    asked = hold_throughout(mission, kernel, {"manned"})
    assert attempt(mission, kernel, motion).is_plan
    assert not attempt(mission, asked, motion).is_plan
    found = Repair(motion).plan(mission, asked, Options(), budget())
    assert isinstance(found, Planned)
    assert attempt(mission, asked, found.trace).is_plan
    moved = np.linalg.norm(found.trace.position - motion.position, axis=-1)
    assert 0 < moved.max() < 1.5
    assert found.report.work > 0


def test_a_motion_without_a_plan_near_to_it_is_not_one_and_nothing_is_called_impossible() -> None:
    mission, motion = handover()
    _, kernel = checked(f"{HANDOVER}require close: first: eventually[0, 8 s] distance(second) <= 0.25 m\n")
    found = Repair(motion).plan(mission, kernel, Options(), budget())
    assert isinstance(found, NotFound)
    assert found.reason is Reason.SOLVER


def test_where_time_is_up_nothing_is_found() -> None:
    mission, motion = handover()
    _, kernel = checked(HANDOVER)
    found = Repair(motion).plan(mission, hold_throughout(mission, kernel, {"manned"}), Options(), budget(-1.0))
    assert isinstance(found, NotFound)
    assert found.reason is Reason.TIME


def test_the_same_motion_is_repaired_the_same_way() -> None:
    mission, motion = handover()
    _, kernel = checked(HANDOVER)
    asked = hold_throughout(mission, kernel, {"manned", "leaves"})
    one, other = (Repair(motion).plan(mission, asked, Options(), budget()) for _ in range(2))
    assert isinstance(one, Planned)
    assert isinstance(other, Planned)
    assert np.array_equal(one.trace.position, other.trace.position)
