"""Sets of places an agent's centre may or may not be in, between an inner and an outer bound.

Every set is cut into layers of height (one in a plane), each with a plane
geometry: in a volume the heights at which some shape begins or ends, and the
open layers between them, so that prisms are exact and balls nearly. An *outer* set
holds at least the points meant, an *inner* one at most, so that whoever says
"impossible" from disjoint outer sets, or from an outer set within an inner
one, is right; a disc's border is off by less than a thousandth of its radius.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import lru_cache
from itertools import pairwise
from typing import TypeAlias, assert_never

import numpy as np
import shapely
from numpy.typing import NDArray

from missionc.base.recent_cache import Recent
from missionc.base.trace import Array, Flags
from missionc.ir import Ball, Box, Difference, Disc, Intersection, Polygon, Prism, Shape, Union, Vector, World

Area: TypeAlias = NDArray[np.object_]
"""(layers,): the geometry of a set in each layer of height."""

QUARTER = 32
"""Straight pieces that stand for a quarter of a circle."""

WIDEN = 1 / math.cos(math.pi / (4 * QUARTER))
"""How much larger a regular polygon around a circle is than the one within."""

SMOOTHED = 0.99
"""GEOS fills dents shallower than a hundredth of a buffer's width, so inner sets are grown by that much less."""

BALL_LAYERS = 8
MOST_LEVELS = 32

NOWHERE = shapely.Polygon()


