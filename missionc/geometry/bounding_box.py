"""Bounding boxes of shapes, and lower bounds of distances from shapes to boxes; in plain numbers."""

from __future__ import annotations

import math
from typing import assert_never

from missionc.ir import Ball, Box, Difference, Disc, Intersection, Polygon, Shape, Union, Vector


def box_around(shape: Shape, dimension: int) -> tuple[Vector, Vector]:
    """Lowest and highest corner of a box that contains a shape, metres; infinite in height if the shape has no height
    range."""
    low, high = _bounds(shape)
    return low + (-math.inf,) * (dimension - len(low)), high + (math.inf,) * (dimension - len(high))


def gap(shape: Shape, low: Vector, high: Vector) -> float:
    """Lower bound of the distance between a shape and a box, metres; positive only if they are disjoint.

    Args:
        low: least coordinates of the box, metres.
        high: largest coordinates of the box, metres.
    """
    match shape:
        case Union(left, right):
            return min(gap(left, low, high), gap(right, low, high))
        case Intersection(left, right):
            return max(gap(left, low, high), gap(right, low, high))
        case Difference(left, _):
            return gap(left, low, high)
        case _:
            return between(box_around(shape, len(low)), (low, high))


def between(first: tuple[Vector, Vector], second: tuple[Vector, Vector]) -> float:
    """Distance between two boxes, metres, over the axes that both have.

    Each box is given by its lowest and its highest corner.
    """
    (low, high), (other_low, other_high) = first, second
    sides = zip(low, high, other_low, other_high, strict=False)
    return math.hypot(
        *(max(least - other_most, other_least - most, 0.0) for least, most, other_least, other_most in sides)
    )


def _bounds(shape: Shape) -> tuple[Vector, Vector]:
    match shape:
        case Box(low, high):
            return low, high
        case Disc(centre, radius, band):
            low, high = tuple(x - radius for x in centre), tuple(x + radius for x in centre)
            return (low, high) if band is None else ((*low, band.low), (*high, band.high))
        case Ball(centre, radius):
            return tuple(x - radius for x in centre), tuple(x + radius for x in centre)
        case Polygon(corners, band):
            low, high = tuple(map(min, *corners)), tuple(map(max, *corners))
            return (low, high) if band is None else ((*low, band.low), (*high, band.high))
        case Union(left, right):
            (low, high), (other_low, other_high) = _bounds(left), _bounds(right)
            return tuple(map(min, low, other_low)), tuple(map(max, high, other_high))
        case Intersection(left, right):
            (low, high), (other_low, other_high) = _bounds(left), _bounds(right)
            return tuple(map(max, low, other_low)), tuple(map(min, high, other_high))
        case Difference(left, _):
            return _bounds(left)
        case _:
            assert_never(shape)
