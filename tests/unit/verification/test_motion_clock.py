"""Joint motion on the clock of signals: two agents, one in two pieces that meet within a step, of half a second."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from missionc import ir
from missionc.base.trace import Trace
from missionc.base.units import Seconds
from missionc.geometry.curves.piecewise_polynomials import Curves
from missionc.verification.between.interval_sets import STEP, Motion
from tests.support.random_runs import SPAN, mission_of

MISSION = replace(mission_of(2, 2), step=Seconds(0.5))
JOINT = 3435973837
"""0.4 s in ticks, of which a second has 2^33."""

# (1 + 2 t + 3 t², -t), then from (2, 0) up at 4 m/s; and who stays at (5, 5).
CURVES = Curves(
    np.array([0.0, 0.4, 1.0]),
    np.array([[[[1, 2, 3], [0, -1, 0]], [[2, 0, 0], [0, 4, 0]]], [[[5, 0, 0], [5, 0, 0]]] * 2], dtype=np.float64),
)
MOTION = Motion(MISSION, CURVES)
FIRST, SECOND = np.array([0]), np.array([1])


def at(number: int) -> np.ndarray[tuple[int], np.dtype[np.int64]]:
    return np.array([number])


def test_ticks_count_steps_and_joints_are_ticks() -> None:
    assert MOTION.end == 2 * STEP
    assert MOTION.joints.tolist() == [0, JOINT, 2 * STEP]
    assert MOTION.seconds(STEP // 2) == 0.25


def test_a_piece_has_gone_no_less_than_nothing_and_no_more_than_it_lasts() -> None:
    pieces, ticks = np.array([0, 0, 1, 1, 1]), np.array([STEP // 2, STEP, 0, STEP, 3 * STEP])
    assert MOTION.local(pieces, ticks) == pytest.approx([0.25, 0.4, 0.0, 0.1, 0.6])


def test_a_joint_belongs_to_the_piece_that_begins() -> None:
    ticks = np.array([-1, 0, JOINT - 1, JOINT, 2 * STEP, 3 * STEP])
    assert MOTION.piece_at(ticks).tolist() == [0, 0, 0, 1, 1, 1]


def test_stretches_are_pieces_that_last() -> None:
    times = np.array([0.0, 0.4, 0.4 + 1e-12, 1.0])
    brief = Motion(MISSION, Curves(times, np.zeros((2, 3, 2, 1))))
    assert [column.tolist() for column in brief.stretches(by_step=False)] == [[0, 2], [0, JOINT], [JOINT, 2 * STEP]]


def test_stretches_end_at_steps_too_where_asked_and_the_last_step_is_one() -> None:
    pieces, low, high = MOTION.stretches(by_step=True)
    assert pieces.tolist() == [0, 1, 1, 1]
    assert low.tolist() == [0, JOINT, STEP, 2 * STEP]
    assert high.tolist() == [JOINT, STEP, 2 * STEP, 2 * STEP]


def test_where_agents_are_and_how_fast() -> None:
    moment = np.array([0.2])
    assert MOTION.position(FIRST, at(0), moment) == pytest.approx(np.array([[1.52, -0.2]]))
    assert MOTION.velocity(FIRST, at(0), moment) == pytest.approx(np.array([[3.2, -1.0]]))
    assert MOTION.velocity(FIRST, at(1), moment) == pytest.approx(np.array([[0.0, 4.0]]))


def test_bounds_on_speeds_are_met_at_an_end_of_a_piece() -> None:
    # (2 + 6 t, -1) is fastest at 0.4 s.
    fastest = np.hypot(4.4, 1.0)
    assert MOTION.speed == pytest.approx(np.array([[fastest, 4.0], [0.0, 0.0]]))
    assert MOTION.relative_speed(FIRST, SECOND) == pytest.approx(np.array([[fastest, 4.0]]))
    assert MOTION.acceleration == pytest.approx(np.array([[6.0, 0.0], [0.0, 0.0]]))
    # x + 2 y grows by 6 t and then by 8 m/s.
    assert MOTION.speed_along(FIRST, np.array([1.0, 2.0])) == pytest.approx(np.array([[2.4, 8.0]]))


def test_states_at_steps_are_looked_up_where_none_are_given() -> None:
    trace = MOTION.at_steps
    assert trace.step == 0.5
    assert trace.position == pytest.approx(np.array([[(1, 0), (2, 0.4), (2, 2.4)], [(5, 5)] * 3]))
    assert trace.velocity.tolist() == [[[0, 0]] * 3] * 2
    assert trace.heading.tolist() == [[0] * 3] * 2
    assert with_trace().at_steps is TRACE


TRACE = Trace(
    Seconds(0.5),
    np.array([[(0, 0), (3, 4), (3, 4)], [(5, 5)] * 3], dtype=np.float64),
    np.zeros((2, 3, 2)),
    np.array([[0.1, 0.2, 0.3], [0.4, 0.5, 0.6]]),
)
FUEL = ir.Resource("fuel", (0, 1), 20.0, 30.0, 1.0, 2.0, (), SPAN)
"""There are 20 at first; one is used each second and two each metre."""


def with_trace() -> Motion:
    return Motion(replace(MISSION, resources=(FUEL,)), CURVES, TRACE)


def test_a_level_changes_evenly_from_step_to_step() -> None:
    motion = with_trace()
    assert motion.levels(FUEL) == pytest.approx(np.array([[20.0, 9.5, 9.0], [20.0, 19.5, 19.0]]))
    assert motion.levels(FUEL) is motion.levels(FUEL)
    who, piece, local = np.array([0, 0, 0, 0, 1]), np.array([0, 1, 1, 1, 0]), np.array([0.25, 0.1, 0.35, 0.6, 0.25])
    assert motion.level(FUEL, who, piece, local) == pytest.approx([14.75, 9.5, 9.25, 9.0, 19.75])
    assert motion.use(FUEL) == pytest.approx([21.0, 1.0])


def test_a_heading_is_that_of_the_step_before_or_of_this_very_one() -> None:
    piece, local = np.array([0, 1, 1, 1, 1]), np.array([0.25, 0.099, 0.1 - 1e-11, 0.1, 0.6])
    assert with_trace().heading(np.zeros(5, dtype=np.int64), piece, local).tolist() == [0.1, 0.1, 0.2, 0.2, 0.3]
    assert with_trace().heading(SECOND, at(1), np.array([0.2])).tolist() == [0.5]


def test_slack_is_what_rounding_and_a_tick_may_cost() -> None:
    # The terms of a place add up to 5 m at most; nothing is faster than 6 m/s², the acceleration.
    tick = 6.0 * 0.5 / STEP
    assert MOTION.slack == pytest.approx(6e-11 + tick, abs=0)
    assert with_trace().slack == pytest.approx(31e-11 + tick, abs=0)


def test_a_stretch_reaches_half_of_it_and_of_a_tick_from_its_middle() -> None:
    assert MOTION.reach(np.array([0]), np.array([STEP])) == pytest.approx(
        [0.25 * (1 + 1 / STEP) * (1 + 2e-9)], rel=1e-12
    )
    assert MOTION.reach(np.array([7]), np.array([7])) == pytest.approx([0.25 / STEP], rel=1e-8, abs=0)
