"""The team's state while it is flown: levels and flags of who is seen, of who is not, and how far measures can get."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from missionc import ir
from missionc.ir.predicates.features import Level
from missionc.verification.monitoring.live.team_state import COASTED, NOW, Reach, TeamState, TeamView
from tests.support.legal_plans import SPAN, mission_of

BASE = ir.Region("base", ir.Box((0.0, 0.0), (2.0, 2.0)), SPAN)
FIELD = ir.Region("field", ir.Box((4.0, 0.0), (6.0, 2.0)), SPAN)
BATTERY = ir.Resource("battery", (0, 1), 50.0, 60.0, 1.0, 2.0, (ir.Refill(BASE, 5.0), ir.Refill(FIELD, 3.0)), SPAN)
SEEN = ir.Flag("seen", (0, 1), FIELD, BASE, SPAN)
EVER = ir.Flag("ever", (0,), FIELD, None, SPAN)
MISSION = mission_of([(1.0, 1.0), (3.0, 1.0), (5.0, 1.0)], 8, step=0.5)
ASKED = (ir.Compare(((1.0, Level(BATTERY)),), -10.0, False), ir.Flagged(SEEN), ir.Flagged(EVER))


def moved(*doubts: tuple[float, float, float]) -> TeamState:
    """Everybody goes on by half a metre along x a step, at 1 m/s; so far from there each may be at each step."""
    state = TeamState(MISSION, ASKED)
    for step, doubt in enumerate(doubts):
        position = np.array([[1.0, 1.0], [3.0, 1.0], [5.0, 1.0]]) + np.array([0.5 * step, 0.0])
        state.move(position, np.tile([1.0, 0.0], (3, 1)), np.array([0.1, 0.2, 0.3]), np.array(doubt))
    return state


def test_it_has_where_everybody_is_and_coasts_to_in_a_step() -> None:
    state = moved((0.0,) * 3, (0.0,) * 3)
    assert state.position[:, NOW].tolist() == [[1.5, 1.0], [3.5, 1.0], [5.5, 1.0]]
    assert state.position[:, COASTED].tolist() == [[2.0, 1.0], [4.0, 1.0], [6.0, 1.0]]
    assert state.velocity.tolist() == [[[1.0, 0.0]] * 2] * 3
    assert state.heading.tolist() == [[0.1, 0.1], [0.2, 0.2], [0.3, 0.3]]
    view = TeamView(state)
    assert (view.own().shape, view.place(1).tolist()) == ((3, 2, 2), [[3.5, 1.0], [4.0, 1.0]])
    assert (view.radius().tolist(), view.plane().tolist()) == ([[0.1]] * 3, [[1.0]] * 3)


def test_who_is_seen_has_one_level_and_one_margin_of_a_flag() -> None:
    state = moved((0.0,) * 3, (0.0,) * 3)
    # Half a second costs 0.5, half a metre 1; the base gives 2.5 to who is in it at both ends. The third has none.
    expected = [[51.0, 52.0], [48.5, 47.0], [50.0, 50.0]]
    assert state.levels[BATTERY][0].tolist() == state.levels[BATTERY][1].tolist() == expected
    assert TeamView(state).level(BATTERY).tolist() == expected
    least, most = state.flags[SEEN]
    assert least.tolist() == most.tolist() == [[-2.5, -2.0], [-0.5, 0.0], [-np.inf, -np.inf]]
    assert state.flags[EVER][0].tolist() == [[-2.5, -2.0], [-np.inf, -np.inf], [-np.inf, -np.inf]]


def test_nobody_has_more_than_the_capacity() -> None:
    full = replace(BATTERY, start=60.0)
    state = TeamState(MISSION, (ir.Compare(((1.0, Level(full)),), 0.0, False),))
    still = np.array([[1.0, 1.0], [3.0, 1.0], [5.0, 1.0]])
    for _ in range(2):
        state.move(still, np.zeros((3, 2)), np.zeros(3), np.zeros(3))
    assert state.levels[full][:, :2].tolist() == [[[60.0, 60.0], [59.5, 59.0]]] * 2


def test_of_who_is_not_seen_levels_lie_between_the_longest_way_and_the_shortest_with_all_refills() -> None:
    state = moved((0.0, 0.0, 0.0), (0.0, 0.25, 0.0))
    least, most = state.levels[BATTERY]
    # A step: half a metre and a quarter, or less a quarter, with 4 of refills. Then half a metre on, twice as doubtful.
    assert least.tolist() == [[51.0, 52.0], [48.0, 45.5], [50.0, 50.0]]
    assert most.tolist() == [[51.0, 52.0], [53.0, 56.5], [50.0, 50.0]]
    again = moved((0.0, 0.0, 0.0), (0.0, 0.25, 0.0), (0.0, 0.5, 0.0)).levels[BATTERY]
    assert again[:, 1, NOW].tolist() == [48.0 - 0.5 - 2 * 1.25, 53.0 - 0.5 + 4.0]


def test_of_who_is_not_seen_flags_lie_as_far_apart_as_it_may_be() -> None:
    least, most = moved((0.0, 0.0, 0.0), (0.25, 0.25, 0.0)).flags[SEEN]
    assert least.tolist() == [[-2.75, -2.25], [-0.75, -0.25], [-np.inf, -np.inf]]
    assert most.tolist() == [[-2.25, -1.75], [-0.25, 0.25], [-np.inf, -np.inf]]


def test_a_flag_stays_until_its_region_clears_it() -> None:
    state = TeamState(MISSION, ASKED)
    for x in (5.0, 3.5, 3.0):
        state.move(np.array([[x, 1.0]] * 3), np.zeros((3, 2)), np.zeros(3), np.zeros(3))
    assert state.flags[SEEN][0, :, NOW].tolist() == [1.0, 1.0, -np.inf]
    assert state.flags[EVER][0, :, NOW].tolist() == [1.0, -np.inf, -np.inf]
    state.move(np.array([[2.5, 1.0]] * 3), np.zeros((3, 2)), np.zeros(3), np.zeros(3))
    assert state.flags[SEEN][0, :, NOW].tolist() == [0.5, 0.5, -np.inf]
    state.move(np.array([[2.0, 1.0]] * 3), np.zeros((3, 2)), np.zeros(3), np.zeros(3))
    assert state.flags[SEEN][0, 0, NOW] < 0
    assert state.flags[EVER][0, 0, NOW] == 1.0


SECONDS = np.array([0.0, 0.5, 2.0])


def test_places_and_directions_differ_by_what_anybody_flies_at_its_top_speed() -> None:
    reach = Reach(moved((0.0, 0.25, 0.0)), SECONDS, NOW)
    own, other = [0.0, 1.0, 4.0], [0.25, 1.25, 4.25]
    assert reach.motion().tolist() == [pytest.approx(row, abs=1e-8) for row in (own, other, own)]
    assert reach.motion()[:, 0].tolist() == [0.0, 0.25, 0.0]
    both = np.add(own, other)
    assert reach.relative(0, 1).tolist() == [pytest.approx(both, abs=1e-7)]
    assert reach.relative(None, 1)[1].tolist() == pytest.approx(np.multiply(other, 2), abs=1e-7)
    assert reach.along((3.0, 4.0))[0].tolist() == pytest.approx(np.multiply(own, 5), abs=1e-7)


def test_velocities_differ_by_the_top_acceleration_of_who_has_momentum() -> None:
    heavy = replace(MISSION.agents[0], dynamics=ir.DoubleIntegrator(2.0, 3.0))
    state = TeamState(replace(MISSION, agents=(heavy, *MISSION.agents[1:])), ())
    state.move(np.zeros((3, 2)), np.zeros((3, 2)), np.zeros(3), np.array([0.0, 0.0, 0.5]))
    found = Reach(state, SECONDS, NOW).acceleration()
    assert found[0].tolist() == pytest.approx([0.0, 1.5, 6.0], abs=1e-8)
    assert found[:, 0].tolist() == [0.0, 0.0, np.inf]
    assert found[1].tolist() == [0.0, np.inf, np.inf]
    assert found[2].tolist() == [np.inf] * 3


def test_levels_differ_by_what_is_lost_at_top_speed_or_refilled() -> None:
    state = moved((0.0, 0.0, 0.0), (0.0, 0.25, 0.0))
    # 1 and 2 for each of 2 m, a second; refills would be 8.
    now, coasted = (Reach(state, SECONDS, column).use(BATTERY) for column in (NOW, COASTED))
    assert now[0].tolist() == pytest.approx([0.0, 4.0, 16.0], abs=1e-6)
    assert now[1].tolist() == pytest.approx([2.5, 6.5, 18.5], abs=1e-6)
    assert coasted[1].tolist() == pytest.approx([5.5, 9.5, 21.5], abs=1e-6)
    assert now[:, 0].tolist() == [0.0, 2.5, 0.0]
