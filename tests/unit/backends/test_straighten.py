"""Straightening: plans from roadmaps become shorter and calmer, keep what they kept, and stay plans."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("torch")

from missionc.backends.acceptance import attempt
from missionc.backends.api import Budget, CutShort, Planned, Report
from missionc.backends.clot.optimise.control_points import splines, trace
from missionc.backends.clot.optimise.improve import duration, travelled
from missionc.backends.clot.straighten import straighten, straightened
from missionc.base.trace import Array, Trace
from missionc.geometry.outline import outlined
from missionc.ir import Box, Difference, Mission, Polygon
from missionc.ir.distances.signed_distance import signed_distance
from missionc.ir.kernel.nodes import Kernel
from tests.support.transport_missions import checked

ROOMS = """
mission rooms
time step 1 s, horizon 30 s
world (0, 0) to (20, 10)
region goal = box (16, 6) to (19, 9)
obstacle wall = box (9.7, 0) to (10.3, 10) - box (9, 4) to (11, 6)
agent rover { radius 0.4 m  dynamics DYNAMICS  start at (2, 2) }
agent cart  { radius 0.4 m  dynamics DYNAMICS  start at (2, 8) }
separation 0.2 m
require there: rover: eventually[0, 26 s] goal
"""

ZIGZAG = [(2, 2), (3, 1), (4, 3), (5, 2), (6, 4), (7, 3), (8, 5), (9, 5), (10, 5), (11, 5), (12, 4), (13, 6)]
ZIGZAG += [(14, 5), (15, 7), (16, 6.4), (17, 7)]


def with_dynamics(dynamics: str) -> tuple[Mission, Kernel]:
    return checked(ROOMS.replace("DYNAMICS", dynamics))


def a_plan(mission: Mission) -> Trace:
    """The rover goes in a zigzag and stays; the cart takes a turn for nothing."""
    position: Array = np.zeros((2, mission.steps + 1, 2))
    position[0] = [*ZIGZAG, *[ZIGZAG[-1]] * (mission.steps + 1 - len(ZIGZAG))]
    position[1] = (2, 8)
    position[1, 5:9] = [(3, 8), (4, 8), (4, 8), (3, 8)]
    made = splines(mission)
    return trace(mission, made, made.through(position))


@pytest.mark.parametrize(
    "dynamics",
    ["unicycle(speed 0..2.5 m/s)", "single_integrator(speed <= 2.5 m/s)"],
)
def test_a_zigzag_becomes_straight_and_the_idle_stand(dynamics: str) -> None:
    mission, kernel = with_dynamics(dynamics)
    plan = a_plan(mission)
    assert attempt(mission, kernel, plan).is_plan
    straight = straightened(mission, kernel, plan)
    assert attempt(mission, kernel, straight).is_plan
    assert travelled(straight) < 0.75 * travelled(plan)
    assert np.linalg.norm(np.diff(straight.position[1], axis=0), axis=1).sum() < 0.02


def test_what_is_kept_is_the_same_each_time() -> None:
    mission, kernel = with_dynamics("unicycle(speed 0..2.5 m/s)")
    plan = a_plan(mission)
    once, again = straightened(mission, kernel, plan), straightened(mission, kernel, plan)
    assert np.array_equal(once.position, again.position)


def test_nobody_moves_for_longer_where_duration_counts() -> None:
    mission, kernel = checked(ROOMS.replace("DYNAMICS", "unicycle(speed 0..2.5 m/s)") + "minimize duration\n")
    plan = a_plan(mission)
    assert duration(straightened(mission, kernel, plan)) <= duration(plan)


def test_a_plan_for_which_there_is_no_time_is_given_back() -> None:
    mission, kernel = with_dynamics("unicycle(speed 0..2.5 m/s)")
    plan = Planned(a_plan(mission), Report())
    late = straighten(mission, kernel, plan, Budget(deadline=0.0))
    assert late.trace is plan.trace
    assert late.report.cut_short is CutShort.TIME
    better = straighten(mission, kernel, plan, Budget(deadline=np.inf))
    before, after = travelled(plan.trace), travelled(better.trace)
    assert better.report.notes[-1] == f"distance {after:.6g} m after straightening, {before:.6g} m on the roadmap"


def test_a_preference_that_is_kept_stays_kept() -> None:
    text = ROOMS.replace("DYNAMICS", "unicycle(speed 0..2.5 m/s)") + "prefer low: rover: eventually[0, 2 s] y <= 1.2\n"
    mission, kernel = checked(text)
    straight = straightened(mission, kernel, a_plan(mission))
    assert attempt(mission, replace(kernel, requirements=kernel.preferences), straight).is_plan


def test_the_control_points_of_a_trace_have_its_states() -> None:
    mission, _ = with_dynamics("double_integrator(speed <= 2 m/s, acceleration <= 1 m/s^2)")
    made = splines(mission)
    control = np.random.default_rng(0).normal(size=(2, made.points, 2))
    position, velocity = made.states(control)
    again = made.states(made.joined(position, velocity))
    assert again[0] == pytest.approx(position)
    assert again[1] == pytest.approx(velocity)


def test_the_distance_to_a_door_is_the_true_one() -> None:
    wall = Difference(Box((9.7, 0.0), (10.3, 10.0)), Box((9.0, 4.0), (11.0, 6.0)))
    beside = np.array([[9.3, 4.3], [10.0, 5.0]])
    assert signed_distance(np, outlined(wall), beside) == pytest.approx([0.5, 1.0])
    assert signed_distance(np, wall, beside)[0] < 0.45
    frame = outlined(Difference(Box((0.0, 0.0), (4.0, 4.0)), Box((1.0, 1.0), (3.0, 3.0))))
    assert signed_distance(np, frame, np.array([[2.0, 2.0], [1.5, 2.0]])) == pytest.approx([1.0, 0.5])
    assert signed_distance(np, frame, np.array([[0.5, 2.0]]))[0] < 0
    plain = Polygon(((0.0, 0.0), (1.0, 0.0), (0.0, 1.0)))
    assert outlined(plain) is plain
