"""Clearance of obstacles that move: the motion as they see it, and how near it comes to them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from missionc import ir
from missionc.base.units import Metres
from missionc.geometry.curves.piecewise_polynomials import Curves
from missionc.ir import Box
from missionc.verification.certificate import CERTAIN, CONTACT
from missionc.verification.plan.clearances import check_obstacles, relative_to
from tests.support.legal_plans import mission_of, moving, still

TIMES, OFFSETS = (1.0, 2.5, 3.0, 6.0), ((0.0, 0.0), (3.0, 0.0), (3.0, 4.0), (-1.0, 4.0))
TRUCK = moving(ir.Disc((5.0, 5.0), 0.5), TIMES, OFFSETS)
CURVES = Curves(np.array([0.0, 2.0, 4.0]), np.array([[[[1.0, 0.5], [2.0, 0.25]], [[2.0, -0.5], [2.5, 0.0]]]]))
"""One agent, straight on in two pieces of 2 s."""


def place(curves: Curves, time: float) -> list[float]:
    piece = int(np.clip(np.searchsorted(curves.times, time, side="right") - 1, 0, len(curves.times) - 2))
    powers = (time - curves.times[piece]) ** np.arange(curves.coefficients.shape[-1])
    return [float(value) for value in curves.coefficients[0, piece] @ powers]


@pytest.mark.parametrize("time", [0.0, 0.5, 1.0, 1.7, 2.0, 2.2, 2.5, 2.9, 3.0, 3.6, 4.0])
def test_an_obstacle_sees_the_motion_from_where_it_is_at_each_time(time: float) -> None:
    offset = [np.interp(time, TIMES, axis) for axis in zip(*OFFSETS, strict=True)]
    assert place(relative_to(CURVES, TRUCK), time) == pytest.approx(np.subtract(place(CURVES, time), offset))


def test_the_margin_of_what_moves_is_the_least_of_all_times() -> None:
    mission = mission_of([(1.0, 2.0)], 4, obstacles=[TRUCK])
    (check,) = check_obstacles(mission, CURVES)
    moments = np.linspace(0.0, 4.0, 4001).tolist()
    away = [
        np.hypot(
            *(
                np.subtract(
                    place(CURVES, time), [np.interp(time, TIMES, axis) + 5 for axis in zip(*OFFSETS, strict=True)]
                )
            )
        )
        for time in moments
    ]
    assert check.margin == pytest.approx(min(away) - 0.5 - 0.1, abs=1e-3)
    assert check.at == pytest.approx(moments[int(np.argmin(away))], abs=2e-2)
    assert check.agents == ("drone[0]",)


def test_a_check_says_how_near_whoever_comes_nearest_and_when() -> None:
    """Past a wall at y = 3, a body of 0.1 m that is to keep a quarter of a metre: nearest in the second piece."""
    wall = still(Box((0.0, 3.0), (9.0, 4.0)))
    mission = mission_of([(1.0, 2.0), (1.0, 1.0)], 2, step=0.5, clearance=0.25, obstacles=[wall])
    rows = [[[[1.0, 2.0], [2.0, 0.0]], [[2.0, 2.0], [2.0, 0.5]]], [[[1.0, 0.0], [1.0, 0.0]]] * 2]
    curves = Curves(np.array([0.0, 0.5, 1.0]), np.array(rows))
    (found,) = check_obstacles(mission, curves)
    assert (found.name, found.subject, found.unit, found.agents) == ("obstacle", "wall", "m", ("drone[0]",))
    assert found.detail == "every body has a clearance of 0.25 m in continuous time"
    # Three quarters of a metre from the wall at the end.
    assert found.margin == pytest.approx(0.4, abs=1e-3)
    assert found.margin <= 0.4
    assert found.at == pytest.approx(1.0, abs=2e-2)
    assert (found.passed, found.tolerance) == (True, CONTACT + CERTAIN)
    (near,) = check_obstacles(replace(mission, clearance=Metres(0.75)), curves)
    assert not near.passed
    assert near.margin == pytest.approx(-0.1, abs=1e-3)
    (allowed,) = check_obstacles(replace(mission, clearance=Metres(0.75)), curves, 0.25)
    assert (allowed.passed, allowed.tolerance) == (True, 0.25 + CERTAIN)
