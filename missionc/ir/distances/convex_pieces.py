"""Convex decomposition of shapes; along a straight line, the distance to one piece has a single minimum.

A piece is the intersection of its parts, and a shape is the union of its pieces. A part is a convex shape, a half
space, or the outside of a disc or a ball. Pieces include their borders: the border of a removed part remains.

Source:
    de Berg et al., "Computational Geometry" (2008), 6.1: a polygon cut into trapezoids at the heights of its corners.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import lru_cache
from itertools import pairwise
from typing import TypeAlias, assert_never

from missionc.base.late_dataclass import Record
from missionc.ir import Ball, Box, Difference, Disc, Intersection, Polygon, Prism, Shape, Union, Vector

Corners: TypeAlias = tuple[tuple[float, float], ...]


class HalfSpace(Record):
    """Half space of the points whose inner product with the unit vector ``normal`` is at most ``offset`` metres.

    The normal has one entry for each of the first coordinates; further coordinates are free.
    """

    normal: Vector
    offset: float


class Outside(Record):
    """Outside of a disc or ball: the points at least ``radius`` metres away from ``centre``.

    A centre with two coordinates in a volume is the axis of an upright cylinder.
    """

    centre: Vector
    radius: float


Part: TypeAlias = "Box | Disc | Ball | Polygon | HalfSpace | Outside"
Piece: TypeAlias = tuple[Part, ...]
Pieces: TypeAlias = tuple[Piece, ...]


@lru_cache(maxsize=1024)
def pieces(shape: Shape) -> Pieces:
    """Convex pieces whose union is the shape."""
    match shape:
        case Box() | Disc() | Ball():
            return ((shape,),)
        case Polygon(corners, band):
            if _is_convex(corners):
                return ((shape,),)
            return tuple((Polygon(each, band),) for each in _trapezoids(corners, inside=True))
        case Union(left, right):
            return pieces(left) + pieces(right)
        case Intersection(left, right):
            return _common(pieces(left), pieces(right))
        case Difference(left, right):
            return _common(pieces(left), _pieces_around(right))
        case _:
            assert_never(shape)


def count_pieces(shape: Shape) -> tuple[int, int]:
    """Numbers of convex pieces of a shape and of its complement, counted without the pieces of combined shapes."""
    match shape:
        case Box() | Disc() | Ball() | Polygon():
            return len(pieces(shape)), len(_pieces_around(shape))
        case Union(left, right):
            (of_left, around_left), (of_right, around_right) = count_pieces(left), count_pieces(right)
            return of_left + of_right, around_left * around_right
        case Intersection(left, right):
            (of_left, around_left), (of_right, around_right) = count_pieces(left), count_pieces(right)
            return of_left * of_right, around_left + around_right
        case Difference(left, right):
            (of_left, around_left), (of_right, around_right) = count_pieces(left), count_pieces(right)
            return of_left * around_right, around_left + of_right
        case _:
            assert_never(shape)


@lru_cache(maxsize=1024)
def outer_half_spaces(shape: Shape) -> tuple[HalfSpace, ...]:
    """Half spaces whose union is the complement of a convex polyhedron with its border; empty for any other shape.

    The depth of a point inside the polyhedron is its least distance from the half spaces.
    """
    around = _pieces_around(shape)
    found = tuple(piece[0] for piece in around if len(piece) == 1 and isinstance(piece[0], HalfSpace))
    return found if len(found) == len(around) else ()


def _common(left: Pieces, right: Pieces) -> Pieces:
    return tuple(one + other for one in left for other in right)


@lru_cache(maxsize=1024)
def _pieces_around(shape: Shape) -> Pieces:
    """Convex pieces of the complement of a shape, including the border."""
    match shape:
        case Box(low, high):
            return tuple((side,) for axis in range(len(low)) for side in _beyond(axis, low[axis], high[axis]))
        case Disc(centre, radius, band):
            return ((Outside(centre[:2], radius),), *_above_and_below(band))
        case Ball(centre, radius):
            return ((Outside(centre, radius),),)
        case Polygon(corners, band):
            return (*_around_polygon(corners), *_above_and_below(band))
        case Union(left, right):
            return _common(_pieces_around(left), _pieces_around(right))
        case Intersection(left, right):
            return _pieces_around(left) + _pieces_around(right)
        case Difference(left, right):
            return _pieces_around(left) + pieces(right)
        case _:
            assert_never(shape)


def _beyond(axis: int, low: float, high: float) -> tuple[HalfSpace, HalfSpace]:
    """Two half spaces along one axis: coordinate at most ``low``, and coordinate at least ``high``."""
    normal = tuple(float(each == axis) for each in range(axis + 1))
    return HalfSpace(normal, low), HalfSpace(tuple(-each for each in normal), -high)


def _above_and_below(band: Prism | None) -> Pieces:
    return () if band is None else tuple((side,) for side in _beyond(2, band.low, band.high))


# ------------------------------------------------------------------- polygons


def _is_convex(corners: Corners) -> bool:
    turns = [
        (bx - ax) * (cy - by) - (by - ay) * (cx - bx)
        for (ax, ay), (bx, by), (cx, cy) in zip(
            corners, corners[1:] + corners[:1], corners[2:] + corners[:2], strict=True
        )
    ]
    return all(turn >= 0 for turn in turns) or all(turn <= 0 for turn in turns)


def _around_polygon(corners: Corners) -> Iterator[Piece]:
    heights = [y for _, y in corners]
    if _is_convex(corners):
        area = sum(ax * by - ay * bx for (ax, ay), (bx, by) in pairwise((*corners, corners[0])))
        yield from (
            (_right_of(here, there) if area > 0 else _right_of(there, here),)
            for here, there in pairwise((*corners, corners[0]))
            if here != there
        )
        return
    yield from ((side,) for side in _beyond(1, min(heights), max(heights)))
    yield from ((Polygon(each),) for each in _trapezoids(corners, inside=False))
    for low, high, sides in _slabs(corners):
        if not sides:
            continue
        _, above = _beyond(1, low, low)
        below, _ = _beyond(1, high, high)
        (left, right), (left_up, right_up) = (sides[0][0], sides[-1][0]), (sides[0][1], sides[-1][1])
        yield above, below, _right_of((left_up, high), (left, low))
        yield above, below, _right_of((right, low), (right_up, high))


def _right_of(here: tuple[float, float], there: tuple[float, float]) -> HalfSpace:
    """Half plane to the right of the line from ``here`` to ``there``, including the line."""
    dx, dy = there[0] - here[0], there[1] - here[1]
    length = math.hypot(dx, dy) or 1.0
    normal = (-dy / length, dx / length)
    return HalfSpace(normal, normal[0] * here[0] + normal[1] * here[1])


def _slabs(corners: Corners) -> Iterator[tuple[float, float, list[tuple[float, float]]]]:
    """Horizontal bands of a polygon between consecutive corner heights, from below.

    Yields the lower and the upper height, and the x at both heights of each side that crosses the band, sorted.
    """
    sides = [(here, there) for here, there in pairwise((*corners, corners[0])) if here[1] != there[1]]
    for low, high in pairwise(sorted({y for _, y in corners})):
        across = [side for side in sides if min(side[0][1], side[1][1]) <= low and max(side[0][1], side[1][1]) >= high]
        yield low, high, sorted(((_x_at(side, low), _x_at(side, high)) for side in across), key=sum)


def _x_at(side: tuple[tuple[float, float], tuple[float, float]], height: float) -> float:
    (ax, ay), (bx, by) = side
    return ax if height == ay else bx if height == by else ax + (height - ay) / (by - ay) * (bx - ax)


def _trapezoids(corners: Corners, *, inside: bool) -> Iterator[Corners]:
    """Trapezoids whose union is a polygon, or if not ``inside``, the gaps between its parts at each height."""
    for low, high, sides in _slabs(corners):
        for (left, left_up), (right, right_up) in list(pairwise(sides))[0 if inside else 1 :: 2]:
            yield tuple(dict.fromkeys(((left, low), (right, low), (right_up, high), (left_up, high))))
