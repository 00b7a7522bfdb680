"""Interval bounds of margins, on lines whose lengths are known: 3, 4 and 5, with and without what points may be off."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import pytest

from missionc.geometry.curves.bernstein_intervals import Enclosed
from missionc.verification.proof.branch_and_bound import Bounds, Judge
from missionc.verification.proof.proof_boxes import (
    at_least_in_box,
    at_most,
    between_bounds,
    far_from_origin,
    in_band,
    upright,
)


def curves(*points: Sequence[Sequence[float]], radius: float = 0.0) -> Enclosed:
    """Curves, each by its control points."""
    made = np.array(points, dtype=np.float64).swapaxes(1, 2)
    return Enclosed(made, np.full(made.shape[:2], radius))


def asked(judge: Judge, item: Sequence[int], curve: Enclosed) -> Bounds:
    return judge(np.array(item), curve)


def close(found: Bounds, *expected: Sequence[float]) -> None:
    for own, wanted in zip(found, expected, strict=True):
        assert own == pytest.approx(np.array(wanted), abs=1e-9)


FAR = [(30.0, 0.0), (30.0, 40.0)]
NEAR = [(4.0, 0.0), (3.0, 3.0)]
"""Squared it has the control points 16, 12 and 18."""


def test_a_length_is_kept_by_the_box_around_a_curve_or_by_its_square() -> None:
    need = np.array([1.0, 2.0, 0.5])
    found = asked(at_least_in_box(need), [2, 1, 0], curves(FAR, NEAR, NEAR[::-1]))
    close(found, [29.5, math.sqrt(12) - 2.0, math.sqrt(12) - 1.0], [29.5, 2.0, 3.0], [0.0, 0.0, 1.0])


def test_a_need_may_be_the_same_in_all_pieces_of_a_subject() -> None:
    found = asked(at_least_in_box(np.array([1.0, 2.0]), 3), [2, 3], curves(FAR, FAR))
    close(found, [29.0, 28.0], [29.0, 28.0], [0.0, 0.0])


def test_a_box_is_better_where_a_curve_is_long() -> None:
    """(3, -9) to (3, 9): squared 90, -72 and 90, but 3 m aside."""
    found = asked(at_least_in_box(np.array([1.5])), [0], curves([(3.0, -9.0), (3.0, 9.0)]))
    close(found, [1.5], [math.sqrt(90) - 1.5], [0.0])


def test_of_who_is_far_by_its_box_the_square_is_not_looked_at() -> None:
    """Which would say of (40, 10) to (10, 40), more than 10 m off each way, that it is 28.3 m off."""
    found = asked(at_least_in_box(np.array([1.0, 13.0])), [0, 1], curves(*[[(40.0, 10.0), (10.0, 40.0)]] * 2))
    close(found, [math.sqrt(200) - 1.0, math.sqrt(800) - 13.0], [math.sqrt(1700) - 1, math.sqrt(1700) - 13], [0.0, 0.0])


def test_what_points_may_be_off_is_taken_off_a_length_and_added_to_what_is_seen() -> None:
    found = asked(at_least_in_box(np.array([1.0])), [0], curves(NEAR, radius=0.125))
    squares = 12 - (2 * 4 + 0.125) * 0.125 - (2 * 3 + 0.125) * 0.125
    close(found, [math.sqrt(squares) - 1.0], [math.hypot(4.125, 0.125) - 1.0], [0.0])
    found = asked(at_least_in_box(np.array([1.0])), [0], curves(FAR, radius=0.125))
    close(found, [29.875 - 1.0], [math.hypot(30.125, 0.125) - 1.0], [0.0])
    # Of a line through the origin nothing is less than nothing.
    found = asked(at_least_in_box(np.array([1.0])), [0], curves([(0.0, -9.0), (0.0, 9.0)]))
    close(found, [-1.0], [8.0], [0.0])


@pytest.mark.parametrize(
    ("low", "high", "length"),
    [
        ((3.0, 4.0), (9.0, 9.0), 5.0),
        ((-9.0, -9.0), (-3.0, -4.0), 5.0),
        ((-9.0, 4.0), (-3.0, 9.0), 5.0),
        ((-1.0, 4.0), (1.0, 9.0), 4.0),
        ((-1.0, -9.0), (1.0, -4.0), 4.0),
        ((-1.0, -1.0), (1.0, 1.0), 0.0),
    ],
)
def test_a_box_is_as_far_as_its_nearest_corner_or_side(
    low: tuple[float, ...], high: tuple[float, ...], length: float
) -> None:
    corners = [np.array([each, each]) for each in (low, high)]
    assert far_from_origin(corners[0], corners[1], np.array([1.0, 2.0])) == pytest.approx(
        [length - 1.0, length - 2.0], abs=1e-9
    )


def test_a_length_is_limited_by_the_largest_point_of_its_square() -> None:
    limit = np.array([9.0, 6.0])
    found = asked(at_most(limit), [1, 0], curves(NEAR, NEAR[::-1]))
    close(found, [6 - math.sqrt(18), 9 - math.sqrt(18)], [6 - math.sqrt(18), 9 - math.sqrt(18)], [1.0, 0.0])
    # (5, 0), (0, 5) and (5, 0): squared 25, 0, and its middle 25 / 3 + 50 / 3.
    found = asked(at_most(limit), [0], curves([(5.0, 0.0), (0.0, 5.0), (5.0, 0.0)]))
    close(found, [4.0], [4.0], [0.0])
    found = asked(at_most(limit), [0], curves(NEAR, radius=0.125))
    off = (2 * 4 + 0.125) * 0.125 + (2 * 3 + 0.125) * 0.125
    close(found, [9 - math.sqrt(18 + off)], [9 - math.sqrt(18 - off)], [1.0])


def test_every_coordinate_is_between_its_bounds() -> None:
    low, high = np.array([[0.0, 0.0], [9.0, 9.0], [1.0, -9.0]]), np.array([[9.0, 9.0], [9.0, 9.0], [9.0, 4.0]])
    found = asked(between_bounds(low, high), [0, 2], curves(NEAR, NEAR))
    close(found, [0.0, 1.0], [0.0, 1.0], [0.0, 1.0])
    found = asked(between_bounds(low, high), [2], curves([(4.0, 0.0), (0.5, 3.5), (3.0, 3.0)], radius=0.125))
    close(found, [0.5 - 1.0 - 0.125], [1.0], [1.0])
    found = asked(between_bounds(low, high), [2], curves([(3.0, 0.0), (3.0, 3.75), (8.5, 3.0)], radius=0.125))
    close(found, [0.25 - 0.125], [0.5], [1.0])


def test_a_length_is_in_its_band_by_the_nearer_end() -> None:
    line = curves([(4.0, 0.0), (6.0, 0.0)])
    low, high = np.array([3.0, 1.0, -np.inf]), np.array([9.0, 7.5, 8.0])
    close(asked(in_band(low, high), [0], line), [1.0], [1.0], [0.0])
    close(asked(in_band(low, high), [1], line), [1.5], [1.5], [1.0])
    close(asked(in_band(low, high), [2], line), [2.0], [2.0], [1.0])


def test_a_lean_is_that_of_the_farthest_aside_and_the_lowest() -> None:
    limit = np.array([9.0, 1.0])
    line = curves([(3.0, 4.0, 5.0), (0.0, 0.0, 2.0)])
    close(asked(upright(limit), [1], line), [1.0 - math.atan2(5.0, 2.0)], [1.0 - math.atan2(5.0, 5.0)], [0.0])
    line = curves([(0.0, 0.0, 2.0), (0.0, 3.0, 2.0)])
    close(asked(upright(limit), [0], line), [9.0 - math.atan2(3.0, 2.0)], [9.0 - math.atan2(3.0, 2.0)], [1.0])
    line = curves([(0.0, 0.0, 0.5), (0.0, 0.5, 0.5)])
    close(asked(upright(limit), [0], line), [9.0 - math.pi / 4], [9.0 - math.pi / 4], [1.0])
    line = curves([(3.0, 4.0, 5.0), (3.0, 4.0, 5.0)], radius=0.125)
    off = (2 * 3 + 0.125) * 0.125 + (2 * 4 + 0.125) * 0.125
    aside = math.sqrt(25 + off)
    close(asked(upright(limit), [1], line), [1.0 - math.atan2(aside, 4.875)], [1.0 - math.pi / 4], [0.0])


@pytest.mark.parametrize(
    ("points", "lean", "seen"),
    [
        ([(1.0, 0.0, 0.0), (1.0, 0.0, 1.0)], math.pi, math.pi),
        ([(1.0, 0.0, 1.0), (1.0, 0.0, -1.0)], math.pi, math.pi),
        ([(0.0, 0.0, -1.0), (0.0, 0.0, -2.0)], math.pi, math.pi),
        ([(1.0, 0.0, 1.0), (1.0, 0.0, -0.5), (1.0, 0.0, 1.0)], math.pi, math.pi / 4),
    ],
)
def test_what_does_not_point_up_leans_by_half_a_turn(points: list[tuple[float, ...]], lean: float, seen: float) -> None:
    lower, margin, _ = asked(upright(np.array([4.0])), [0], curves(points))
    assert lower == pytest.approx([4.0 - lean], abs=1e-9)
    assert margin == pytest.approx([4.0 - seen], abs=1e-9)
