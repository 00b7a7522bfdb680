"""Benchmark of obstacle costs with gradients: one obstacle at a time, all together, or from a grid.

    python bench/obstacle_costs.py [--counts 5 50 500] [--points 5430] [--repeat 5] [--spacing 0.1 0.05]

Worlds of 40 m by 40 m (by 10 m) contain stars with eight corners, discs, boxes and unions of two. There are as many
points as 30 robots have in 60 steps, on straight paths across the world. The cost of a point is its shortfall from a
clearance of 0.7 m, computed with its gradient.

    each      one obstacle after the other, for points in its bounding box
    stacked   as in the backend: all obstacles near the points, in one operation (``Obstacles``)
    grid      distance to the nearest obstacle, linear between grid nodes, minus the bound on its error

Node values are exact distances ("from distances"), or a distance transform of the nodes inside obstacles ("transform":
scipy's, with both signs; the time to find these nodes is not included). Between exact nodes the distance is
overestimated by at most spacing · sqrt(dim) / 2, since its slope is at most 1. With a transform, the error is up to
three times that, and larger if an obstacle is thinner than the spacing. Both are compared with the exact distance
outside obstacles. Milliseconds are CPU time of one thread, the minimum of the repetitions.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from functools import partial
from itertools import product
from types import SimpleNamespace
from typing import Any

import numpy as np
from scipy import ndimage

from missionc.backends.clot.optimise.dual_numbers import Dual, variables
from missionc.backends.clot.optimise.obstacle_index import Obstacles
from missionc.base.trace import Array
from missionc.geometry.bounding_box import box_around
from missionc.ir import Box, Disc, Obstacle, Polygon, Prism, Shape, Still, Union
from missionc.ir.distances.signed_distance import signed_distance

REACH = 0.7
"""Clearance in metres."""

SIZE, HEIGHT, ROBOTS = 40.0, 10.0, 30

MOST_NODES = 4_000_000
"""Maximum number of grid nodes."""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--counts", type=int, nargs="+", default=[5, 50, 500])
    parser.add_argument("--points", type=int, default=5430)
    parser.add_argument("--repeat", type=int, default=5)
    parser.add_argument("--spacing", type=float, nargs="+", default=[0.1, 0.05])
    arguments = parser.parse_args()
    columns = "obstacles | dim | pairs | each ms | stacked ms | each / stacked | spacing m | nodes | from distances s"
    print(f"| {columns} | transform s | read ms | read / stacked | overstated, bound m | by a transform |")
    print("|---" * 14 + "|", flush=True)
    for dimension, count in product((2, 3), arguments.counts):
        generator = np.random.default_rng(count)
        mission = world(count, dimension, generator)
        points = ways(arguments.points, dimension, generator)
        every = Obstacles(mission, mission.obstacles)
        pairs = len(every.near(points, np.zeros(len(points), dtype=np.int64), REACH).row)
        one, many = (least(arguments.repeat, partial(how, mission, every, points)) for how in (each, stacked))
        assert np.isclose(each(mission, every, points), stacked(mission, every, points))
        exact = every.standing_room(points)
        outside = exact > 0  # within overlapping obstacles, distances are below those of a transform
        for spacing in arguments.spacing:
            start = f"| {count} | {dimension} | {pairs} | {one:.1f} | {many:.1f} | {one / many:.1f} | {spacing}"
            shape = [int(np.ceil(size / spacing)) + 1 for size in mission.world.high]
            if np.prod(shape) > MOST_NODES:
                print(f"{start} | {np.prod(shape)} | not made | | | | | |", flush=True)
                continue
            axes = [np.arange(number) * spacing for number in shape]
            nodes = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, dimension)
            begin = time.process_time()
            known = every.standing_room(nodes).reshape(shape)
            made = time.process_time() - begin
            inside = known <= 0  # rasterised with the distances: its time is reported separately
            begin = time.process_time()
            transform = spacing * (ndimage.distance_transform_edt(~inside) - ndimage.distance_transform_edt(inside))
            transformed = time.process_time() - begin
            bound = spacing * np.sqrt(dimension) / 2
            read = least(arguments.repeat, partial(cost, known, spacing, points, bound))
            errors = []
            for table, most in ((known, bound), (transform, 3 * bound)):
                off = float((linear(table, spacing, points)[0] - exact)[outside].max())
                assert off <= most, (off, most)
                errors.append(f"{off:.3f}, {most:.3f}")
            print(
                f"{start} | {nodes.shape[0]} | {made:.2f} | {transformed:.2f} | {read:.1f} | "
                f"{read / many:.2f} | {errors[0]} | {errors[1]} |",
                flush=True,
            )


def world(count: int, dimension: int, generator: np.random.Generator) -> Any:
    """Part of a mission that ``Obstacles`` reads, with ``count`` obstacles of all kinds in turn."""
    size = np.array([SIZE, SIZE, HEIGHT][:dimension])

    def shape(kind: int) -> Shape:
        middle, radius = generator.uniform(0.05, 0.95, dimension) * size, float(generator.uniform(0.3, 0.9))
        band = Prism(float(middle[2] - radius), float(middle[2] + radius)) if dimension == 3 else None
        box = Box(tuple((middle - radius).tolist()), tuple((middle + radius).tolist()))
        if kind == 0:
            turn, far = np.arange(8) * np.pi / 4, radius * np.where(np.arange(8) % 2, 0.5, 1.0)
            corners = middle[:2] + far[:, None] * np.stack([np.cos(turn), np.sin(turn)], axis=1)
            return Polygon(tuple((float(x), float(y)) for x, y in corners), band)
        if kind == 1:
            return Disc(tuple(middle[:2].tolist()), radius, band)
        return box if kind == 2 else Union(box, Disc(box.high[:2], radius / 2, band))

    span: Any = None
    every = tuple(Obstacle(f"o{number}", shape(number % 4), Still(), span) for number in range(count))
    bounds = SimpleNamespace(low=(0.0,) * dimension, high=tuple(size.tolist()))
    return SimpleNamespace(obstacles=every, dimension=dimension, world=bounds)


def ways(count: int, dimension: int, generator: np.random.Generator) -> Array:
    """Points on straight paths across the world, (points, dim), metres."""
    size = np.array([SIZE, SIZE, HEIGHT][:dimension])
    start, end = (generator.uniform(0.0, 1.0, (ROBOTS, dimension)) * size for _ in range(2))
    start[:, 0], end[:, 0] = 0.0, SIZE
    share = np.linspace(0.0, 1.0, count // ROBOTS)[:, None]
    found: Array = (start[:, None] * (1 - share) + end[:, None] * share).reshape(-1, dimension)
    return found


def each(mission: Any, every: Obstacles, points: Array) -> float:
    """Sum of missing clearances and of their gradients, so that all work is done.

    Points: (points, dim), metres.
    """
    total = 0.0
    for obstacle in mission.obstacles:
        low, high = (np.array(corner) for corner in box_around(obstacle.shape, mission.dimension))
        beside = np.maximum(np.maximum(low - points, points - high), 0.0)
        close = points[np.einsum("sd,sd->s", beside, beside) < REACH**2]
        if not len(close):
            continue
        total += _work(signed_distance(np, obstacle.shape, *variables([close])))
    return total


def stacked(mission: Any, every: Obstacles, points: Array) -> float:
    """The same with ``Obstacles``; points: (points, dim), metres."""
    pairs = every.near(points, np.zeros(len(points), dtype=np.int64), REACH)
    (near,) = variables([points[pairs.row]])
    return _work(every.distance(near, pairs))


def _work(distance: Dual) -> float:
    lacking = np.clip(REACH - distance, 0.0, None)
    return float(lacking.value.sum()) + float(np.abs(lacking.partials).sum())


def cost(table: Array, spacing: float, points: Array, bound: float) -> float:
    """The same for the nearest obstacle with a grid; points: (points, dim), metres."""
    distance, gradient = linear(table, spacing, points)
    lacking = np.maximum(REACH - (distance - bound), 0.0)
    return float(lacking.sum()) + float(np.abs(gradient[lacking > 0]).sum())


def linear(table: Array, spacing: float, points: Array) -> tuple[Array, Array]:
    """Values of a grid between its nodes, (points,), and their gradients, (points, dim); points:
    (points, dim), metres.
    """
    shape = np.array(table.shape)
    at = np.clip(points / spacing, 0.0, shape - 1 - 1e-9)
    cell = np.minimum(at.astype(np.int64), shape - 2)
    part, flat = at - cell, table.ravel()
    step = np.array([int(np.prod(shape[axis + 1 :])) for axis in range(len(shape))])
    first = cell @ step
    value, gradient = np.zeros(len(points)), np.zeros_like(points)
    for corner in product((0, 1), repeat=len(shape)):
        here = flat[first + int(np.dot(corner, step))]
        weights = np.where(np.array(corner), part, 1.0 - part)
        value += here * weights.prod(axis=1)
        for axis, upper in enumerate(corner):
            gradient[:, axis] += (here if upper else -here) * np.delete(weights, axis, axis=1).prod(axis=1) / spacing
    return value, gradient


def least(repeat: int, done: Callable[[], object]) -> float:
    """Minimum time over the repetitions, ms."""
    times = []
    for _ in range(repeat + 1):
        begin = time.process_time()
        done()
        times.append(time.process_time() - begin)
    return 1e3 * min(times[1:])


if __name__ == "__main__":
    main()