@dataclass(frozen=True, slots=True, eq=False)
class Atlas:
    """The layers of a world, and the areas of shapes in them. ``heights``: (layers, 2), metres; infinite in a plane."""

    world: World
    heights: Array
    known: Recent[tuple[Shape, bool], Area] = field(default_factory=Recent)

    @staticmethod
    def of(world: World, shapes: Iterable[Shape]) -> Atlas:
        if world.dimension == 2:
            return Atlas(world, np.array([[-math.inf, math.inf]]))
        levels = sorted({world.low[2], world.high[2], *(level for shape in shapes for level in _levels(shape))})
        if len(levels) > MOST_LEVELS:
            kept = np.linspace(0, len(levels) - 1, MOST_LEVELS).astype(int)
            levels = [levels[place] for place in kept]
        between = [*((level, level) for level in levels), *pairwise(levels)]
        return Atlas(world, np.array(sorted(between)))

    def alike(self, other: Atlas) -> bool:
        """Whether the other has the same layers of the same world."""
        corners = (self.world.low, self.world.high) == (other.world.low, other.world.high)
        return corners and np.array_equal(self.heights, other.heights)

    def outer(self, shape: Shape) -> Area:
        """At least the points of the shape."""
        return self._area(shape, outer=True)

    def inner(self, shape: Shape) -> Area:
        """At most the points of the shape."""
        return self._area(shape, outer=False)

    def whole(self) -> Area:
        """The world."""
        low, high = self.world.low, self.world.high
        return self._prism(shapely.box(low[0], low[1], high[0], high[1]), *self._heights_of_world(), outer=True)

    def half_space(self, weights: Vector, constant: float) -> Area:
        """The places of the world, and some beside it, with ``constant + weights · place >= 0``, at least."""
        low, high = self.world.low, self.world.high
        corners = [(low[0], low[1]), (high[0], low[1]), (high[0], high[1]), (low[0], high[1])]
        area = self.whole()
        for layer, (bottom, top) in enumerate(self.heights):
            climb = max(weights[2] * bottom, weights[2] * top) if len(weights) == 3 else 0.0
            values = [constant + climb + weights[0] * x + weights[1] * y for x, y in corners]
            area[layer] = NOWHERE if area[layer].is_empty else _clipped(corners, values)
        return area

    def point(self, place: Vector) -> Area:
        height = place[2] if len(place) == 3 else 0.0
        return self._prism(shapely.Point(place[0], place[1]), height, height, outer=True)

    def grown(self, area: Area, distance: float, *, outer: bool) -> Area:
        """The places within a distance of an area, at least (``outer``) or at most."""
        wide = _array([_buffered(part, distance * (WIDEN if outer else SMOOTHED)) for part in area])
        if self.world.dimension == 2 or not outer:
            return wide
        gaps = _gaps(self.heights)
        return _array([shapely.union_all(wide[gaps[layer] <= distance]) for layer in range(len(wide))])

    def near(self, shape: Shape, distance: float, *, outer: bool) -> Area:
        """The places within a distance of a shape, at least (``outer``) or at most; those of a ball are a ball."""
        if isinstance(shape, Ball):
            return self._area(Ball(shape.centre, shape.radius + distance), outer=outer)
        return self.grown(self._area(shape, outer=outer), distance, outer=outer)

    def shrunk(self, area: Area, distance: float) -> Area:
        """The places of an area that are at least so far from its border, at least (heights are left as they are)."""
        return _array([_buffered(part, -distance * SMOOTHED) for part in area])

    def size(self, area: Area, margin: float) -> float:
        """Square (cubic) metres of the area grown by a margin, at most."""
        wide = self.grown(area, margin, outer=True)
        if self.world.dimension == 2:
            return float(shapely.area(wide[0]))
        thickness = self.heights[:, 1] - self.heights[:, 0]
        beyond = 2 * margin * shapely.area(shapely.union_all(wide))
        return float(np.sum(shapely.area(wide) * thickness) + beyond)

    def distance(self, first: Area, second: Area) -> float:
        """Between the nearest points of two areas, at most; infinite where one is empty."""
        if self.world.dimension == 2:
            return _finite(shapely.distance(first[0], second[0]))
        gaps = _gaps(self.heights)
        across = shapely.distance(first[:, None], second[None, :])
        return float(np.min(np.where(np.isnan(across), math.inf, np.hypot(across, gaps))))

    def distances(self, places: Array, area: Area) -> Array:
        """From places, (places, dim), to an area, at most: (places,), metres."""
        points = shapely.points(places[:, :2])
        nearest = np.full(len(places), math.inf)
        for geometry, (bottom, top) in zip(area, self.heights, strict=True):
            if geometry.is_empty:
                continue
            across = shapely.distance(points, geometry)
            if self.world.dimension == 3:
                climb = np.maximum(np.maximum(bottom - places[:, 2], places[:, 2] - top), 0.0)
                across = np.hypot(across, climb)
            nearest = np.minimum(nearest, across)
        return nearest

    def holds(self, area: Area, places: Array) -> list[bool]:
        """Which places, (places, dim), are in an area, its border included."""
        inside = np.zeros(len(places), dtype=bool)
        points = shapely.points(places[:, :2])
        for geometry, (bottom, top) in zip(area, self.heights, strict=True):
            height = places[:, 2] if self.world.dimension == 3 else np.zeros(len(places))
            level = (height >= bottom) & (height <= top)
            inside |= level & shapely.covers(geometry, points)
        return [bool(held) for held in inside]

    def bounds(self, area: Area) -> tuple[Vector, Vector]:
        """The least and the largest coordinates of an area that is not empty."""
        if self.world.dimension == 2:
            west, south, east, north = area[0].bounds
            return (west, south), (east, north)
        west, south, east, north = shapely.total_bounds(area)
        there = self.heights[~shapely.is_empty(area)]
        return (west, south, float(there[:, 0].min())), (east, north, float(there[:, 1].max()))

    def _heights_of_world(self) -> tuple[float, float]:
        return (self.world.low[2], self.world.high[2]) if self.world.dimension == 3 else (-math.inf, math.inf)

    def _area(self, shape: Shape, *, outer: bool) -> Area:
        return self.known.of((shape, outer), lambda: self._made(shape, outer=outer))

    def _made(self, shape: Shape, *, outer: bool) -> Area:
        everywhere = Prism(-math.inf, math.inf)
        match shape:
            case Box(low, high):
                band = Prism(low[2], high[2]) if len(low) == 3 else everywhere
                return self._prism(shapely.box(low[0], low[1], high[0], high[1]), band.low, band.high, outer=outer)
            case Disc(centre, radius, band):
                band = band or everywhere
                return self._prism(_disc(centre, radius, outer=outer), band.low, band.high, outer=outer)
            case Polygon(corners, band):
                band = band or everywhere
                return self._prism(shapely.Polygon(corners), band.low, band.high, outer=outer)
            case Ball(centre, radius):
                return _array([_slice(centre, radius, *layer, outer=outer) for layer in self.heights])
            case Union(left, right):
                return _array(shapely.union(self._area(left, outer=outer), self._area(right, outer=outer)))
            case Intersection(left, right):
                return _array(shapely.intersection(self._area(left, outer=outer), self._area(right, outer=outer)))
            case Difference(left, right):
                return _array(shapely.difference(self._area(left, outer=outer), self._area(right, outer=not outer)))
            case _:
                assert_never(shape)

    def _prism(self, base: shapely.Geometry, low: float, high: float, *, outer: bool) -> Area:
        bottom, top = self.heights[:, 0], self.heights[:, 1]
        within: Flags
        if self.world.dimension == 2:
            within = np.array([True])
        elif outer:
            within = np.where(bottom == top, (low <= top) & (high >= bottom), (low < top) & (high > bottom))
        else:
            within = (low <= bottom) & (high >= top)
        return _array([base if there else NOWHERE for there in within])


def empty(area: Area) -> bool:
    return bool(np.all(shapely.is_empty(area)))


def disjoint(first: Area, second: Area) -> bool:
    """Whether two areas have no point in common, borders included."""
    if len(first) == 1:
        return bool(shapely.disjoint(first[0], second[0]))
    return bool(np.all(shapely.disjoint(first, second)))


