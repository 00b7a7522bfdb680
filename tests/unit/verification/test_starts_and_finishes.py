"""Checks of starts, finishes and the world, each as a whole, on motions made by hand in steps of half a second."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from missionc import ir
from missionc.geometry.curves.piecewise_polynomials import Curves
from missionc.verification.certificate import Check
from missionc.verification.plan.starts_and_finishes import check_places, check_world
from tests.support.legal_plans import SPAN, mission_of, straight

PATHS = [[[1.0, 1.0], [2.0, 1.0], [3.0, 1.0]], [[1.0, 3.0], [2.0, 3.0], [3.0, 3.0]]]
MISSION = mission_of([path[0] for path in PATHS], 2, step=0.5)
BASE = ir.Region("base", ir.Box((0.0, 0.0), (2.5, 2.0)), SPAN)


def check(name: str, agent: int, margin: float, tolerance: float, passed: bool, at: float, detail: str) -> Check:
    who = f"drone[{agent}]"
    return Check(name, who, margin, "m", tolerance, passed, at, (who,), detail)


def test_a_start_and_a_finish_are_at_a_point_or_in_a_region() -> None:
    first, second = MISSION.agents
    agents = (
        replace(first, start=ir.InitialSet(SPAN, region=BASE), finish=ir.InitialSet(SPAN, region=BASE)),
        replace(second, finish=ir.InitialSet(SPAN, (3.0, 3.5))),
    )
    assert check_places(replace(MISSION, agents=agents), straight(PATHS, 0.5)) == [
        check("start", 0, 1.0, 1e-9, True, 0.0, "in `base`"),
        check("finish", 0, -0.5, 1e-9, False, 1.0, "in `base`"),
        check("start", 1, 0.0, 1e-6, True, 0.0, "at (1, 3)"),
        check("finish", 1, -0.5, 1e-6, False, 1.0, "at (3, 3.5)"),
    ]


def test_nobody_has_to_finish_anywhere_who_has_no_finish() -> None:
    found = check_places(MISSION, straight(PATHS, 0.5))
    assert [(each.name, each.subject) for each in found] == [("start", "drone[0]"), ("start", "drone[1]")]


def curves(*agents: list[list[list[float]]]) -> Curves:
    """Two pieces, of 1 s and of 2 s: coordinates as ascending powers of the seconds since the piece began."""
    return Curves(np.array([0.0, 1.0, 3.0]), np.array(agents, dtype=np.float64))


RESTS = [[[5.0, 0.0], [5.0, 0.0]]] * 2


def world(motion: Curves, **tolerance: float) -> Check:
    found = check_world(MISSION, motion, **tolerance)
    assert (found.name, found.subject, found.unit) == ("world", "world", "m")
    assert found.detail == "every centre is inside the world in continuous time"
    return found


@pytest.mark.parametrize(
    ("piece", "margin"),
    [
        # At an end of a piece, at its beginning, and on the other side, of 10 m.
        ([[4.0, -2.25], [5.0, 0.0]], -0.5),
        ([[-0.5, 2.0], [5.0, 0.0]], -0.5),
        ([[5.0, 0.0], [8.0, 1.5]], -1.0),
        ([[5.0, 0.0], [9.75, 0.0]], 0.25),
    ],
)
def test_straight_motion_is_nearest_to_a_border_at_an_end(piece: list[list[float]], margin: float) -> None:
    found = world(curves(RESTS, [RESTS[0], piece]))
    assert (found.margin, found.passed, found.at, found.agents) == (margin, margin > 0, 1.0, ("drone[1]",))
    assert found.tolerance == 1e-9
    assert world(curves([piece, RESTS[1]], RESTS)).at == 0.0


def test_a_parabola_is_nearest_where_it_turns_if_it_turns_within_its_piece() -> None:
    """2 - 4 t + 2 t² + c turns after 1 s; 6 + 4 t + t² has turned before it begins, and -t² would turn later."""
    rests = [[5.0, 0.0, 0.0], [5.0, 0.0, 0.0]]
    turns = [[2.5, -4.0, 2.0], [5.0, 0.0, 0.0]]
    assert world(curves([rests, rests], [rests, turns])).margin == 0.5
    grown = [[5.0, 0.0, 0.0], [1.0, 4.0, 1.0]]
    assert world(curves([rests, rests], [rests, grown])).margin == -3.0
    later = [[5.0, 0.0, 0.0], [3.0, 2.0, -0.25]]
    assert world(curves([rests, rests], [rests, later])).margin == 3.0
    # In a piece of one second it gets no further than half of the way.
    assert world(curves([turns, rests], [rests, rests])).margin == 0.5


def test_a_polynomial_is_inside_where_its_control_points_are() -> None:
    """Those of t³ over 2 s are 0, 0, 0 and 8, as far as it gets itself; others reach further."""
    rests = [[5.0, 0.0, 0.0, 0.0], [5.0, 0.0, 0.0, 0.0]]
    up = [[1.5, 0.0, 0.0, 1.0], [5.0, 0.0, 0.0, 0.0]]
    found = world(curves([rests, rests], [rests, up]))
    assert found.margin == pytest.approx(0.5)
    assert (found.at, found.agents) == (1.0, ("drone[1]",))
    # 9 + 3 t (1 - t / 2) is 10.5 at its top; its inner control points of degree 3 over 2 s are 9 + 2.
    arch = [[5.0, 0.0, 0.0, 0.0], [9.0, 3.0, -1.5, 0.0]]
    first = world(curves([rests, arch], [rests, rests]))
    assert first.margin == pytest.approx(-1.0)
    assert (first.at, first.agents) == (1.0, ("drone[0]",))


def test_the_world_may_be_left_by_the_tolerance() -> None:
    out = curves([RESTS[0], [[-0.1, 0.0], [5.0, 0.0]]], RESTS)
    assert not world(out).passed
    assert not world(out, tolerance=0.099).passed
    assert world(out, tolerance=0.101).passed
