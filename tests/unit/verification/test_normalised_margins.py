"""Normalised margins: values by hand, for each kind of scale."""

from __future__ import annotations

import math

import numpy as np
import pytest

from missionc.base.source import Source, Span
from missionc.base.trace import Trace
from missionc.geometry.natural_scale import inradius
from missionc.ir import Box, Difference, Disc, Intersection, Polygon, Prism, Shape, World
from missionc.ir.distances.convex_pieces import outer_half_spaces
from missionc.ir.distances.signed_distance import signed_distance
from missionc.verification.monitoring.normalised_margins import normalised_margins
from tests.support.transport_missions import checked

MISSION = """
mission scales
time step 1 s, horizon 2 s
world (0, 0) to (20, 10)
region field = box (4, 2) to (8, 10)
region pond = disc at (14, 5) radius 2 m
team rover[2] { radius 0.2 m  dynamics single_integrator(speed <= 2 m/s)  start at (5, 6), (8, 6) }
graph radio = proximity 6 m
formation pair = line of rover spacing 3 m tolerance 0.5 m
require inside: rover[0]: field
require outside: rover[1]: not pond
require linked: connected(radio)
require shape: pair
require near: distance(rover[0], rover[1]) <= 4 m
require slow: rover[0]: always[0, 2 s] speed <= 1 m/s
require where: rover[0]: x >= 4.9
require wait: eventually[0, 2 s] rover[0]: field and x <= 5.2
"""


WORLD = World((0.0, 0.0), (10.0, 10.0), Span(Source("a.mission", ""), 0, 0))


def test_margins_are_divided_by_the_inradius_the_range_the_tolerance_and_the_bound() -> None:
    mission, kernel = checked(MISSION)
    position = np.repeat(np.array([[[5.0, 6.0]], [[8.0, 6.0]]]), 3, axis=1)
    trace = Trace(mission.step, position, np.zeros((2, 3, 2)), np.zeros((2, 3)))
    found = normalised_margins(mission, kernel.requirements, trace)
    assert found == pytest.approx(
        {
            "inside": 1 / 2,  # 1 m from the border, inradius 2 m
            "outside": (math.hypot(6, 1) - 2) / 2,
            "linked": 3 / 6,
            "shape": 1.0,
            "near": 1 / 4,
            "slow": 1 / 2,
            "where": 0.1 / 0.2,
            "wait": min(1 / 2, 0.2 / 0.2),
        }
    )


@pytest.mark.parametrize(
    ("shape", "radius"),
    [
        (Box((-2.0, 0.0), (4.0, 3.0)), 1.5),
        (Box((-2.0, 0.0), (1.0, 3.0)), 0.5),  # the world begins at 0
        (Disc((5.0, 5.0), 2.0), 2.0),
    ],
)
def test_the_inradius_of_boxes_and_discs_is_exact(shape: Box | Disc, radius: float) -> None:
    assert inradius(shape, WORLD) == pytest.approx(radius)


def test_the_inradius_of_other_shapes_is_nearly_that_of_their_largest_disc() -> None:
    triangle = Polygon(((0.0, 0.0), (6.0, 0.0), (3.0, 3 * math.sqrt(3))))
    assert inradius(triangle, WORLD) == pytest.approx(math.sqrt(3), rel=0.1)
    frame = Difference(Box((0.0, 0.0), (9.0, 9.0)), Box((0.0, 0.0), (7.0, 9.0)))
    assert inradius(frame, WORLD) == pytest.approx(1.0, rel=0.1)


KITE = Polygon(((0.0, 1.0), (1.0, -1.0), (2.0, 1.0), (1.0, 2.0)))


@pytest.mark.parametrize(
    ("shape", "sides"),
    [
        (Box((0.0, 0.0), (4.0, 2.0)), 4),
        (Box((0.0, 0.0, 0.0), (4.0, 2.0, 1.0)), 6),
        (KITE, 4),
        (Polygon(KITE.corners[::-1], Prism(0.0, 1.0)), 6),
        (Intersection(Box((0.0, 0.0), (4.0, 2.0)), KITE), 8),
        (Disc((0.0, 0.0), 1.0), 0),
        (Polygon(((0.0, 0.0), (3.0, 0.0), (3.0, 1.0), (1.0, 1.0), (1.0, 3.0), (0.0, 3.0))), 0),
        (Difference(Box((0.0, 0.0), (4.0, 2.0)), KITE), 0),
    ],
)
def test_the_depth_in_a_convex_polyhedron_is_the_least_distance_from_its_outer_half_spaces(
    shape: Shape, sides: int
) -> None:
    found = outer_half_spaces(shape)
    assert len(found) == sides
    points = np.random.default_rng(0).uniform(-1.0, 4.0, (300, 3 if sides == 6 else 2))
    depth = -np.asarray(signed_distance(np, shape, points))
    inside = depth > 0
    assert not sides or inside.sum() > 5
    if sides:
        distances = [points[:, : len(side.normal)] @ np.array(side.normal) - side.offset for side in found]
        assert np.min(distances, axis=0)[inside] == pytest.approx(depth[inside])
