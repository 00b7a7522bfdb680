"""Distances to bodies that are cut out of others in a volume: one layer upon the other."""

from __future__ import annotations

import numpy as np
import pytest

from missionc.ir import Box, Difference, Disc, Intersection, Polygon, Prism, Shape, Vector
from missionc.verify.plan.obstacle_bodies import solid

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
