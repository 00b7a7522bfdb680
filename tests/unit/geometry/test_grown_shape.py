"""Grown shapes hold every point within their distance of the shape, and of the plain ones no others."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

from missionc.geometry.grown_shape import grown_shape
from missionc.ir import Ball, Box, Difference, Disc, Intersection, Polygon, Prism, Shape, Union
from missionc.ir.distances.signed_distance import signed_distance

STAR = ((0.0, 0.0), (2.0, 0.2), (1.0, 0.8), (1.4, 2.0), (0.3, 1.2))
PLANE: list[Shape] = [
    Box((0.0, 0.0), (1.0, 0.5)),
    Disc((0.5, 0.5), 0.4),
    Polygon(STAR),
    Union(Disc((0.0, 0.0), 0.3), Polygon(STAR)),
    Intersection(Box((0.0, 0.0), (1.0, 1.0)), Disc((0.5, 0.5), 0.6)),
    Difference(Box((0.0, 0.0), (1.0, 1.0)), Disc((0.5, 0.5), 0.3)),
]
VOLUME: list[Shape] = [
    Ball((0.5, 0.5, 0.5), 0.4),
    Disc((0.5, 0.5), 0.4, Prism(0.2, 0.9)),
    Polygon(STAR, Prism(0.0, 1.0)),
]


def test_a_grown_shape_holds_all_that_is_that_near(subtests: pytest.Subtests) -> None:
    for by, shape in product([0.0, 0.1, 0.45], [*PLANE, *VOLUME]):
        with subtests.test(by=by, shape=shape):
            size = 3 if shape in VOLUME else 2
            points = np.random.default_rng(4).uniform(-1.2, 2.6, (4000, size))
            near = signed_distance(np, shape, points) <= by - 1e-12
            inside = signed_distance(np, grown_shape(shape, by), points) <= 1e-12
            assert inside[near].all()
            assert near.any()


@pytest.mark.parametrize("shape", [Disc((0.5, 0.5), 0.4), Polygon(STAR), Polygon(tuple(reversed(STAR)))])
def test_of_a_disc_and_a_polygon_it_holds_nothing_else(shape: Shape) -> None:
    points = np.random.default_rng(5).uniform(-1.2, 2.6, (4000, 2))
    inside = signed_distance(np, grown_shape(shape, 0.3), points) <= 0
    assert (signed_distance(np, shape, points)[inside] <= 0.3 + 1e-9).all()
