"""Straight lines past shapes: their clearance, its sign, and what it is worth to move an end."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

from missionc.base.trace import Array
from missionc.geometry import plain_floats
from missionc.geometry.plain_floats import Place
from missionc.ir import Ball, Box, Difference, Disc, Intersection, Polygon, Prism, Shape, Union
from missionc.ir.distances.convex_pieces import count_pieces, pieces
from missionc.ir.distances.line_of_sight import clear_line
from missionc.ir.distances.signed_distance import signed_distance

BOX = Box((0.0, 0.0), (4.0, 2.0))
DISC = Disc((1.0, 1.0), 1.5)
HOOK = Polygon(((0.0, 0.0), (3.0, 0.0), (3.0, 1.0), (1.0, 1.0), (1.0, 3.0), (0.0, 3.0)))
ARROW = Polygon(((0.0, 0.0), (4.0, 1.5), (0.5, 3.0), (1.5, 1.5)))
KITE = Polygon(((0.0, 1.0), (1.0, -1.0), (2.0, 1.0), (1.0, 2.0)))
PLANE: list[Shape] = [
    BOX,
    DISC,
    HOOK,
    ARROW,
    KITE,
    Union(BOX, DISC),
    Intersection(BOX, DISC),
    Difference(HOOK, DISC),
    Difference(BOX, ARROW),
    Difference(BOX, KITE),
    Difference(BOX, Union(Disc((1.0, 1.0), 0.5), Disc((3.0, 1.0), 0.75))),
    Difference(BOX, Difference(DISC, KITE)),
    Difference(DISC, Intersection(BOX, HOOK)),
]
SOLID: list[Shape] = [
    Box((0.0, 0.0, 0.0), (1.0, 2.0, 3.0)),
    Disc((0.0, 0.0), 1.0, Prism(1.0, 2.0)),
    Ball((1.0, 1.0, 1.0), 1.0),
    Polygon(HOOK.corners, Prism(0.0, 1.0)),
    Difference(Box((0.0, 0.0, 0.0), (3.0, 2.0, 3.0)), Disc((1.0, 1.0), 1.0, Prism(1.0, 2.0))),
    Difference(Box((0.0, 0.0, 0.0), (3.0, 2.0, 3.0)), Polygon(ARROW.corners, Prism(1.0, 2.0))),
    Difference(Ball((1.0, 1.0, 1.0), 2.0), Ball((1.0, 1.0, 1.0), 1.0)),
]
CONVEX = (BOX, DISC, KITE, *SOLID[:3])


def clearance(shape: Shape, first: Array, second: Array) -> Array:
    return np.asarray(clear_line(np, (shape,), first, second, np.full(len(first), np.inf)))


def lines(dimension: int, count: int, seed: int) -> tuple[Array, Array]:
    draw = np.random.default_rng(seed)
    return draw.uniform(-2, 5, (count, dimension)), draw.uniform(-2, 5, (count, dimension))


def sampled(shape: Shape, first: Array, second: Array) -> Array:
    share = np.linspace(0.0, 1.0, 4001)[:, None, None]
    return np.asarray(signed_distance(np, shape, first + share * (second - first))).min(axis=0)


def outline(shape: Shape) -> shapely.Geometry:
    match shape:
        case Box(low, high):
            return shapely.box(*low, *high)
        case Disc(centre, radius):
            return shapely.Point(centre).buffer(radius, quad_segs=1024)
        case Polygon(corners):
            return shapely.Polygon(corners)
        case Union(left, right):
            return outline(left) | outline(right)
        case Intersection(left, right):
            return outline(left) & outline(right)
        case Difference(left, right):
            return outline(left) - outline(right)
    raise AssertionError(shape)


def test_the_clearance_of_a_line_is_the_least_signed_distance_of_its_points(subtests: pytest.Subtests) -> None:
    for shape, first, second, expected in [
        (BOX, (-1.0, 1.0), (5.0, 1.0), -1.0),
        (BOX, (-1.0, 3.0), (5.0, 3.0), 1.0),
        (BOX, (-1.0, 2.0), (5.0, 2.0), 0.0),
        (BOX, (5.0, 0.0), (9.0, 0.0), 1.0),
        (BOX, (4.0, 4.0), (6.0, 2.0), math.sqrt(2.0)),
        (DISC, (-3.0, 1.0), (5.0, 1.0), -1.5),
        (DISC, (-3.0, 4.0), (5.0, 4.0), 1.5),
        (HOOK, (2.0, 2.0), (2.0, 5.0), 1.0),
        (HOOK, (0.0, 4.0), (4.0, 4.0), 1.0),
        (HOOK, (1.5, 4.5), (4.5, 1.5), math.sqrt(2.0)),
        (SOLID[2], (-3.0, 1.0, 1.0), (5.0, 1.0, 1.0), -1.0),
        (SOLID[1], (0.0, 0.0, 3.0), (0.0, 0.0, 5.0), 1.0),
        (SOLID[1], (2.0, 0.0, 0.0), (2.0, 0.0, 5.0), 1.0),
        (SOLID[6], (1.0, 1.0, 1.0), (1.5, 1.0, 1.0), 0.5),
    ]:
        with subtests.test(shape=shape, first=first, second=second, expected=expected):
            assert clearance(shape, np.array([first]), np.array([second])).item() == pytest.approx(expected, abs=1e-9)


def test_the_sign_is_that_of_the_nearest_point_and_the_size_is_never_overstated(subtests: pytest.Subtests) -> None:
    for shape in PLANE + SOLID:
        with subtests.test(shape=shape):
            first, second = lines(2 if shape in PLANE else 3, 150, 7)
            found, least = clearance(shape, first, second), sampled(shape, first, second)
            fine = np.linalg.norm(second - first, axis=1) / 4000
            assert (found <= np.maximum(least, 0.0) + 1e-9).all()
            assert (found >= np.minimum(least, 0.0) - fine).all()
            assert ((found > 0) == (least > 0))[np.abs(least) > fine].all()
            assert (found > 0).any()
            assert (found < 0).any()
            if shape in CONVEX:
                assert np.abs(found - least).max() <= fine.max()


def test_a_line_is_clear_where_a_geometry_library_finds_that_it_does_not_meet_the_shape(
    subtests: pytest.Subtests,
) -> None:
    for shape in PLANE:
        with subtests.test(shape=shape):
            first, second = lines(2, 200, 11)
            found, geometry = clearance(shape, first, second), outline(shape)
            for one, other, value in zip(first, second, found, strict=True):
                line = shapely.LineString([one, other])
                apart = float(shapely.distance(geometry, line))
                if abs(value) > 1e-5:  # discs are polygons there
                    assert (apart > 0) == (value > 0)
                assert value <= apart + 1e-5


@given(st.integers(0, 10_000), st.sampled_from(PLANE))
def test_moving_both_ends_by_a_metre_changes_it_by_at_most_a_metre(seed: int, shape: Shape) -> None:
    first, second = lines(2, 6, seed)
    draw = np.random.default_rng(seed)
    moves = draw.normal(size=(2, 6, 2)) * 0.3
    most = np.linalg.norm(moves, axis=-1).max(axis=0)
    change = np.abs(clearance(shape, first + moves[0], second + moves[1]) - clearance(shape, first, second))
    assert (change <= most + 1e-9).all()


def test_a_line_is_as_clear_from_one_end_as_from_the_other_and_from_place_to_place_as_from_array_to_array(
    subtests: pytest.Subtests,
) -> None:
    for shape in PLANE:
        with subtests.test(shape=shape):
            first, second = lines(2, 20, 3)
            found = clearance(shape, first, second)
            assert found.tolist() == clearance(shape, second, first).tolist()
            for one, other, value in zip(first.tolist(), second.tolist(), found.tolist(), strict=True):
                assert clear_line(plain_floats, (shape,), Place(one), Place(other), math.inf) == pytest.approx(
                    value, abs=1e-12
                )


def test_what_is_enough_is_not_passed_and_all_shapes_count() -> None:
    first, second = lines(2, 200, 5)
    alone = np.minimum(clearance(HOOK, first, second), clearance(KITE, first, second))
    enough = np.random.default_rng(1).uniform(-0.5, 1.0, 200)
    found = clear_line(np, (HOOK, KITE), first, second, enough)
    assert found == pytest.approx(np.minimum(enough, alone), abs=1e-12)


@pytest.mark.parametrize("shape", PLANE)
def test_its_gradient_in_torch_is_how_it_changes(shape: Shape) -> None:
    torch = pytest.importorskip("torch")
    first, second = lines(2, 60, 9)
    ends = [torch.from_numpy(each).requires_grad_() for each in (first, second)]
    value = clear_line(torch, (shape,), *ends, torch.full((60,), math.inf, dtype=torch.float64))
    assert value.detach().numpy() == pytest.approx(clearance(shape, first, second), abs=1e-12)
    slopes = [each.numpy() for each in torch.autograd.grad(value.sum(), ends)]
    tiny, close = 1e-5, 0
    for end in (0, 1):
        for axis in (0, 1):
            step = np.zeros(2)
            step[axis] = tiny
            there = (first + step, second) if end == 0 else (first, second + step)
            change = (clearance(shape, *there) - value.detach().numpy()) / tiny
            close += int((np.abs(change - slopes[end][:, axis]) < 1e-3).sum())
    assert close >= 0.95 * 240  # beside a kink there is no one slope


def test_pieces_are_counted_as_they_are_made() -> None:
    for shape in PLANE + SOLID:
        assert count_pieces(shape)[0] == len(pieces(shape))
    wide: Shape = BOX
    for _ in range(60):
        wide = Difference(wide, Union(BOX, DISC))
    assert count_pieces(wide)[0] == 4**60
