"""Quasi-uniform sampling of boxes and shapes, deterministic for a given random generator."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from missionc.base.trace import Array, Flags, Indices
from missionc.geometry.bounding_box import box_around
from missionc.ir import Shape, Vector, World
from missionc.ir.distances.signed_distance import signed_distance

BATCH = 1 << 10
"""Number of points tried at a time in the bounding box of a shape."""

BATCHES = 16
"""Maximum number of batches; a shape that fills less than a ten-thousandth of its bounding box may get no points."""

TINY = 1e-9
"""Distance, metres, by which a grid point may exceed the box and still count as on its border."""


def scatter(low: Vector, high: Vector, count: int, generator: np.random.Generator) -> Array:
    """Points spread uniformly over a box, (count, dim), metres; each prefix of them is uniform too.

    The points are the additive sequence of the generalised golden ratio, with a random shift and a perturbation of up
    to a quarter of the spacing, so that they form no lattice.
    """
    dimension = len(low)
    ratio = 2.0
    for _ in range(60):
        ratio = (1.0 + ratio) ** (1.0 / (dimension + 1))
    stride = ratio ** -np.arange(1, dimension + 1)
    shift = generator.random(dimension)
    shake = (generator.random((count, dimension)) - 0.5) * (0.5 * count ** (-1.0 / dimension))
    unit = (shift + stride * np.arange(1, count + 1)[:, None] + shake) % 1.0
    points: Array = np.asarray(low) + unit * (np.asarray(high) - np.asarray(low))
    return points


def points_in(shape: Shape, world: World, enough: int, generator: np.random.Generator) -> tuple[Array, Array]:
    """Points of a shape within the world, and their depths in the shape.

    Args:
        enough: number of points after which the search stops.

    Returns:
        points, (points, dim), and depths, (points,), metres; empty if no point was found.
    """
    low, high = bounds(shape, world)
    empty = np.zeros((0, world.dimension)), np.zeros(0)
    if any(first > last for first, last in zip(low, high, strict=True)):
        return empty
    inside, deep = [empty[0]], [empty[1]]
    for _ in range(BATCHES):
        points = scatter(low, high, BATCH, generator)
        depth = -np.asarray(signed_distance(np, shape, points))
        inside.append(points[depth > 0])
        deep.append(depth[depth > 0])
        if sum(map(len, deep)) >= enough:
            break
    return np.concatenate(inside), np.concatenate(deep)


def bounds(shape: Shape, world: World) -> tuple[Vector, Vector]:
    """Lowest and highest corner of a box around the part of a shape inside the world, metres."""
    low, high = box_around(shape, world.dimension)
    return tuple(map(max, low, world.low)), tuple(map(min, high, world.high))


def packed(shape: Shape, world: World, pitch: float) -> Array:
    """Points of a shape on a square grid of ``pitch`` metres, aligned to the corner of its box: (points, dim),
    metres."""
    low, high = bounds(shape, world)
    if any(first > last for first, last in zip(low, high, strict=True)):
        return np.zeros((0, world.dimension))
    axes = [np.arange(first, last + TINY, pitch) for first, last in zip(low, high, strict=True)]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, world.dimension)
    within: Flags = np.asarray(signed_distance(np, shape, points)) <= 0
    return points[within]


def far_apart(points: Array, count: int, others: Array) -> Indices:
    """Greedy selection of points that are far apart: each is the farthest from the selected points and from ``others``.

    Args:
        points: (points, dim), metres, at least one; if ``others`` is empty, the first point is selected first.
        count: number of points to select.
        others: (others, dim), metres.

    Returns:
        (at most count,), indices of points in the order of selection.
    """
    gap = np.full(len(points), np.inf) if len(others) == 0 else cKDTree(others).query(points)[0]
    taken: list[int] = []
    for _ in range(min(count, len(points))):
        chosen = int(np.argmax(gap))
        taken.append(chosen)
        gap = np.minimum(gap, np.linalg.norm(points - points[chosen], axis=1))
        gap[chosen] = -1.0
    return np.array(taken, dtype=np.int64)
