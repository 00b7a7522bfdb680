"""Growth of shapes on all sides: a shape that contains every point within a distance of another shape.

The result is exact for a disc, a ball and a polygon. A grown box keeps its corners instead of rounding them. The
removed part of a difference does not shrink.

Source:
    de Berg et al., "Computational Geometry" (2008), section 13.3, Minkowski sums with a disc.
"""

from __future__ import annotations

import math
from typing import assert_never

from missionc.ir import Ball, Box, Difference, Disc, Intersection, Polygon, Prism, Shape, Union


def grown_shape(shape: Shape, by: float) -> Shape:
    """Shape grown by ``by`` metres (at least 0) on all sides."""
    match shape:
        case Box(low, high):
            return Box(tuple(value - by for value in low), tuple(value + by for value in high))
        case Disc(centre, radius, band):
            return Disc(centre, radius + by, _taller(band, by))
        case Ball(centre, radius):
            return Ball(centre, radius + by)
        case Polygon():
            return _polygon(shape, by)
        case Union(left, right):
            return Union(grown_shape(left, by), grown_shape(right, by))
        case Intersection(left, right):
            return Intersection(grown_shape(left, by), grown_shape(right, by))
        case Difference(left, _):
            return grown_shape(left, by)
        case _:
            assert_never(shape)


def _taller(band: Prism | None, by: float) -> Prism | None:
    return None if band is None else Prism(band.low - by, band.high + by)


def _polygon(shape: Polygon, by: float) -> Shape:
    """Grown polygon: the union of the polygon, a strip along each edge, and a disc around each corner."""
    band = _taller(shape.band, by)
    parts: list[Shape] = [Polygon(shape.corners, band)]
    for (x, y), (other_x, other_y) in zip(shape.corners, (*shape.corners[1:], shape.corners[0]), strict=True):
        length = math.hypot(other_x - x, other_y - y)
        parts.append(Disc((x, y), by, band))
        if length > 0:
            aside, up = -(other_y - y) / length * by, (other_x - x) / length * by
            strip = (
                (x - aside, y - up),
                (other_x - aside, other_y - up),
                (other_x + aside, other_y + up),
                (x + aside, y + up),
            )
            parts.append(Polygon(strip, band))
    return _joined(parts)


def _joined(parts: list[Shape]) -> Shape:
    """Union of shapes as a balanced binary tree."""
    if len(parts) == 1:
        return parts[0]
    middle = len(parts) // 2
    return Union(_joined(parts[:middle]), _joined(parts[middle:]))
