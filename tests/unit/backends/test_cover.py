"""Covers: what they refuse and why, what they admit, and that a backend's refusal of roadmaps stays one of roadmaps."""

from __future__ import annotations

import math
import time
from pathlib import Path

import numpy as np
import pytest

from missionc import ir
from missionc.backends.api import Budget
from missionc.backends.cover.bodies import bodies, standing_room
from missionc.backends.cover.cells import Cells
from missionc.backends.cover.keep_apart import fits
from missionc.backends.cover.may_labels import hidden
from missionc.backends.cover.may_moves import nearest
from missionc.backends.cover.refute import Answer, Inconclusive, Refuted, refute
from missionc.backends.run_account import Account
from missionc.base.units import Metres
from missionc.compiler import driver
from tests.support.legal_plans import SPAN, mission_of, still

MISSIONS = Path(__file__).resolve().parents[3] / "missions" / "both_sides"

REASONS = {
    "beacon_out_of_range": ("heard",),
    "corridor_swap": ("there", "back"),
    "shaft_swap": ("down", "up"),
    "errand_in_order": ("brought",),
    "half_of_ten": ("half",),
    "hole_in_a_floor": ("climb",),
    "links_shorter_than_bodies": ("met",),
    "meeting_too_soon": ("meet",),
    "one_charge_for_two_trips": ("alive", "one", "other"),
    "order_in_a_lane": ("last", "middle"),
    "out_and_back": ("out", "back"),
    "seen_through_a_wall": ("seen",),
    "short_relay": ("visit", "relay"),
    "slow_all_the_way": ("slow", "reach"),
    "three_places_for_two": ("all_three",),
    "turn_back_at_once": ("there", "back", "again"),
    "until_too_high": ("jump",),
}
"""Of missions that cannot be, the requirements that covers find in conflict."""


def answered(path: Path, work: float) -> Answer:
    checked = driver.check(path)
    assert checked.mission is not None
    assert checked.kernel is not None
    return refute(checked.mission, checked.kernel, Budget(time.monotonic() + 300, work=work), Account())


@pytest.mark.parametrize("name", sorted(REASONS))
def test_what_no_motion_does_is_refused_with_its_requirements(name: str) -> None:
    answer = answered(MISSIONS / f"impossible_{name}.mission", 6.0)
    assert isinstance(answer, Refuted)
    assert answer.conflict == REASONS[name]


@pytest.mark.parametrize("name", ["corridor_swap", "half_of_ten", "seen_past_a_wall", "slow_zone", "tall_tower"])
def test_what_has_a_plan_is_admitted(name: str) -> None:
    assert isinstance(answered(MISSIONS / f"possible_{name}.mission", 0.5), Inconclusive)


@pytest.mark.parametrize(
    ("size", "apart", "most"),
    [
        ((1.2, 0.2), 0.5, 3),
        ((1.1, 1.1), 0.8, 4),
        ((0.99, 0.99, 0.99), 1.0, 8),
        ((0.0, 0.0), 0.5, 1),
        ((8.0, 8.0), 6.0, 4),
    ],
)
def test_so_many_bodies_fit_at_most(size: tuple[float, ...], apart: float, most: int) -> None:
    assert fits(size, apart) == most


def test_as_many_fit_as_stand_on_a_grid() -> None:
    for side in range(1, 6):
        assert fits((float(side), float(side)), 1.0) >= (side + 1) ** 2


def test_a_hole_is_as_narrow_as_its_body_is() -> None:
    wall = ir.Difference(ir.Box((0.0, 4.0), (10.0, 6.0)), ir.Box((4.0, 0.0), (4.5, 10.0)))
    assert bodies(wall) == (ir.Box((0.0, 4.0), (4.0, 6.0)), ir.Box((4.5, 4.0), (10.0, 6.0)))
    mission = mission_of([(1.0, 1.0)], 1, radius=0.3, obstacles=[still(wall)])
    low, high = np.array([[4.0, 4.9], [4.25, 4.9], [4.0, 0.0]]), np.array([[4.25, 5.1], [4.5, 5.1], [4.5, 1.0]])
    room = standing_room(mission.obstacles[0], mission.agents[0], mission, 0, low, high)
    assert room.tolist() == [False, False, True]


def test_a_wall_hides_what_is_behind_it_and_not_what_is_beside() -> None:
    graph = ir.Sight("eye", Metres(20.0), (ir.Box((4.0, 0.0), (6.0, 6.0)),), (0, 1), SPAN)
    nothing = np.zeros((0, 2)), np.zeros((0, 2))
    here = Cells(np.array([[1.0, 1.0], [1.0, 7.0]]), np.array([[2.0, 2.0], [2.0, 8.0]]), nothing)
    there = Cells(np.array([[8.0, 1.0], [8.0, 7.0]]), np.array([[9.0, 2.0], [9.0, 8.0]]), nothing)
    assert hidden(graph, here, there).tolist() == [[True, True], [True, False]]


def test_who_turns_slowly_gets_away_at_least_as_far_as_along_a_circle() -> None:
    aircraft = ir.Unicycle(2.0, 3.0, 0.5)
    assert nearest(aircraft, 1.0, 1, 2) == pytest.approx(2.0, rel=1e-3)
    assert nearest(aircraft, 1.0, 4, 2) == pytest.approx(2.0 * math.sin(1.0) / math.sin(0.25), rel=1e-3)
    assert nearest(aircraft, 1.0, 8, 2) == 0.0
    assert nearest(aircraft, 1.0, 2, 3) == 0.0
    assert nearest(ir.Unicycle(0.0, 3.0, 0.5), 1.0, 2, 2) == 0.0
