"""Distances to many obstacles at once, against those to one after the other."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

torch = pytest.importorskip("torch")

from missionc.backends.clot.optimise.dual_numbers import variables
from missionc.backends.clot.optimise.obstacle_index import Obstacles
from missionc.backends.clot.optimise.stacked_shapes import Stacked
from missionc.backends.clot.paper.free_distance import Surroundings
from missionc.base.trace import Array
from missionc.base.units import Seconds
from missionc.geometry.bounding_box import box_around
from missionc.geometry.displacement import displaced
from missionc.ir import (
    Ball,
    Box,
    Difference,
    Disc,
    Intersection,
    Mission,
    Obstacle,
    Path,
    Polygon,
    Prism,
    Shape,
    Still,
    Union,
)
from missionc.ir.distances.signed_distance import signed_distance
from tests.support.transport_missions import checked


def shape_of(generator: np.random.Generator, dimension: int, depth: int) -> Shape:
    """Any shape, somewhere between 0 and 10 along each axis."""
    kind = int(generator.integers(3 + 3 * (depth > 0) + (dimension == 3)))
    centre = tuple(generator.uniform(0, 10, dimension).tolist())
    size = float(generator.uniform(0.2, 3.0))
    band = Prism(centre[-1] - size, centre[-1] + size) if dimension == 3 else None
    if kind == 0:
        return Box(centre, tuple(x + float(generator.uniform(0.1, 3.0)) for x in centre))
    if kind == 1:
        return Disc(centre[:2], size, band)
    if kind == 2:
        count = int(generator.integers(3, 12))
        turn, far = np.sort(generator.uniform(0, 2 * np.pi, count)), generator.uniform(0.1, 1.0, count) * size
        corners = np.array(centre[:2]) + far[:, None] * np.stack([np.cos(turn), np.sin(turn)], axis=1)
        return Polygon(tuple((float(x), float(y)) for x, y in corners), band)
    if kind == 6 or depth == 0:
        return Ball(centre, size)
    parts = [shape_of(generator, dimension, depth - 1) for _ in range(2)]
    return (Union, Intersection, Difference)[kind - 3](*parts)


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("seed", range(4))
def test_distances_are_those_to_one_shape_after_the_other_and_so_are_gradients(dimension: int, seed: int) -> None:
    generator = np.random.default_rng(seed)
    shapes = [shape_of(generator, dimension, 3) for _ in range(30)]
    points = generator.uniform(-2, 13, (4000, dimension))
    which = generator.integers(len(shapes), size=len(points))
    stacked = Stacked(shapes, dimension)
    found = stacked.distance(variables([points])[0], which)
    expected = np.zeros(len(points))
    for number, shape in enumerate(shapes):
        expected[which == number] = signed_distance(np, shape, points[which == number])
    assert np.allclose(found.value, expected, atol=1e-12)
    gradient = found.partials.T
    lengths = np.linalg.norm(gradient, axis=1)
    assert np.allclose(lengths, 1.0)
    tiny = 1e-6
    for axis in range(dimension):
        aside = points + tiny * np.eye(dimension)[axis]
        measured = (stacked.distance(aside, which) - found.value) / tiny
        # A point within 1e-6 m of where two sides are equally near may see the other one.
        assert np.mean(np.abs(measured - gradient[:, axis]) < 1e-4) > 0.998


def mission_of(
    generator: np.random.Generator, dimension: int, standing: int, moving: int, depth: int = 1, growth: float = 0.3
) -> Mission:
    """A world 10 m wide full of obstacles, some of them beyond its border, for 4 s."""
    to = "(10, 10)" if dimension == 2 else "(10, 10, 10)"
    start = "(1, 1)" if dimension == 2 else "(1, 1, 1)"
    mission, _ = checked(
        f"mission full\ntime step 0.5 s, horizon 4 s\nworld ({', '.join('0' * dimension)}) to {to}\n"
        f"team drone[1] {{ radius 0.1 m  dynamics single_integrator(speed <= 3 m/s)  start at {start} }}\n"
        "require stay: always[0, 4 s] drone[0]: speed <= 9 m/s"
    )
    away = tuple(generator.uniform(-3, 3, dimension).tolist())
    path = Path((Seconds(0.0), Seconds(1.0), Seconds(4.0)), ((0.0,) * dimension, away, (2.0,) * dimension))
    # The last of those that move stands, and grows all the same.
    every = [
        Obstacle(
            f"o{number}",
            shape_of(generator, dimension, depth),
            path if standing <= number < standing + max(moving - 1, 1) else Still(),
            mission.agents[0].span,
            0.0 if number < standing else growth,
        )
        for number in range(standing + moving)
    ]
    return replace(mission, obstacles=tuple(every))


def one_by_one(mission: Mission, points: Array, times: Array) -> Array:
    """(obstacles, rows), metres."""
    return np.array(
        [
            signed_distance(
                np, each.shape, points - np.stack([displaced(each, time, points.shape[1]) for time in times])
            )
            - each.growth * times
            for each in mission.obstacles
        ]
    ).reshape(-1, len(points))


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize(("standing", "moving"), [(0, 2), (5, 0), (60, 3)])
def test_whatever_is_within_reach_is_found_once_and_at_its_distance(dimension: int, standing: int, moving: int) -> None:
    generator = np.random.default_rng(standing)
    mission = mission_of(generator, dimension, standing, moving)
    times = np.array([0.0, 0.5, 1.7, 4.0])
    every = Obstacles(mission, mission.obstacles, times)
    mission = replace(mission, obstacles=every.solid)
    points, instant = generator.uniform(-3, 13, (500, dimension)), generator.integers(4, size=500)
    expected = one_by_one(mission, points, times[instant])
    pairs = every.near(points, instant, 0.5)
    row, which = pairs.row, pairs.which
    assert len(set(zip(row.tolist(), which.tolist(), strict=True))) == len(row)
    found = every.distance(points[pairs.row], pairs)
    assert np.allclose(found, expected[which, row])
    left_out = np.ones_like(expected, dtype=bool)
    left_out[which, row] = False
    boxes = [replace(each, shape=Box(*box_around(each.shape, dimension))) for each in mission.obstacles]
    around = one_by_one(replace(mission, obstacles=tuple(boxes)), points, times[instant])
    assert (around[left_out] >= 0.5).all()


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize(("standing", "moving"), [(0, 0), (3, 2), (60, 3)])
def test_room_is_the_distance_to_the_nearest_as_far_as_it_is_asked_for(
    dimension: int, standing: int, moving: int
) -> None:
    generator = np.random.default_rng(standing)
    mission = mission_of(generator, dimension, standing, moving, depth=0)
    around = Surroundings(mission, 2, dtype=torch.float64)
    points = generator.uniform(-1, 11, (3, 17, 20, dimension))
    times = np.broadcast_to(np.arange(17)[:, None] / 4, points.shape[:-1])
    flat = points.reshape(-1, dimension)
    nearest = one_by_one(mission, flat, times.ravel()).min(axis=0, initial=np.inf)
    expected = np.minimum(nearest, 0.7).reshape(points.shape[:-1])
    for room in (around.all_near, around.all_of_them):
        assert np.allclose(room(torch.from_numpy(points), torch.arange(17), 0.7).numpy(), expected)
    stand = replace(mission, obstacles=mission.obstacles[:standing])
    expected = one_by_one(stand, flat, np.zeros(len(flat))).min(axis=0, initial=np.inf)
    assert np.allclose(Obstacles(stand, stand.obstacles).standing_room(flat), expected)
