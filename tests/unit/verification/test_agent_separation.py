"""Separation of agents, on motions worked out by hand in steps of half a second."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from missionc import ir
from missionc.base.units import Metres
from missionc.geometry.curves.piecewise_polynomials import Curves, motion
from missionc.verification.certificate import CERTAIN, Check
from missionc.verification.plan.clearances import check_separation, near_pairs, pair_margins, relative_margins
from tests.support.legal_plans import mission_of, straight


def team(*starts: list[float], steps: int = 2) -> ir.Mission:
    """Bodies of 0.125 m each that keep half a metre: three quarters from centre to centre."""
    return mission_of(list(starts), steps, step=0.5, radius=0.125, separation=0.5)


# One stays, one passes it, a metre aside, in the middle of the second step; one is far away.
PATHS = [[[5.0, 5.0]] * 3, [[1.0, 6.0], [4.0, 6.0], [6.0, 6.0]], [[1.0, 1.0]] * 3]
PASSING = team(*[path[0] for path in PATHS])
CURVES = motion(PASSING, straight(PATHS, 0.5))


def test_straight_ways_are_nearest_where_one_passes_the_other() -> None:
    detail = "every pair of bodies has a separation of 0.5 m in continuous time"
    assert check_separation(PASSING, CURVES) == [
        Check("separation", "all pairs", 0.25, "m", 1e-9, True, 0.75, ("drone[0]", "drone[1]"), detail)
    ]
    (near,) = check_separation(replace(PASSING, separation=Metres(1.0)), CURVES)
    assert (near.margin, near.passed, near.at) == (-0.25, False, 0.75)
    (allowed,) = check_separation(replace(PASSING, separation=Metres(1.0)), CURVES, 0.25)
    assert (allowed.tolerance, allowed.passed) == (0.25, True)


def test_there_is_nothing_to_check_of_one_agent() -> None:
    assert check_separation(team([1.0, 1.0]), motion(team([1.0, 1.0]), straight([[[1.0, 1.0]] * 3], 0.5))) == []


def test_curved_ways_are_judged_with_a_proof_that_may_be_short_of_them() -> None:
    """(t, 1 + (t - 1)²) is nearest to (1, 0) after a second."""
    first = [[[0.0, 1.0, 0.0], [2.0, -2.0, 1.0]]]
    still = [[[1.0, 0.0, 0.0], [0.0, 0.0, 0.0]]]
    curves = Curves(np.array([0.0, 2.0]), np.array([still, first]))
    (found,) = check_separation(team([1.0, 0.0], [0.0, 2.0]), curves)
    assert 0.25 - 2e-3 <= found.margin <= 0.25
    assert found.at == pytest.approx(1.0, abs=0.05)
    assert (found.tolerance, found.passed) == (1e-9 + CERTAIN, True)
    touching = replace(team([1.0, 0.0], [0.0, 2.0]), separation=Metres(0.75))
    (at_most,) = check_separation(touching, curves)
    assert (at_most.passed, at_most.margin >= -CERTAIN) == (True, True)
    (refused,) = check_separation(replace(touching, separation=Metres(0.75 + 1e-6)), curves)
    assert not refused.passed


def test_pairs_that_may_come_near_are_named_piece_by_piece() -> None:
    far = near_pairs(PASSING, CURVES, spare=0.0)
    # In the first step all are further apart than both can go; in the second two come near.
    assert [(piece, first.tolist(), second.tolist()) for piece, first, second in far] == [
        (0, [0], [1]),
        (1, [0], [1]),
    ]
    every = [
        (piece, first.tolist(), second.tolist()) for piece, first, second in near_pairs(PASSING, CURVES, spare=9.0)
    ]
    assert every == [(piece, [0, 0, 1], [1, 2, 2]) for piece in (0, 1)]
    nearest = list(near_pairs(PASSING, CURVES, spare=None))
    assert [piece for piece, *_ in nearest] == [0, 1]
    assert all((0, 1) in zip(first.tolist(), second.tolist(), strict=True) for _, first, second in nearest)


def test_the_nearest_pair_is_found_on_both_sides_of_the_origin() -> None:
    rests = [[[-4.0, 0.0]] * 2, [[4.0, 0.0]] * 2]
    mission = team(*[path[0] for path in rests], steps=1)
    ((_, first, second),) = near_pairs(mission, motion(mission, straight(rests, 0.5)), spare=None)
    assert (first.tolist(), second.tolist()) == ([0], [1])


def test_who_rests_is_near_whom_it_is_within_what_they_need() -> None:
    rests = [[[5.0, 5.0]] * 2, [[5.75, 5.0]] * 2, [[8.0, 5.0]] * 2]
    mission = team(*[path[0] for path in rests], steps=1)
    curves = motion(mission, straight(rests, 0.5))

    def near(spare: float) -> list[tuple[int, int]]:
        return [
            pair
            for _, first, second in near_pairs(mission, curves, spare)
            for pair in zip(first.tolist(), second.tolist(), strict=True)
        ]

    assert near(0.0) == [(0, 1)]
    assert near(-1e-6) == []
    assert near(1.499) == [(0, 1)]
    assert near(1.5) == [(0, 1), (1, 2)]
    assert near(2.25) == [(0, 1), (0, 2), (1, 2)]


def test_margins_of_pairs_are_those_of_one_piece() -> None:
    first, second = np.array([0, 0]), np.array([1, 2])
    low, high, when = pair_margins(PASSING, CURVES, 0, first, second, None)
    assert low.tolist() == high.tolist() == [math.sqrt(2) - 0.75, math.hypot(4, 4) - 0.75]
    assert when.tolist() == [0.5, 0.0]
    low, _, when = pair_margins(PASSING, CURVES, 1, first[:1], second[:1], None)
    assert (low.tolist(), when.tolist()) == ([0.25], [0.25])


def test_relative_motions_are_bounded_in_each_of_their_pieces() -> None:
    relative = Curves(
        np.array([0.0, 1.0, 3.0]),
        np.array(
            [
                [[[-1.0, 2.0], [1.0, 0.0]], [[1.0, 0.0], [1.0, 1.0]]],
                [[[3.0, 0.0], [4.0, 0.0]], [[3.0, 0.0], [4.0, -4.0]]],
            ]
        ),
    )
    low, high, when = relative_margins(relative, np.array([1.0, 2.0]), None)
    assert low.tolist() == high.tolist() == [0.0, math.sqrt(2) - 1, 3.0, 1.0]
    assert when.tolist() == [0.5, 0.0, 0.0, 1.0]


def test_what_is_above_the_ceiling_is_not_looked_at_closely() -> None:
    """Two curved ways, at 1 m and at 9 m: of the second nothing more is wanted than that it is beyond 2 m."""
    bent = [[[0.0, 1.0, 0.0], [1.0, -2.0, 1.0]]]
    away = [[[0.0, 1.0, 0.0], [10.0, -2.0, 1.0]]]
    relative = Curves(np.array([0.0, 2.0]), np.array([bent, away]))
    still = np.zeros((1, 1, 2, 3))
    curves = Curves(relative.times, np.concatenate([still, relative.coefficients]))
    team_of_three = team([0.0, 0.0], [0.0, 1.0], [0.0, 9.0])
    both = np.array([0, 0]), np.array([1, 2])
    bounds = [pair_margins(team_of_three, curves, 0, *both, ceiling)[0] for ceiling in (99.0, 2.0)]
    assert bounds[0][0] == bounds[1][0]
    assert bounds[1][1] < bounds[0][1]
    fine, _, _ = relative_margins(relative, np.zeros(2), 99.0)
    coarse, _, _ = relative_margins(relative, np.zeros(2), 2.0)
    assert fine[0] == coarse[0]
    assert 2.0 <= coarse[1] < fine[1]
