"""Areas around shapes: an outer one holds at least the points meant, an inner one at most."""

from __future__ import annotations

import numpy as np
import pytest

from missionc.base.units import Metres
from missionc.geometry.configuration_space import Atlas
from missionc.ir import Ball, World
from tests.support.random_runs import SPAN


@pytest.mark.parametrize("distance", [0.05, 0.4, 1.7])
def test_the_places_near_a_ball_lie_between_the_inner_and_the_outer_area(distance: float) -> None:
    world, ball = World((0.0, 0.0, 0.0), (6.0, 6.0, 4.0), SPAN), Ball((3.0, 2.5, 1.5), Metres(1.0))
    atlas = Atlas.of(world, [ball])
    places = np.random.default_rng(0).uniform(world.low, world.high, (4000, 3))
    meant = np.linalg.norm(places - np.array(ball.centre), axis=1) <= ball.radius + distance
    outer = np.array(atlas.holds(atlas.near(ball, distance, outer=True), places))
    inner = np.array(atlas.holds(atlas.near(ball, distance, outer=False), places))
    assert inner.any()
    assert (meant <= outer).all()
    assert (inner <= meant).all()
