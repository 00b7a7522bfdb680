"""Bounds of predicates and links at the present step and in cells to come: two agents, in steps of half a second."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from missionc import ir
from missionc.base.units import Metres, Seconds
from missionc.ir.predicates import Compare, Coordinate, DistanceTo, Facing, Feature, Flagged, Level, Speed
from missionc.verification.monitoring.live import windows
from missionc.verification.monitoring.live.team_state import TeamState
from missionc.verification.monitoring.live.windows import AtomBounds, Cells, denied, of_measure
from tests.support.random_runs import SPAN, mission_of

CELLS = Cells(3, np.array([4, 5, 9]))
"""The next step, the one after it, and four more: up to half a second, a second and three seconds from now."""
FUEL = ir.Resource("fuel", (0, 1), 10.0, 10.0, 1.0, 0.0, (), SPAN)
HOME, AWAY = (
    ir.Region(name, ir.Box((low, -9.0), (low + 2.0, 9.0)), SPAN) for name, low in (("home", 0.0), ("away", 6.0))
)
FLAG = ir.Flag("wet", (0,), HOME, AWAY, SPAN)
RADIO = ir.Proximity("radio", Metres(4.0), (1, 0), SPAN)


def least(value: float, feature: Feature) -> Compare:
    return Compare(((1.0, feature),), -value, False)


def bounds(doubt: float = 0.0, x: float = 3.0) -> AtomBounds:
    """The first is at (x, 0) and goes west at 1 m/s, no faster than that; the second stays at (0, 0), or at 2 m/s."""
    mission = replace(mission_of(2, 9), step=Seconds(0.5))
    agents = tuple(
        replace(agent, dynamics=ir.SingleIntegrator(speed))
        for agent, speed in zip(mission.agents, (1.0, 2.0), strict=True)
    )
    predicates = least(0.0, Level(FUEL)), Flagged(FLAG)
    state = TeamState(replace(mission, agents=agents), predicates)
    position, velocity = np.array([(x, 0.0), (0.0, 0.0)]), np.array([(-1.0, 0.0), (0.0, 0.0)])
    state.move(position, velocity, np.array([0.25, 0.0]), np.array([doubt, 0.0]))
    return AtomBounds(state, CELLS)


def near(*rows: list[float]) -> object:
    """Row by row, but for the slack for rounding."""
    return pytest.approx(np.array(rows), abs=1e-6)


def test_a_margin_widens_by_how_far_an_agent_gets_now_and_after_it_coasted() -> None:
    """2 m beyond 1 m, half a metre less after coasting; and a metre short of it."""
    found = bounds().of_predicate(least(1.0, Coordinate(0)))
    assert found[:, 0] == near([2.0, 1.5, 1.0, -1.0], [2.0, 2.5, 3.0, 5.0], [2.0, 1.5, 1.0, -1.0], [2.0, 1.5, 2.0, 4.0])
    assert found[:2, 1] == near([-1.0, -2.0, -3.0, -7.0], [-1.0, 0.0, 1.0, 5.0])
    assert found[2:, 1] == near([-1.0, -1.0, -2.0, -6.0], [-1.0, -1.0, 0.0, 4.0])


def test_a_distance_widens_by_how_far_both_get() -> None:
    found = bounds().of_predicate(least(1.0, DistanceTo(1)))[:, 0]
    assert found[:2] == near([2.0, 0.5, -1.0, -7.0], [2.0, 3.5, 5.0, 11.0])
    assert found[2:] == near([2.0, 1.5, 0.0, -6.0], [2.0, 1.5, 3.0, 9.0])


def test_what_is_not_seen_is_off_from_the_beginning() -> None:
    found = bounds(doubt=0.25).of_predicate(least(1.0, Coordinate(0)))
    assert found[:2, 0] == near([1.75, 1.25, 0.75, -1.25], [2.25, 2.75, 3.25, 5.25])


def test_a_border_is_decided_as_the_predicate_says() -> None:
    at = bounds(x=1.0).of_predicate(least(1.0, Coordinate(0)))
    assert at[:, 0, 0].tolist() == [5e-324] * 4
    strict = bounds(x=1.0).of_predicate(replace(least(1.0, Coordinate(0)), strict=True))
    assert strict[:, 0, 0].tolist() == [-5e-324] * 4


def test_a_speed_may_be_any_a_step_later() -> None:
    found = bounds().of_predicate(least(0.5, Speed()))
    assert found[:, 0].tolist() == [
        [0.5, -math.inf, -math.inf, -math.inf],
        [0.5, math.inf, math.inf, math.inf],
        [0.5, 0.5, -math.inf, -math.inf],
        [0.5, 0.5, math.inf, math.inf],
    ]


def test_a_heading_is_known_now_and_where_it_coasts() -> None:
    found = bounds().of_predicate(Facing(0.0, 1.0))
    assert found[:, 0].tolist() == [
        [0.75, -math.inf, -math.inf, -math.inf],
        [0.75, math.inf, math.inf, math.inf],
        [0.75, 0.75, -math.inf, -math.inf],
        [0.75, 0.75, math.inf, math.inf],
    ]
    unseen = bounds(doubt=0.25).of_predicate(Facing(0.0, 1.0))
    assert unseen[:2, 0, 0].tolist() == [-math.inf, math.inf]
    assert unseen[:, 1, 0].tolist() == [1.0] * 4


def test_a_level_falls_by_what_is_used_and_a_flag_is_set_where_it_may_be() -> None:
    level = bounds().of_predicate(least(0.0, Level(FUEL)))
    assert level[:, 0, 0].tolist() == [10.0] * 4
    assert level[0, 0].tolist() == pytest.approx([10.0, 9.5, 9.0, 7.0], abs=1e-6)
    flag = bounds().of_predicate(Flagged(FLAG))
    # A metre beside the region that sets it, which is kept; half a metre after coasting.
    assert flag[:2, 0] == near([-1.0, -1.0, -1.0, -1.0], [-1.0, -0.5, 0.0, 2.0])
    assert flag[2:, 0] == near([-1.0, -0.5, -0.5, -0.5], [-1.0, -0.5, 0.0, 2.0])
    assert np.isneginf(flag[:, 1]).all()


def test_a_flag_that_is_set_stays_as_long_as_nobody_gets_to_where_it_is_cleared() -> None:
    flag = bounds(x=1.0).of_predicate(Flagged(FLAG))
    assert flag[0, 0].tolist() == pytest.approx([1.0, 1.0, 1.0, 1.0], abs=1e-6)
    near = bounds(x=1.75).of_predicate(Flagged(FLAG))
    # A quarter of a metre inside; at 6 m it is cleared, four and a quarter away.
    assert near[0, 0].tolist() == pytest.approx([0.25] * 4, abs=1e-6)
    assert near[1, 0].tolist() == pytest.approx([0.25, 0.75, 1.25, 3.25], abs=1e-6)


def test_links_widen_by_how_far_both_get_and_nobody_is_linked_to_itself() -> None:
    found = bounds().links(RADIO)
    assert found.shape == (4, 4, 2, 2)
    assert np.isneginf(np.diagonal(found, axis1=2, axis2=3)).all()
    assert found[:2, :, 0, 1] == near([1.0, -0.5, -2.0, -8.0], [1.0, 2.5, 4.0, 10.0])
    assert found[2:, :, 0, 1] == near([1.0, 1.5, 0.0, -6.0], [1.0, 1.5, 3.0, 9.0])
    assert np.array_equal(found[:, :, 0, 1], found[:, :, 1, 0])
    edge = bounds().links(replace(RADIO, radius=Metres(3.0)))
    assert edge[0, 0, 0, 1] == -5e-324


def test_links_of_many_are_known_in_the_first_and_the_last_cell(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(windows, "MOST_MEMBERS", 2)
    assert bounds().picked(RADIO) == [0, 1, 2]
    monkeypatch.setattr(windows, "MOST_MEMBERS", 1)
    few = bounds()
    assert few.picked(RADIO) == [0, 2]
    found = few.links(RADIO)
    assert found[0, :, 0, 1].tolist() == pytest.approx([1.0, -0.5, -8.0], abs=1e-6)
    assert found[3, :, 0, 1].tolist() == pytest.approx([1.0, 1.5, 9.0], abs=1e-6)
    two = AtomBounds(few.state, Cells(3, np.array([4, 9])))
    assert two.picked(RADIO) == [0, 1]
    over = AtomBounds(few.state, Cells(3, np.array([], dtype=np.int64)))
    assert over.links(RADIO).shape == (4, 1, 2, 2)


def test_the_bounds_of_a_negation_change_places() -> None:
    assert denied(np.array([[1.0], [2.0], [3.0], [4.0]])).tolist() == [[-2.0], [-1.0], [-4.0], [-3.0]]
    assert denied(np.array([[1.0], [2.0]])).tolist() == [[-2.0], [-1.0]]
    assert [of_measure(value) for value in (5e-324, -5e-324, 1e-300, -1.0)] == [0.0, 0.0, 1e-300, -1.0]
