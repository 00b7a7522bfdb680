"""Distances to bodies that are cut out of others: in a volume one layer upon the other, in the plane their outline."""

from __future__ import annotations

import math

import numpy as np
import pytest

from missionc.ir import Box, Difference, Disc, Intersection, Polygon, Prism, Shape, Union, Vector
from missionc.verification.plan.obstacle_bodies import solid

TOWER = Disc((2.0, 2.0), 1.0, Prism(0.0, 2.0))
ROOF = Box((0.0, 0.0, 1.0), (4.0, 4.0, 3.0))
WEDGE = Polygon(((0.0, 0.0), (4.0, 0.0), (4.0, 4.0)), Prism(0.5, 1.5))


@pytest.mark.parametrize(
    ("shape", "point", "distance"),
    [
        (Difference(TOWER, ROOF), (4.0, 2.0, 0.5), 1.0),
        (Difference(TOWER, ROOF), (2.0, 2.0, 1.75), 0.75),
        (Difference(TOWER, ROOF), (5.0, 2.0, 1.0), 2.0),
        (Intersection(TOWER, ROOF), (2.0, 4.0, 1.5), 1.0),
        (Intersection(TOWER, ROOF), (2.0, 2.0, 0.25), 0.75),
        (Intersection(TOWER, ROOF), (2.0, 2.0, 2.5), 0.5),
        (Intersection(WEDGE, TOWER), (2.0, 0.0, 1.0), 1.0),
        (Intersection(WEDGE, TOWER), (2.5, 1.5, 2.0), 0.5),
        (Difference(WEDGE, TOWER), (3.0, -1.0, 1.0), 1.0),
        (Difference(WEDGE, TOWER), (3.5, 1.0, 0.0), 0.5),
    ],
)
def test_what_is_left_of_a_body_is_as_far_as_its_nearest_layer(shape: Shape, point: Vector, distance: float) -> None:
    assert solid(shape, 3)(np.array([point])).tolist() == pytest.approx([distance])


LEFT, RIGHT = Disc((0.0, 0.0), 1.0), Disc((1.0, 0.0), 1.0)
"""They cross half a metre from both centres, at this height."""
CUSP = math.sqrt(0.75)


@pytest.mark.parametrize(
    ("shape", "point", "distance"),
    [
        # A lens, whose ends are nearest from above and below.
        (Intersection(LEFT, RIGHT), (0.5, 2.0), 2.0 - CUSP),
        (Intersection(LEFT, RIGHT), (0.5, -2.0), 2.0 - CUSP),
        (Intersection(LEFT, RIGHT), (0.5, 0.0), -0.5),
        (Intersection(LEFT, RIGHT), (-1.0, 0.0), 1.0),
        # A sickle: its inner side from within, its end from beyond.
        (Difference(LEFT, RIGHT), (0.5, 0.0), 0.5),
        (Difference(LEFT, RIGHT), (1.0, CUSP), 0.5),
        (Difference(LEFT, RIGHT), (0.5, 2.0), math.hypot(0.5, 2.0) - 1.0),
        (Difference(LEFT, RIGHT), (-0.5, 0.0), -0.5),
        # A disc with a side cut off, before, through or beyond its middle.
        (Difference(LEFT, Box((0.0, -2.0), (2.0, 2.0))), (1.0, 0.0), 1.0),
        (Difference(LEFT, Box((0.0, -2.0), (2.0, 2.0))), (0.5, 1.0), 0.5),
        (Difference(LEFT, Box((0.5, -2.0), (2.0, 2.0))), (1.0, CUSP), 0.5),
        (Difference(LEFT, Box((0.5, -2.0), (2.0, 2.0))), (0.25, 0.0), -0.25),
        (Intersection(LEFT, Box((-2.0, 0.5), (2.0, 2.0))), (CUSP, 0.0), 0.5),
        (Intersection(LEFT, Box((0.5, -2.0), (2.0, 2.0))), (0.5, CUSP + 0.5), 0.5),
        # What is cut off a corner, and a hole.
        (Difference(Box((0.0, 0.0), (4.0, 4.0)), Box((2.0, 2.0), (9.0, 9.0))), (3.0, 3.0), 1.0),
        (Difference(Box((0.0, 0.0), (4.0, 4.0)), Box((1.0, 1.0), (3.0, 3.0))), (2.0, 2.5), 0.5),
        (
            Difference(Box((0.0, 0.0), (4.0, 4.0)), Polygon(((1.0, 1.0), (3.0, 1.0), (3.0, 3.0)))),
            (2.5, 2.0),
            math.sqrt(0.125),
        ),
        (Intersection(Box((0.0, 0.0), (4.0, 4.0)), Box((4.0, 0.0), (8.0, 4.0))), (4.0, 2.0), math.inf),
        # Parts of a union are measured one by one.
        (Union(LEFT, Box((3.0, -1.0), (4.0, 1.0))), (2.25, 0.0), 0.75),
        (Union(Difference(LEFT, RIGHT), Box((3.0, -1.0), (4.0, 1.0))), (0.5, 0.0), 0.5),
    ],
)
def test_what_is_left_of_a_body_in_the_plane_is_as_far_as_its_outline(
    shape: Shape, point: Vector, distance: float
) -> None:
    assert solid(shape, 2)(np.array([point])).tolist() == pytest.approx([distance])


BLOCK, HOLE = Box((0.0, 0.0, 0.0), (4.0, 4.0, 2.0)), Box((1.0, 1.0, 1.0), (3.0, 3.0, 3.0))


@pytest.mark.parametrize(
    ("point", "distance"),
    [
        ((2.0, 2.0, 1.5), 0.5),
        ((2.0, 2.0, 2.5), math.hypot(1.0, 0.5)),
        ((0.5, 2.0, 2.5), 0.5),
        ((2.0, 2.0, -1.0), 1.0),
        ((2.0, 2.0, 0.75), -0.25),
    ],
)
def test_a_hole_from_above_has_a_floor(point: Vector, distance: float) -> None:
    assert solid(Difference(BLOCK, HOLE), 3)(np.array([point])).tolist() == pytest.approx([distance])
