"""Signed distances to shapes."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

from missionc.ir import Ball, Box, Difference, Disc, Intersection, Polygon, Prism, Shape, Union
from missionc.ir.distances.signed_distance import signed_distance

BOX = Box((0.0, 0.0), (4.0, 2.0))
DISC = Disc((1.0, 1.0), 1.5)
HOOK = Polygon(((0.0, 0.0), (3.0, 0.0), (3.0, 1.0), (1.0, 1.0), (1.0, 3.0), (0.0, 3.0)))
PLANE: list[Shape] = [BOX, DISC, HOOK, Union(BOX, DISC), Intersection(BOX, DISC), Difference(HOOK, DISC)]
SOLID: list[Shape] = [
    Box((0.0, 0.0, 0.0), (1.0, 2.0, 3.0)),
    Disc((0.0, 0.0), 1.0, Prism(1.0, 2.0)),
    Ball((1.0, 1.0, 1.0), 1.0),
    Polygon(HOOK.corners, Prism(0.0, 1.0)),
]

coordinate = st.floats(-5, 5)


def distance(shape: Shape, *point: float) -> float:
    return float(signed_distance(np, shape, np.array(point)))


def test_distances_are_exact(subtests: pytest.Subtests) -> None:
    for shape, point, expected in [
        (BOX, (1.0, 1.0), -1.0),
        (BOX, (7.0, 6.0), 5.0),
        (BOX, (2.0, 3.0), 1.0),
        (BOX, (4.0, 2.0), 0.0),
        (DISC, (1.0, 1.0), -1.5),
        (DISC, (1.0, 4.0), 1.5),
        (HOOK, (0.5, 0.5), -0.5),
        (HOOK, (2.0, 2.0), 1.0),
        (HOOK, (1.0, 1.0), 0.0),
        (HOOK, (2.0, 1.0), 0.0),
        (SOLID[0], (0.5, 1.0, 1.5), -0.5),
        (SOLID[0], (4.0, 6.0, 3.0), 5.0),
        (SOLID[1], (0.0, 0.0, 1.25), -0.25),
        (SOLID[1], (4.0, 0.0, 6.0), 5.0),
        (SOLID[1], (0.0, 0.0, 5.0), 3.0),
        (SOLID[2], (1.0, 1.0, 3.0), 1.0),
        (SOLID[3], (0.5, 0.5, 0.75), -0.25),
        (SOLID[3], (2.0, 2.0, 2.0), math.sqrt(2.0)),
        (Union(BOX, DISC), (1.0, 2.25), -0.25),
        (Difference(BOX, DISC), (1.0, 1.0), 1.5),
        (Difference(BOX, DISC), (3.5, 1.0), -0.5),
        (Intersection(BOX, DISC), (1.0, 2.25), 0.25),
    ]:
        with subtests.test(shape=shape, point=point, expected=expected):
            assert distance(shape, *point) == pytest.approx(expected, abs=1e-12)


def test_a_border_belongs_to_its_shape_and_to_what_is_cut_from_it() -> None:
    assert distance(BOX, 4.0, 1.0) <= 0
    assert distance(Difference(BOX, Box((2.0, 0.0), (4.0, 2.0))), 2.0, 1.0) <= 0


def test_many_points_are_judged_at_once_and_keep_their_axes() -> None:
    points = np.random.default_rng(0).uniform(-5, 5, (2, 3, 4, 2))
    for shape in PLANE:
        together = signed_distance(np, shape, points)
        assert together.shape == (2, 3, 4)
        assert together[1, 2, 3] == distance(shape, *points[1, 2, 3])


@given(coordinate, coordinate)
def test_a_polygon_is_as_far_as_shapely_says(x: float, y: float) -> None:
    polygon, point = shapely.Polygon(HOOK.corners), shapely.Point(x, y)
    border = polygon.exterior.distance(point)
    assert abs(distance(HOOK, x, y)) == pytest.approx(border, abs=1e-9)
    if border > 1e-9:
        assert (distance(HOOK, x, y) < 0) == polygon.contains(point)


@given(coordinate, coordinate)
def test_turning_a_polygon_round_changes_nothing(x: float, y: float) -> None:
    assert distance(Polygon(HOOK.corners[::-1]), x, y) == pytest.approx(distance(HOOK, x, y), abs=1e-12)


@pytest.mark.parametrize("shape", [*PLANE, *SOLID], ids=lambda shape: type(shape).__name__)
@given(data=st.data())
def test_a_metre_changes_the_distance_by_a_metre_at_most(shape: Shape, data: st.DataObject) -> None:
    dimension = 3 if shape in SOLID else 2
    first, second = (data.draw(st.tuples(*[coordinate] * dimension)) for _ in range(2))
    change = abs(distance(shape, *first) - distance(shape, *second))
    assert change <= math.dist(first, second) + 1e-9