def covers(whole: Area, part: Area) -> bool:
    """Whether every point of the part is in the whole."""
    if len(whole) == 1:
        return bool(part[0].is_empty or shapely.covers(whole[0], part[0]))
    return bool(np.all(shapely.is_empty(part) | shapely.covers(whole, part)))


def union(areas: list[Area], layers: int) -> Area:
    """The points of all areas."""
    return _array([shapely.union_all([area[layer] for area in areas]) for layer in range(layers)])


def common(first: Area, second: Area) -> Area:
    return _array(shapely.intersection(first, second))


def without(area: Area, taken: Area) -> Area:
    """The area less the points of another, but for lines and single points."""
    return _array(shapely.difference(area, taken))


def moved(shape: Shape, by: Array) -> Shape:
    """The shape shifted by an offset, (dim,), metres."""
    match shape:
        case Box(low, high):
            return Box(_shifted(low, by), _shifted(high, by))
        case Disc(centre, radius, band):
            return Disc(_shifted(centre, by), radius, _raised(band, by))
        case Ball(centre, radius):
            return Ball(_shifted(centre, by), radius)
        case Polygon(corners, band):
            return Polygon(tuple((x + float(by[0]), y + float(by[1])) for x, y in corners), _raised(band, by))
        case Union(left, right):
            return Union(moved(left, by), moved(right, by))
        case Intersection(left, right):
            return Intersection(moved(left, by), moved(right, by))
        case Difference(left, right):
            return Difference(moved(left, by), moved(right, by))
        case _:
            assert_never(shape)


def _shifted(point: Vector, by: Array) -> Vector:
    return tuple(value + float(by[axis]) for axis, value in enumerate(point))


def _raised(band: Prism | None, by: Array) -> Prism | None:
    return Prism(band.low + float(by[2]), band.high + float(by[2])) if band and len(by) == 3 else band


def _levels(shape: Shape) -> list[float]:
    """The heights at which the shape's cross-section begins, ends or (of a ball) is taken anew."""
    match shape:
        case Box(low, high):
            return [low[2], high[2]] if len(low) == 3 else []
        case Disc(_, _, band) | Polygon(_, band):
            return [band.low, band.high] if band else []
        case Ball(centre, radius):
            return list(np.linspace(centre[2] - radius, centre[2] + radius, BALL_LAYERS + 1))
        case Union(left, right) | Intersection(left, right) | Difference(left, right):
            return _levels(left) + _levels(right)
        case _:
            assert_never(shape)


def _disc(centre: Vector, radius: float, *, outer: bool) -> shapely.Geometry:
    return _buffered(shapely.Point(centre[0], centre[1]), radius * (WIDEN if outer else 1.0))


@lru_cache(maxsize=8192)
def _buffered(geometry: shapely.Geometry, distance: float) -> shapely.Geometry:
    """Kept from one mission to the next: an editor checks the same shapes at every key."""
    return shapely.buffer(geometry, distance, quad_segs=QUARTER)


def _slice(centre: Vector, radius: float, bottom: float, top: float, *, outer: bool) -> shapely.Geometry:
    """The widest (``outer``) or the narrowest cross-section of a ball in a layer."""
    nearest = min(max(centre[2], bottom), top) - centre[2]
    farthest = max(abs(bottom - centre[2]), abs(top - centre[2]))
    square = radius**2 - (nearest**2 if outer else farthest**2)
    return _disc(centre, math.sqrt(square), outer=outer) if square > 0 else NOWHERE


def _clipped(corners: list[tuple[float, float]], values: list[float]) -> shapely.Geometry:
    """The part of a convex polygon where the values, linear between the corners, are at least 0."""
    kept: list[tuple[float, float]] = []
    for place, ((x, y), value) in enumerate(zip(corners, values, strict=True)):
        (x0, y0), before = corners[place - 1], values[place - 1]
        if (before < 0) != (value < 0):
            part = before / (before - value)
            kept.append((x0 + part * (x - x0), y0 + part * (y - y0)))
        if value >= 0:
            kept.append((x, y))
    return shapely.MultiPoint(kept).convex_hull if kept else NOWHERE


def _gaps(heights: Array) -> Array:
    """(layers, layers), metres: how far apart in height two layers are."""
    bottom, top = heights[:, 0], heights[:, 1]
    return np.maximum(np.maximum(bottom[:, None] - top[None, :], bottom[None, :] - top[:, None]), 0.0)


def _finite(distance: float) -> float:
    return math.inf if math.isnan(distance) else float(distance)


def _array(geometries: Iterable[shapely.Geometry]) -> Area:
    """An array of objects, whatever the geometries are (numpy would unpack collections)."""
    listed = list(geometries)
    area: Area = np.empty(len(listed), dtype=object)
    area[:] = listed
    return area
