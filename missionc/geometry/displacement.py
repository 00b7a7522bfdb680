"""Displacement of moving obstacles at a time, and translated shapes; in plain numbers."""

from __future__ import annotations

from bisect import bisect_right
from typing import assert_never

from missionc.ir import Ball, Box, Difference, Disc, Intersection, Obstacle, Path, Polygon, Prism, Shape, Union, Vector


def displaced(obstacle: Obstacle, time: float, dimension: int) -> Vector:
    """Displacement of an obstacle from its initial position at a time in seconds: (dim,), metres."""
    if isinstance(obstacle.motion, Path):
        return offset(obstacle.motion, time, dimension)
    return (0.0,) * dimension


def offset(path: Path, time: float, dimension: int) -> Vector:
    """Offset of a path, interpolated between its waypoints, at a time in seconds: (dim,), metres."""
    after = bisect_right(path.times, time)
    if after in (0, len(path.times)):
        there = path.offsets[max(after - 1, 0)]
    else:
        begin, end = path.times[after - 1], path.times[after]
        pairs = zip(path.offsets[after - 1], path.offsets[after], strict=True)
        there = tuple((last - first) / (end - begin) * (time - begin) + first for first, last in pairs)
    return (*map(float, there), *(0.0,) * (dimension - len(there)))


def moved(shape: Shape, by: Vector) -> Shape:
    """Shape translated by an offset, (dim,), metres."""
    match shape:
        case Box(low, high):
            return Box(_shifted(low, by), _shifted(high, by))
        case Disc(centre, radius, band):
            return Disc(_shifted(centre, by), radius, _raised(band, by))
        case Ball(centre, radius):
            return Ball(_shifted(centre, by), radius)
        case Polygon(corners, band):
            return Polygon(tuple((x + by[0], y + by[1]) for x, y in corners), _raised(band, by))
        case Union(left, right):
            return Union(moved(left, by), moved(right, by))
        case Intersection(left, right):
            return Intersection(moved(left, by), moved(right, by))
        case Difference(left, right):
            return Difference(moved(left, by), moved(right, by))
        case _:
            assert_never(shape)


def _shifted(point: Vector, by: Vector) -> Vector:
    return tuple(value + by[axis] for axis, value in enumerate(point))


def _raised(band: Prism | None, by: Vector) -> Prism | None:
    return Prism(band.low + by[2], band.high + by[2]) if band and len(by) == 3 else band
