"""Columns: how far obstacles are from them, against every height and moment looked at one by one."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest

from missionc.geometry.columns import FINE, MOST_HEIGHTS, STRIDE, column_clearance
from missionc.geometry.displacement import displaced, moved
from missionc.ir import Ball, Box, Disc, Polygon, Prism, Shape
from missionc.ir.distances.signed_distance import signed_distance
from tests.support.legal_plans import moving, still

SHAPES: list[Shape] = [
    Disc((1.0, 1.0), 0.3, Prism(0.0, 0.5)),
    Ball((1.0, 1.0, 0.7), 0.4),
    Box((0.0, 0.0, 0.3), (1.0, 2.0, 0.6)),
    Polygon(((0.0, 0.0), (1.0, 0.0), (1.0, 1.5)), None),
]


@pytest.mark.parametrize("shape", SHAPES, ids=lambda shape: type(shape).__name__)
@pytest.mark.parametrize("moves", [False, True])
def test_no_height_and_no_moment_is_nearer_than_what_is_said_by_more_than_is_allowed_for(
    shape: Shape, moves: bool
) -> None:
    random = np.random.default_rng(4)
    for _ in range(5):
        times = np.sort(random.uniform(-2, 6, 3)).tolist()
        ways = tuple(map(tuple, random.uniform(-1.5, 1.5, (3, 3)).tolist()))
        obstacle = moving(shape, tuple(times), ways) if moves else still(shape)
        x, y, z = random.uniform(0.2, 2, 3).tolist()
        column = np.column_stack([np.full(60, x), np.full(60, y), np.linspace(0, z, 60)])
        seen = min(
            float(signed_distance(np, moved(shape, displaced(obstacle, time, 3)), column).min())
            for time in np.linspace(0.5, 4.0, 60 if moves else 1).tolist()
        )
        said = column_clearance(obstacle, (x, y, z), 0.5, 4.0)
        fastest = max((math.dist(*pair) for pair in pairwise(ways)), default=0.0)
        assert said <= seen
        assert seen - said < FINE + STRIDE + z / 59 + (fastest * 3.5 / 59 / min(np.diff(times)) if moves else 0.0)


def test_a_column_of_any_height_is_looked_at_more_coarsely_the_higher_it_is() -> None:
    pole = still(Disc((4.0, 0.0), 1.0, Prism(0.0, 2.0)))
    assert column_clearance(pole, (0.0, 0.0, FINE * MOST_HEIGHTS), 0.0, 0.0) == pytest.approx(3.0 - FINE / 2)
    assert column_clearance(pole, (0.0, 0.0, 2 * FINE * MOST_HEIGHTS), 0.0, 0.0) == pytest.approx(3.0 - FINE)
    assert column_clearance(pole, (0.0, 0.0, 1e38), 0.0, 0.0) == pytest.approx(-1e38 / MOST_HEIGHTS / 2)
