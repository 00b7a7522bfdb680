"""Bounds of distances to bodies: exact along straight walls and round corners, however long the part is."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import product

import numpy as np
import pytest

from missionc.base.trace import Array, Indices
from missionc.geometry.curves.bernstein_intervals import Enclosed
from missionc.ir import Ball, Box, Difference, Disc, Intersection, Polygon, Prism, Shape, Union
from missionc.verification.flight.joint_claims import box_clear_of, clear_of, clear_of_growing
from missionc.verification.proof.branch_and_bound import Bounds

ALLOWANCE = 2.0**-40
HUGE = 2.0**40
"""A number of a shape of which the allowance is one metre."""

ALONG, OUT = np.array([0.8, 0.6]), np.array([0.6, -0.8])
TILTED = Polygon(((3.0, 3.0), (7.0, 6.0), (5.5, 8.0), (1.5, 5.0)))
"""5 m by 2.5 m: sides along ``ALONG`` and ``OUT``."""

SIDES = [((5.0, 4.5), OUT), ((6.25, 7.0), ALONG), ((3.5, 6.5), -OUT), ((2.25, 4.0), -ALONG)]
"""The middle of each side of it, and what is outward there."""

CORNERS = [((3.0, 3.0), OUT - ALONG), ((7.0, 6.0), OUT + ALONG), ((5.5, 8.0), ALONG - OUT), ((1.5, 5.0), -OUT - ALONG)]

AT_ONCE = Polygon((*TILTED.corners[:2], TILTED.corners[1], *TILTED.corners[2:], TILTED.corners[0]))
"""With two corners twice."""


def bounds(shape: Shape, *points: Sequence[float] | Array, need: float = 0.0, radius: float = 0.0) -> tuple[float, ...]:
    """The bound, what was seen, and where, of one curve with these control points."""
    control = np.array(points).T[None]
    needs = np.array([9.0, need])
    curve = Enclosed(control, np.full(control.shape[:2], radius))
    lower, seen, share = clear_of(shape, control.shape[1], needs)(np.array([1]), curve)
    return float(lower[0]), float(seen[0]), float(share[0])


def past(point: Sequence[float] | Array, along: Array, by: float = 4.0) -> tuple[Array, Array]:
    """A straight line with this point in its middle."""
    return np.array(point) - by * along, np.array(point) + by * along


def test_along_a_wall_the_bound_is_the_distance(subtests: pytest.Subtests) -> None:
    for (size, shape), (middle, out), moved in product(
        [(1.0, TILTED), (1.0, AT_ONCE), (0.125, TILTED)], SIDES, [-0.9, 0.0, 0.9]
    ):
        with subtests.test(size=size, shape=shape, middle=middle, out=out, moved=moved):
            wall = np.array([-out[1], out[0]])
            sized = Polygon(tuple((size * x, size * y) for x, y in shape.corners))
            place = size * (np.array(middle) + moved * wall) + 0.5 * out
            lower, seen, share = bounds(sized, *past(place, wall), need=0.2)
            assert (lower, seen, share) == pytest.approx((0.3, 0.3, 0.5), abs=1e-9)


def test_parts_are_looked_at_each_by_itself() -> None:
    """Outside each side, at another distance, and inside."""
    lines, expected = [], []
    for number, (middle, out) in enumerate(SIDES):
        wall = np.array([-out[1], out[0]])
        lines.append(past(np.array(middle) + (number + 1.0) * out, wall))
        expected.append(number + 1.0)
        lines.append(past(np.array(middle) - 0.25 * out, wall, 8.0))
        expected.append(-8.25)
    curve = Enclosed(np.array(lines).swapaxes(1, 2), np.zeros((len(lines), 2)))
    item = np.arange(len(lines))[::-1]
    needs = np.arange(10.0)
    lower, seen, share = clear_of(TILTED, 2, needs)(item, curve)
    assert lower == pytest.approx(np.array(expected) - needs[item], abs=1e-9)
    there = np.where(np.array(expected) < 0, -0.25, expected)
    assert seen == pytest.approx(there - needs[item], abs=1e-9)
    assert share.tolist() == [0.5] * len(lines)


@pytest.mark.parametrize("shape", [TILTED, AT_ONCE, Polygon(((0.0, 0.0), (4.0, 0.0), (4.0, 3.0), (0.0, 3.0)))])
def test_no_number_on_the_way_is_none(shape: Shape) -> None:
    with np.errstate(all="raise"):
        for point in ((2.0, 1.0), (2.0, 3.0), (9.0, 3.0), (3.0, 3.0)):
            assert np.isfinite(bounds(shape, point, (9.0, 9.0))).all()


@pytest.mark.parametrize("shape", [TILTED, AT_ONCE])
@pytest.mark.parametrize(("corner", "out"), CORNERS)
def test_past_a_corner_too(shape: Shape, corner: tuple[float, float], out: Array) -> None:
    aside = out / np.linalg.norm(out)
    lower, _, _ = bounds(shape, *past(np.array(corner) + 0.5 * aside, np.array([-aside[1], aside[0]])))
    assert lower == pytest.approx(0.5, abs=1e-9)


@pytest.mark.parametrize(("middle", "out"), SIDES)
@pytest.mark.parametrize("moved", [-0.2, 0.2])
def test_inside_a_body_no_plane_is_laid(middle: tuple[float, float], out: Array, moved: float) -> None:
    """It would say that what is far along the wall is no deeper than the body is wide."""
    wall = np.array([-out[1], out[0]])
    place = np.array(middle) - 0.4 * out + moved * wall
    assert bounds(TILTED, *past(place, wall, 8.0))[0] == pytest.approx(-0.4 - 8.0, abs=1e-9)


NOTCHED = Polygon(((0.0, 0.0), (8.0, 0.0), (8.0, 6.0), (5.0, 6.0), (4.0, 2.0), (3.0, 6.0), (0.0, 6.0)))


@pytest.mark.parametrize("point", [(1.0, 1.0), (1.0, 5.0), (7.0, 5.0), (7.0, 1.0), (4.0, 1.0), (4.2, 1.9)])
def test_inside_is_where_a_polygon_that_turns_in_has_it(point: tuple[float, float]) -> None:
    lower, seen, _ = bounds(NOTCHED, *past(point, np.array([0.0, 1.0]), 20.0))
    assert seen < 0
    assert lower == pytest.approx(seen - 20.0, abs=1e-9)


def test_in_a_notch_no_plane_is_better_than_the_distance() -> None:
    assert bounds(NOTCHED, (4.0, 5.0), (4.0, 5.0))[:2] == pytest.approx([0.75 * 4 / math.sqrt(17)] * 2, abs=1e-9)


def test_around_a_point_the_bound_is_the_distance_less_what_it_is_away() -> None:
    """Control points (1, 0), (1, 4), (1, 0) have their middle at (1, 2); the ball is 2 m from there."""
    lower, seen, _ = bounds(Ball((4.0, 2.0), 1.0), (1.0, 0.0), (1.0, 4.0), (1.0, 0.0))
    assert seen == pytest.approx(2.0, abs=1e-9)
    assert lower == pytest.approx(2.0, abs=1e-9)  # by a plane, along which the curve is
    lower, _, _ = bounds(Ball((4.0, 2.0), 1.0), (1.0, 2.0), (4.0, 2.0), (1.0, 2.0))
    assert lower == pytest.approx(0.5 - 1.5, abs=1e-9)  # from its middle at (2.5, 2)


# ------------------------------------------------------------------------------ boxes


def far(shape: Shape, low: Sequence[float], high: Sequence[float], need: float = 0.0) -> float:
    dimension = len(low)
    made = box_clear_of(shape, dimension)(
        np.array([[90.0] * dimension, low]), np.array([[91.0] * dimension, high]), np.array([0.0, need])
    )
    return float(made[1])


VOLUME = Box((1.0, 2.0, 0.0), (3.0, 4.0, 2.0))
PILLAR = Disc((5.0, 5.0), 0.5, Prism(0.5, 2.0))
ROOM = Polygon(((1.0, 1.0), (4.0, 1.0), (1.0, 5.0)), Prism(1.0, 3.0))


@pytest.mark.parametrize(
    ("shape", "low", "high", "distance"),
    [
        (Box((1.0, 2.2), (9.0, 3.0)), (2.0, 0.0), (8.0, 2.0), 0.2),
        (Box((1.0, 2.2), (9.0, 3.0)), (-3.0, -4.0), (0.5, 9.2), 0.5),
        (Box((1.0, 2.2), (9.0, 3.0)), (2.0, 3.5), (8.0, 9.0), 0.5),
        (Box((1.0, 2.2), (9.0, 3.0)), (9.5, -4.0), (9.75, 9.2), 0.5),
        (Disc((5.0, 5.0), 0.7), (2.0, 1.0), (8.0, 2.0), 2.3),
        (Disc((5.0, 4.0), 0.7), (1.0, 0.0), (3.0, 8.0), 1.3),
        (Disc((5.0, 4.0), 0.0), (1.0, 0.0), (3.0, 8.0), 2.0),
        (Ball((5.0, 4.0, 1.0), 0.5), (1.0, 0.0, -3.0), (3.0, 8.0, 5.0), 1.5),
        (Ball((5.0, 4.0, 1.0), 0.5), (0.0, -1.0, -9.0), (10.0, 9.0, -2.0), 2.5),
        # Sideways, above, below, and past the rims, by 3 and 4 parts of 5.
        (VOLUME, (-2.0, 0.0, -4.0), (0.0, 6.0, 6.0), 1.0),
        (VOLUME, (-2.0, -1.0, 2.5), (6.0, 7.0, 3.0), 0.5),
        (VOLUME, (-2.0, -1.0, -3.0), (6.0, 7.0, -0.5), 0.5),
        (VOLUME, (1.0, 8.0, 5.0), (3.0, 8.0, 5.0), 5.0),
        (PILLAR, (-2.0, 0.0, -9.0), (4.0, 10.0, 11.5), 0.5),
        (PILLAR, (3.0, 3.0, 2.25), (7.0, 7.0, 3.0), 0.25),
        (PILLAR, (3.0, 3.0, -3.0), (7.0, 7.0, 0.25), 0.25),
        (PILLAR, (8.5, 5.0, 6.0), (8.5, 5.0, 6.0), 5.0),
        (PILLAR, (8.5, 1.0, -3.5), (8.5, 9.0, -3.5), 5.0),
        (ROOM, (0.0, -9.0, -9.0), (5.0, 0.25, 13.0), 0.75),
        (ROOM, (0.0, 0.0, 3.5), (5.0, 6.0, 4.0), 0.5),
        (ROOM, (0.0, 0.0, -9.0), (5.0, 6.0, 0.5), 0.5),
        (ROOM, (1.0, -3.0, 6.0), (4.0, -3.0, 6.0), 5.0),
        # What has no end in height has no plane above it.
        (Disc((5.0, 5.0), 0.5, Prism(-math.inf, math.inf)), (1.0, 0.0, -9.0), (3.0, 10.0, 9.0), 1.5),
        (Disc((5.0, 5.0), 0.5, Prism(-math.inf, 1.0)), (1.0, 0.0, 2.0), (9.0, 10.0, 9.0), 1.0),
        # Of two bodies the nearer one; of what both share the farther one; of what was cut out of one that one.
        (Union(Box((0.0, 5.0), (9.0, 6.0)), Box((0.0, 8.0), (9.0, 9.0))), (0.0, 0.0), (9.0, 4.0), 1.0),
        (Union(Box((0.0, 8.0), (9.0, 9.0)), Box((0.0, 5.0), (9.0, 6.0))), (0.0, 0.0), (9.0, 4.0), 1.0),
        (Intersection(Box((0.0, 5.0), (9.0, 9.0)), Box((0.0, 6.0), (9.0, 7.0))), (0.0, 0.0), (9.0, 4.0), 2.0),
        (Intersection(Box((0.0, 6.0), (9.0, 7.0)), Box((0.0, 5.0), (9.0, 9.0))), (0.0, 0.0), (9.0, 4.0), 2.0),
        (Difference(Box((0.0, 5.0), (9.0, 9.0)), Box((0.0, 3.0), (1.0, 7.0))), (0.0, 0.0), (9.0, 4.0), 1.0),
    ],
)
def test_of_a_box_the_bound_is_its_distance(
    shape: Shape, low: tuple[float, ...], high: tuple[float, ...], distance: float
) -> None:
    assert far(shape, low, high, 0.125) == pytest.approx(distance - 0.125, abs=1e-8)


# ------------------------------------------------------------------------------ rounding


@pytest.mark.parametrize(
    ("shape", "point", "distance"),
    [
        (Box((-HUGE, 0.0), (0.0, 1.0)), (1.0, 0.5), 1.0),
        (Box((0.0, 0.0), (HUGE, 1.0)), (-1.0, 0.5), 1.0),
        (Disc((-HUGE, 0.0), 2.0), (1.0 - HUGE, 0.0), -1.0),
        (Ball((HUGE, 0.0), 2.0), (1.0 + HUGE, 0.0), -1.0),
        (Ball((-HUGE, 0.0), HUGE), (1.0, 0.0), 1.0),
        (Disc((-HUGE, 0.0), HUGE), (1.0, 0.0), 1.0),
        (Disc((0.0, 0.0), 1.0, Prism(-HUGE, 1.0)), (2.0, 0.0, 0.0), 1.0),
        (Disc((0.0, 0.0), 1.0, Prism(-1.0, HUGE)), (2.0, 0.0, 0.0), 1.0),
        (Polygon(((0.0, 0.0), (1.0, 0.0), (1.0, HUGE), (0.0, HUGE))), (2.0, 0.5), 1.0),
        (Polygon(((0.0, 0.0), (1.0, 0.0), (1.0, 1.0)), Prism(-HUGE, 1.0)), (2.0, 0.5, 0.0), 1.0),
        (Union(Ball((0.0, 0.0), 1.0), Box((-HUGE, -9.0), (-HUGE / 2, -8.0))), (2.0, 0.0), 1.0),
        (Difference(Ball((0.0, 0.0), 1.0), Box((-HUGE, -9.0), (-HUGE / 2, -8.0))), (2.0, 0.0), 1.0),
    ],
)
def test_what_is_large_may_be_off_by_its_share(shape: Shape, point: tuple[float, ...], distance: float) -> None:
    """The size of the shape counts, and how far the point is from the origin."""
    err = 1.0 + ALLOWANCE * max(map(abs, point))
    lower, seen, _ = bounds(shape, point, point)
    assert (lower, seen) == pytest.approx((distance - err, distance + 2 * err), abs=1e-3)
    assert far(shape, point, point) == pytest.approx(distance - err, abs=1e-3)


def test_so_is_what_is_long() -> None:
    err = ALLOWANCE * (2 + 3 + HUGE)
    lower, seen, _ = bounds(Ball((0.0, 0.0), 1.0), (3.0 - HUGE, 0.0), (3.0 + HUGE, 0.0))
    assert seen == pytest.approx(2.0 + 2 * err, abs=1e-3)
    assert lower == pytest.approx(2.0 - HUGE - err, abs=1e-2)


def test_what_is_near_is_off_no_more_for_what_is_far() -> None:
    places = np.array([[3.0, 0.0], [HUGE, 0.0]])
    found = box_clear_of(Ball((0.0, 0.0), 1.0), 2)(places, places, np.zeros(2))
    assert found == pytest.approx([2.0, HUGE - 2.0], abs=1e-3)


@pytest.mark.parametrize("point", [(3.0, 4.0), (3.0, 4.0, 0.0)])
def test_what_control_points_may_be_off_counts_in_every_direction(point: tuple[float, ...]) -> None:
    off = 0.01 * math.sqrt(len(point))
    lower, seen, _ = bounds(Ball((0.0,) * len(point), 1.0), point, point, need=0.5, radius=0.01)
    # The middle may be off as much as they.
    assert lower == pytest.approx(4.0 - 0.5 - off, abs=1e-9)
    assert seen == pytest.approx(4.0 - 0.5 + 2 * off, abs=1e-9)


# ------------------------------------------------------------------------------ what grows


def test_what_grows_is_nearer_by_as_much_as_it_has_grown() -> None:
    asked: list[tuple[Indices, Enclosed]] = []

    def judge(item: Indices, curve: Enclosed) -> Bounds:
        asked.append((item, curve))
        return np.array([5.0]), np.array([6.0]), np.array([0.25])

    points = np.array([[[1.0, 2.0, 4.0], [0.0, 0.0, 0.0], [0.125, 0.25, 0.5]]])
    curve = Enclosed(points, np.array([[0.5, 0.25, 0.0625]]))
    lower, seen, share = clear_of_growing(judge)(np.array([7]), curve)
    assert [float(each[0]) for each in (lower, seen, share)] == pytest.approx(
        [5.0 - 0.5 - 0.0625, 6.0 - (0.125 + 2 * 0.25 + 0.5) / 4 + 0.0625, 0.25]
    )
    ((item, place),) = asked
    assert item.tolist() == [7]
    assert place.points.tolist() == points[:, :2].tolist()
    assert place.radius.tolist() == [[0.5, 0.25]]
