"""Signed distance from points to the border of a shape: negative inside, metres.

A shape is a closed set: its border belongs to it, at distance 0. The code uses only array operations that numpy and
torch share.
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import reduce
from typing import Any, TypeAlias, assert_never

from missionc.ir import Ball, Box, Difference, Disc, Intersection, Polygon, Prism, Shape, Union

Array: TypeAlias = Any
"""Array of the library in use."""

Namespace: TypeAlias = Any
"""Array library: ``numpy`` or ``torch``."""


def signed_distance(xp: Namespace, shape: Shape, position: Array) -> Array:
    """Signed distance of points to the border of a shape, negative inside.

    Args:
        xp: array library of ``position``.
        position: points, (..., dim), metres.

    Returns:
        (...), metres, negative inside, 0 on the border. Moving a point by one metre changes the distance by at most one
            metre. The distance is exact for plain shapes. For combined shapes the sign is exact and the absolute value
            is never overstated: inside a union, and outside an intersection or a difference, the border may be further
            away. A difference includes its border.
    """
    match shape:
        case Box(low, high):
            return _outside(
                xp,
                [
                    xp.maximum(low[axis] - position[..., axis], position[..., axis] - high[axis])
                    for axis in range(len(low))
                ],
            )
        case Disc(centre, radius, band):
            return _extruded(xp, distance_between(xp, position[..., :2], centre) - radius, band, position)
        case Ball(centre, radius):
            return distance_between(xp, position, centre) - radius
        case Polygon(corners, band):
            return _extruded(xp, _polygon(xp, corners, position), band, position)
        case Union(left, right):
            return xp.minimum(signed_distance(xp, left, position), signed_distance(xp, right, position))
        case Intersection(left, right):
            return xp.maximum(signed_distance(xp, left, position), signed_distance(xp, right, position))
        case Difference(left, right):
            return xp.maximum(signed_distance(xp, left, position), -signed_distance(xp, right, position))
        case _:
            assert_never(shape)


def measured_outside(shape: Shape) -> bool:
    """Return true if ``signed_distance`` is exact for all points outside the shape; near intersections and differences
    it may understate."""
    match shape:
        case Box() | Disc() | Ball() | Polygon():
            return True
        case Union(left, right):
            return measured_outside(left) and measured_outside(right)
        case Intersection() | Difference():
            return False
        case _:
            assert_never(shape)


def distance_between(xp: Namespace, first: Array, second: Array | tuple[float, ...]) -> Array:
    """Euclidean distance between points, (..., dim) and (..., dim) or one tuple of coordinates -> (...), metres."""
    axes = range(first.shape[-1])
    if isinstance(second, tuple):
        return length(xp, [first[..., axis] - second[axis] for axis in axes])
    return length(xp, [first[..., axis] - second[..., axis] for axis in axes])


def length(xp: Namespace, coordinates: Iterable[Array]) -> Array:
    """Euclidean length of vectors from their coordinates, (...) each, in metres or m/s -> (...), the same unit.

    The gradient of the zero vector is 0, where torch's own is not a number.
    """
    square = reduce(lambda left, right: left + right, [coordinate * coordinate for coordinate in coordinates])
    if xp.__name__ == "numpy":  # torch has no gradient at 0
        return xp.sqrt(square)
    positive = square > 0
    return xp.where(positive, xp.sqrt(xp.where(positive, square, 1.0)), 0.0)


def _outside(xp: Namespace, distances: list[Array]) -> Array:
    """Signed distance to a product of sets along orthogonal axes, from the signed distances to each set.

    Shape: (...) each, metres -> (...), metres.
    """
    outside = length(xp, [xp.clip(distance, 0.0, None) for distance in distances])
    inside = xp.clip(reduce(xp.maximum, distances), None, 0.0)
    return outside + inside


def _extruded(xp: Namespace, plane: Array, band: Prism | None, position: Array) -> Array:
    if band is None:
        return plane
    height = position[..., 2]
    return _outside(xp, [plane, xp.maximum(band.low - height, height - band.high)])


def _polygon(xp: Namespace, corners: tuple[tuple[float, float], ...], position: Array) -> Array:
    """Signed distance of points to a polygon in the plane: (..., dim) -> (...), metres.

    The absolute value is the distance to the nearest side. A point is inside if a ray to the right crosses an odd
    number of sides.
    """
    x, y = position[..., 0], position[..., 1]
    sides: list[Array] = []
    inside = x != x
    for (ax, ay), (bx, by) in zip(corners, corners[1:] + corners[:1], strict=True):
        dx, dy = bx - ax, by - ay
        square = dx * dx + dy * dy
        if square == 0:
            continue
        along = xp.clip(((x - ax) * dx + (y - ay) * dy) / square, 0.0, 1.0)
        sides.append(length(xp, [x - ax - along * dx, y - ay - along * dy]))
        if dy != 0:
            crosses = ((y < ay) != (y < by)) & (x < ax + (y - ay) / dy * dx)
            inside = inside != crosses
    nearest = reduce(xp.minimum, sides)
    return xp.where(inside, -nearest, nearest)
