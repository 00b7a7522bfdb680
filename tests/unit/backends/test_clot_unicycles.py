"""Unicycles in continuous space: they turn no faster than they may, keep their least speed, and are verified."""

from __future__ import annotations

import math

import numpy as np
import pytest

pytest.importorskip("torch")

from missionc.backends.acceptance import attempt
from missionc.backends.clot.cost_weights import spare
from missionc.backends.clot.optimise.control_points import followed, pursued, splines, trace
from missionc.backends.clot.optimise.motion_residuals import Costs
from missionc.backends.clot.optimise.residuals import rows
from missionc.backends.clot.settings import Spare, Weights
from missionc.ir import Unicycle
from tests.support.transport_missions import checked, planned

FIELD = """
mission field
time step 1 s, horizon 30 s
world (0, 0) to (40, 30)
region goal = box (28, 18) to (38, 28)
region home = box (2, 2) to (8, 8)
obstacle rock = disc at (20, 15) radius 4 m
separation 0.3 m
"""

LOITERS = f"""{FIELD}
team plane[2] {{ radius 0.3 m  dynamics unicycle(speed 1..2 m/s, turn <= 45 deg/s)  start at (4, 4), (4, 10) }}
require late: every plane: eventually[26 s, 30 s] goal
require before: every plane: always[0, 18 s] not goal
"""

TURNS_ROUND = f"""{FIELD}
team cart[2] {{ radius 0.3 m  dynamics unicycle(speed 0..3 m/s, turn <= 30 deg/s)  start at (10, 4), (10, 8) }}
require there: every cart: eventually[0, 16 s] x >= 16
require back: every cart: eventually[26 s, 30 s] home
"""


@pytest.mark.parametrize("text", [LOITERS, TURNS_ROUND], ids=["loiters", "turns round"])
def test_a_plan_is_found_and_verified(text: str) -> None:
    planned(text)


def turned(position: np.ndarray) -> np.ndarray:
    """By how much the direction of (steps + 1, 2) positions changes from step to step, rad."""
    way = np.diff(position, axis=0)
    heading = np.arctan2(way[:, 1], way[:, 0])
    return np.asarray(np.abs((np.diff(heading) + math.pi) % (2 * math.pi) - math.pi))


def test_pursuit_leaves_what_obeys_as_it_is() -> None:
    angle = np.linspace(0, 3, 20)
    arc = 10 * np.stack([np.sin(angle), -np.cos(angle)], axis=1)
    assert np.array_equal(pursued(Unicycle(0.5, 2.0, 0.2), arc, 1.0), arc)


def test_who_cannot_wait_circles_where_it_is_to_stand() -> None:
    still = np.zeros((30, 2))
    dynamics = Unicycle(1.0, 2.0, 0.5)
    position = pursued(dynamics, still, 1.0)
    speed = np.linalg.norm(np.diff(position, axis=0), axis=1)
    assert speed.min() >= 1 - 1e-9
    assert speed.max() <= 2 + 1e-9
    away = np.linspace((0, 0), (12, 0), 30)
    position = pursued(dynamics, away, 1.0)
    assert turned(position).max() <= 0.5 + 1e-9
    assert np.linalg.norm(position - away, axis=1).max() < 8


def test_who_turns_back_stands_and_turns_first() -> None:
    there_and_back = np.concatenate([np.linspace((0, 0), (10, 0), 11), np.linspace((9, 0), (0, 0), 20)])
    position = pursued(Unicycle(0.0, 2.0, math.radians(30)), there_and_back, 1.0)
    speed = np.linalg.norm(np.diff(position, axis=0), axis=1)
    assert (speed[10:13] == 0).all()
    assert np.linalg.norm(position[-1]) < 1e-9


def test_a_reversal_costs_and_standing_in_between_is_a_way_out() -> None:
    mission, _ = checked(TURNS_ROUND)
    costs = Costs(mission, splines(mission), Weights(), Spare())
    bounded = costs.turns

    def worst(along: np.ndarray) -> float:
        control = np.zeros((2, mission.steps + 3, 2))
        control[:, : len(along), 0] = along
        control[:, len(along) :, 0] = along[-1]
        group = next(each for each in costs.limits() if each.name == "turn")
        return float(rows(group, control).value.max(initial=0.0))

    assert len(bounded.most) > 0
    assert worst(np.array([0, 1, 2, 1, 0.0])) == pytest.approx(math.pi - math.radians(30) * 0.98)
    assert worst(np.array([0, 1, 2, 2, 2, 2, 2, 2, 1, 0.0])) < 0.1


def test_the_trace_of_whoever_turns_slowly_obeys() -> None:
    mission, kernel = checked(TURNS_ROUND)
    made = splines(mission)
    generator = np.random.default_rng(0)
    position = followed(mission, np.cumsum(generator.normal(size=(2, mission.steps + 1, 2)), axis=1) + 12)
    position[:, 0] = [(10, 4), (10, 8)]
    come_to = attempt(mission, kernel, trace(mission, made, made.through(position)))
    assert not [fault for fault in come_to.faults if "speed" in fault.what or "turn" in fault.what]


def test_more_is_asked_to_spare_where_a_step_is_long() -> None:
    mission, _ = checked(TURNS_ROUND)
    assert spare(mission).bodies == pytest.approx(0.06)
    slow, _ = checked(TURNS_ROUND.replace("0..3 m/s", "0..1 m/s"))
    assert spare(slow) == Spare()
