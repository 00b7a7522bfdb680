"""Exact distance of points to an obstacle's body, also for combined shapes.

Plain shapes and their unions have an exact distance already. The distance to an intersection or a difference is
measured to its outline: the remaining segments of its parts' boundaries, cut at their crossings. Parts without
thickness are ignored: a door as deep as its wall leaves no film behind.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import pairwise
from typing import TypeAlias, assert_never

import numpy as np

from missionc.base.late_dataclass import Record
from missionc.base.trace import Array
from missionc.ir import Ball, Box, Difference, Disc, Intersection, Polygon, Prism, Shape, Union
from missionc.ir.distances.signed_distance import signed_distance

Distance: TypeAlias = Callable[[Array], Array]
"""Function from points (..., dim), metres, to distances (...), metres, negative inside the body and 1-Lipschitz."""

THIN = 1e-7
"""Thickness in metres below which a part of a body has no interior."""


def solid(shape: Shape, dimension: int) -> Distance:
    """Distance function of a body; the rounded rim of a ball that another shape cuts is not modelled."""
    match shape:
        case Box() | Disc() | Ball() | Polygon():
            return lambda position: np.asarray(signed_distance(np, shape, position))
        case Union(left, right):
            first, second = solid(left, dimension), solid(right, dimension)
            return lambda position: np.minimum(first(position), second(position))
        case Intersection() | Difference():
            if dimension == 2:
                return _outline(shape)
            if any(isinstance(leaf, Ball) for leaf in _leaves(shape)):
                return lambda position: np.asarray(signed_distance(np, shape, position))
            return _stack(shape)
        case _:
            assert_never(shape)


# -------------------------------------------------------------- in the plane


class _Segment(Record):
    start: complex
    end: complex

    def at(self, share: float) -> complex:
        return self.start + share * (self.end - self.start)

    def side(self, share: float) -> complex:
        return 1j * (self.end - self.start) / abs(self.end - self.start)

    def share(self, point: complex) -> float:
        along = self.end - self.start
        return ((point - self.start) * along.conjugate()).real / abs(along) ** 2

    def part(self, low: float, high: float) -> _Segment:
        return _Segment(self.at(low), self.at(high))

    def distance(self, points: Array) -> Array:
        along = self.end - self.start
        share = np.clip(((points - self.start) * along.conjugate()).real / abs(along) ** 2, 0.0, 1.0)
        return np.asarray(np.abs(points - self.start - share * along))


class _Arc(Record):
    """Circular arc, anticlockwise from the direction ``angle`` through ``sweep``, rad."""

    centre: complex
    radius: float
    angle: float
    sweep: float

    def at(self, share: float) -> complex:
        angle = self.angle + share * self.sweep
        return self.centre + self.radius * complex(math.cos(angle), math.sin(angle))

    def side(self, share: float) -> complex:
        return (self.at(share) - self.centre) / self.radius

    def share(self, point: complex) -> float:
        offset = point - self.centre
        return ((math.atan2(offset.imag, offset.real) - self.angle) % (2 * math.pi)) / self.sweep

    def part(self, low: float, high: float) -> _Arc:
        return _Arc(self.centre, self.radius, self.angle + low * self.sweep, (high - low) * self.sweep)

    def distance(self, points: Array) -> Array:
        offset = points - self.centre
        within = (np.angle(offset) - self.angle) % (2 * math.pi) <= self.sweep
        ends = np.minimum(np.abs(points - self.at(0.0)), np.abs(points - self.at(1.0)))
        return np.asarray(np.where(within, np.abs(np.abs(offset) - self.radius), ends))


def _outline(shape: Shape) -> Distance:
    edges = [edge for leaf in _leaves(shape) for edge in _edges(leaf)]
    pieces = []
    for edge in edges:
        shares = sorted(share for other in edges for point in _meetings(edge, other) for share in [edge.share(point)])
        cuts = [0.0, *(share for share in shares if 0.0 < share < 1.0), 1.0]
        for low, high in pairwise(cuts):
            if high - low > 1e-12 and _parts_inside_from_outside(shape, edge, (low + high) / 2):
                pieces.append(edge.part(low, high))

    def distance(position: Array) -> Array:
        points = position[..., 0] + 1j * position[..., 1]
        nearest = np.full(points.shape, np.inf)
        for piece in pieces:
            nearest = np.minimum(nearest, piece.distance(points))
        inside = np.asarray(signed_distance(np, shape, position)) < 0
        return np.where(inside, -nearest, nearest)

    return distance


def _parts_inside_from_outside(shape: Shape, edge: _Segment | _Arc, share: float) -> bool:
    """Return whether the body is on exactly one side of the edge, at the fraction ``share`` of its length."""
    middle, step = edge.at(share), edge.side(share) * THIN
    points = np.array([[(middle + sign * step).real, (middle + sign * step).imag] for sign in (-1, 1)])
    left, right = np.asarray(signed_distance(np, shape, points)) < 0
    return bool(left != right)


def _leaves(shape: Shape) -> list[Box | Disc | Ball | Polygon]:
    match shape:
        case Union(left, right) | Intersection(left, right) | Difference(left, right):
            return _leaves(left) + _leaves(right)
        case _:
            return [shape]


def _edges(leaf: Box | Disc | Ball | Polygon) -> list[_Segment | _Arc]:
    match leaf:
        case Box(low, high):
            west, south, east, north = *low[:2], *high[:2]
            corners = [complex(west, south), complex(east, south), complex(east, north), complex(west, north)]
        case Polygon(points):
            corners = [complex(x, y) for x, y in points]
        case Disc(centre, radius) | Ball(centre, radius):
            return [_Arc(complex(centre[0], centre[1]), radius, 0.0, 2 * math.pi)]
        case _:
            assert_never(leaf)
    return [_Segment(start, end) for start, end in pairwise([*corners, corners[0]]) if start != end]


def _meetings(edge: _Segment | _Arc, other: _Segment | _Arc) -> list[complex]:
    """Points at which two edges may cross or meet; a superfluous point only splits an edge."""
    match edge, other:
        case _Segment(), _Segment():
            along, across = edge.end - edge.start, other.end - other.start
            turn = (along.conjugate() * across).imag
            if abs(turn) <= 1e-12 * abs(along) * abs(across):
                return [other.start, other.end]
            return [edge.at((((other.start - edge.start).conjugate() * across).imag) / turn)]
        case _Segment(), _Arc():
            return _line_and_circle(edge, other)
        case _Arc(), _Segment():
            return _line_and_circle(other, edge)
        case _Arc(), _Arc():
            apart = other.centre - edge.centre
            if abs(apart) == 0:
                return []
            along = (abs(apart) ** 2 + edge.radius**2 - other.radius**2) / (2 * abs(apart))
            height = math.sqrt(max(0.0, edge.radius**2 - along**2))
            unit = apart / abs(apart)
            return [edge.centre + unit * complex(along, sign * height) for sign in (-1, 1)]
        case _:
            raise AssertionError(edge, other)


def _line_and_circle(line: _Segment, circle: _Arc) -> list[complex]:
    foot = line.at(line.share(circle.centre))
    half = math.sqrt(max(0.0, circle.radius**2 - abs(foot - circle.centre) ** 2))
    unit = (line.end - line.start) / abs(line.end - line.start)
    return [foot - half * unit, foot + half * unit]


# --------------------------------------------------------------- in a volume


def _stack(shape: Shape) -> Distance:
    """Distance function of a body composed of prisms only.

    Between two heights of the prisms the horizontal section is constant, so the nearest such slab decides.
    """
    levels = sorted({level for leaf in _leaves(shape) for level in _band(leaf)})
    slabs = []
    for low, high in pairwise(levels):
        section = _section(shape, (low + high) / 2 if math.isfinite(low + high) else max(low, min(high, 0.0)))
        if section is not None:
            slabs.append((low, high, solid(section, 2)))

    def distance(position: Array) -> Array:
        nearest = np.full(position.shape[:-1], np.inf)
        for low, high, flat in slabs:
            across = flat(position[..., :2])
            climb = np.maximum(low - position[..., 2], position[..., 2] - high)
            outside = np.hypot(np.maximum(across, 0.0), np.maximum(climb, 0.0))
            nearest = np.minimum(nearest, np.where((across < 0) & (climb < 0), np.maximum(across, climb), outside))
        return nearest

    return distance


def _band(leaf: Box | Disc | Ball | Polygon) -> tuple[float, float]:
    match leaf:
        case Box(low, high):
            return low[2], high[2]
        case Disc(band=Prism(low, high)) | Polygon(band=Prism(low, high)):
            return low, high
        case _:
            return -math.inf, math.inf


def _section(shape: Shape, height: float) -> Shape | None:
    """Horizontal section of the shape at a height in metres; None if the section is empty."""
    match shape:
        case Union(left, right) | Intersection(left, right) | Difference(left, right):
            first, second = _section(left, height), _section(right, height)
            if first is None:
                return second if isinstance(shape, Union) else None
            if second is None:
                return None if isinstance(shape, Intersection) else first
            return type(shape)(first, second)
        case Box(low, high):
            return Box(low[:2], high[:2]) if low[2] <= height <= high[2] else None
        case Disc(centre, radius):
            low_height, high_height = _band(shape)
            return Disc(centre, radius) if low_height <= height <= high_height else None
        case Polygon(corners):
            low_height, high_height = _band(shape)
            return Polygon(corners) if low_height <= height <= high_height else None
        case Ball():
            raise AssertionError("balls are not stacked")
        case _:
            assert_never(shape)
