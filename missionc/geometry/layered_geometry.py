"""Areas as shapely geometries, one for each height layer, for queries that plain numbers do not decide.

An outer geometry contains at least the intended points, an inner geometry at most these. The border of a disc is off by
less than a thousandth of its radius. ``configuration_space`` loads this module at the first query that needs the
module.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import field
from typing import TypeAlias, assert_never

import numpy as np
import shapely
from numpy.typing import NDArray

from missionc.base.late_dataclass import Record
from missionc.base.trace import Array
from missionc.geometry.height_layers import QUARTER, WIDEN, Heights, cross_section, meets
from missionc.ir import Ball, Box, Difference, Disc, Intersection, Polygon, Prism, Shape, Union, Vector, World

Geometry: TypeAlias = NDArray[np.object_]
"""Plane geometry of a set in each height layer: (layers,)."""

SMOOTHED = 0.99
"""Factor on the growth of inner sets, because GEOS fills dents shallower than a hundredth of a buffer's width."""

CERTAIN = 1e-9
"""Amount by which a computed count may be below an integer because of rounding errors."""

NOWHERE = shapely.Polygon()


class Layers(Record, eq=False):
    """Height layers of a world, (layers, 2), metres, and the geometries of shapes in them."""

    world: World
    heights: Array
    known: dict[tuple[Shape, bool], Geometry] = field(default_factory=dict)

    @staticmethod
    def of_world(world: World, heights: Heights) -> Layers:
        return Layers(world, np.array(heights))

    def whole(self) -> Geometry:
        """Geometry of the whole world."""
        low, high = self.world.low, self.world.high
        return self._prism(shapely.box(low[0], low[1], high[0], high[1]), *self._heights_of_world(), outer=True)

    def half_space(self, weights: Vector, constant: float) -> Geometry:
        """Outer geometry of the world's positions that satisfy ``constant + weights · position >= 0``."""
        low, high = self.world.low, self.world.high
        corners = [(low[0], low[1]), (high[0], low[1]), (high[0], high[1]), (low[0], high[1])]
        area = self.whole()
        for layer, (bottom, top) in enumerate(self.heights):
            climb = max(weights[2] * bottom, weights[2] * top) if len(weights) == 3 else 0.0
            values = [constant + climb + weights[0] * x + weights[1] * y for x, y in corners]
            area[layer] = NOWHERE if area[layer].is_empty else _clipped(corners, values)
        return area

    def point(self, place: Vector) -> Geometry:
        height = place[2] if len(place) == 3 else 0.0
        return self._prism(shapely.Point(place[0], place[1]), height, height, outer=True)

    def grown(self, area: Geometry, distance: float, *, outer: bool) -> Geometry:
        """Positions within ``distance`` metres of an area, as an outer (``outer``) or inner geometry."""
        wide = _array([_buffered(part, distance * (WIDEN if outer else SMOOTHED)) for part in area])
        if self.world.dimension == 2 or not outer:
            return wide
        gaps = _gaps(self.heights)
        return _array([shapely.union_all(wide[gaps[layer] <= distance]) for layer in range(len(wide))])

    def shrunk(self, area: Geometry, distance: float) -> Geometry:
        """Outer geometry of the positions in an area at least ``distance`` metres from its border; heights are
        unchanged."""
        return _array([_buffered(part, -distance * SMOOTHED) for part in area])

    def size(self, area: Geometry, margin: float) -> float:
        """Upper bound of the size of an area grown by ``margin`` metres: square metres in a plane, cubic metres in a
        volume."""
        wide = self.grown(area, margin, outer=True)
        if self.world.dimension == 2:
            return float(shapely.area(wide[0]))
        thickness = self.heights[:, 1] - self.heights[:, 0]
        beyond = 2 * margin * shapely.area(shapely.union_all(wide))
        return float(np.sum(shapely.area(wide) * thickness) + beyond)

    def capacity(self, area: Geometry, spacing: float) -> int:
        """Upper bound of the number of points in an area with pairwise distances of at least ``spacing`` metres.

        Balls of half the spacing around the points do not overlap and lie in the area grown by half the spacing. In the
        plane, the area and the perimeter of each part's convex hull bound the number. An infinite result is not
        supported.

        Source:
            Oler, "An inequality in the geometry of numbers" (1961), for convex sets.
        """
        half = spacing / 2
        if self.world.dimension == 3:
            return math.floor(self.size(area, half) / (4 / 3 * math.pi * math.pow(half, 3)) + CERTAIN)
        return sum(_most_in(part, spacing) for part in shapely.get_parts(area[0]))

    def diameter(self, area: Geometry) -> float:
        """Upper bound of the distance between two points of an area, metres."""
        across = _diameter(shapely.convex_hull(shapely.union_all(area)))
        if self.empty(area):
            return 0.0
        there = self.heights[~shapely.is_empty(area)]
        climb = float(there[:, 1].max() - there[:, 0].min()) if self.world.dimension == 3 else 0.0
        return math.hypot(across, climb)

    def distance(self, first: Geometry, second: Geometry) -> float:
        """Upper bound of the least distance between two areas, metres; infinite if one is empty."""
        if self.world.dimension == 2:
            return _finite(shapely.distance(first[0], second[0]))
        gaps = _gaps(self.heights)
        across = shapely.distance(first[:, None], second[None, :])
        return float(np.min(np.where(np.isnan(across), math.inf, np.hypot(across, gaps))))

    def distances(self, vectors: Sequence[Vector], area: Geometry) -> list[float]:
        """Upper bounds of the distances from positions to an area, metres; infinite if the area is empty."""
        places = np.asarray(vectors, dtype=np.float64)
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
        return [float(distance) for distance in nearest]

    def holds(self, area: Geometry, vectors: Sequence[Vector]) -> list[bool]:
        """Return true for each position that is in an area, border included."""
        places = np.asarray(vectors, dtype=np.float64)
        inside = np.zeros(len(places), dtype=bool)
        points = shapely.points(places[:, :2])
        for geometry, (bottom, top) in zip(area, self.heights, strict=True):
            height = places[:, 2] if self.world.dimension == 3 else np.zeros(len(places))
            level = (height >= bottom) & (height <= top)
            inside |= level & shapely.covers(geometry, points)
        return [bool(held) for held in inside]

    def bounds(self, area: Geometry) -> tuple[Vector, Vector]:
        """Lowest and highest corner of a non-empty area's bounding box, metres."""
        if self.world.dimension == 2:
            west, south, east, north = area[0].bounds
            return (west, south), (east, north)
        west, south, east, north = shapely.total_bounds(area)
        there = self.heights[~shapely.is_empty(area)]
        return (west, south, float(there[:, 0].min())), (east, north, float(there[:, 1].max()))

    def empty(self, area: Geometry) -> bool:
        return bool(np.all(shapely.is_empty(area)))

    def disjoint(self, first: Geometry, second: Geometry) -> bool:
        """Return true if two areas, including their borders, have no common point."""
        if len(first) == 1:
            return bool(shapely.disjoint(first[0], second[0]))
        return bool(np.all(shapely.disjoint(first, second)))

    def covers(self, whole: Geometry, part: Geometry) -> bool:
        """Return true if every point of ``part`` is in ``whole``."""
        if len(whole) == 1:
            return bool(part[0].is_empty or shapely.covers(whole[0], part[0]))
        return bool(np.all(shapely.is_empty(part) | shapely.covers(whole, part)))

    def union(self, areas: list[Geometry]) -> Geometry:
        """Union of areas, layer by layer."""
        return _array([shapely.union_all([area[layer] for area in areas]) for layer in range(len(self.heights))])

    def common(self, first: Geometry, second: Geometry) -> Geometry:
        return _array(shapely.intersection(first, second))

    def without(self, area: Geometry, taken: Geometry) -> Geometry:
        """Area without the points of ``taken``; lines and single points in ``taken`` are ignored."""
        return _array(shapely.difference(area, taken))

    def _heights_of_world(self) -> tuple[float, float]:
        return (self.world.low[2], self.world.high[2]) if self.world.dimension == 3 else (-math.inf, math.inf)

    def of(self, shape: Shape, *, outer: bool) -> Geometry:
        if (shape, outer) not in self.known:
            self.known[shape, outer] = self._made(shape, outer=outer)
        return self.known[shape, outer]

    def _made(self, shape: Shape, *, outer: bool) -> Geometry:
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
                discs = [
                    cross_section(centre[2], radius, (low, high), outer=outer) for low, high in self.heights.tolist()
                ]
                return _array([_disc(centre, disc, outer=outer) if disc > 0 else NOWHERE for disc in discs])
            case Union(left, right):
                return _array(shapely.union(self.of(left, outer=outer), self.of(right, outer=outer)))
            case Intersection(left, right):
                return self.common(self.of(left, outer=outer), self.of(right, outer=outer))
            case Difference(left, right):
                return self.without(self.of(left, outer=outer), self.of(right, outer=not outer))
            case _:
                assert_never(shape)

    def _prism(self, base: shapely.Geometry, low: float, high: float, *, outer: bool) -> Geometry:
        layers = self.heights.tolist()
        if outer:
            within = [meets(low, high, (bottom, top)) for bottom, top in layers]
        else:
            within = [low <= bottom and high >= top for bottom, top in layers]
        return _array([base if there else NOWHERE for there in within])


def _diameter(hull: shapely.Geometry) -> float:
    corners = shapely.get_coordinates(hull)
    return float(np.linalg.norm(corners[:, None] - corners[None, :], axis=-1).max()) if len(corners) else 0.0


def _most_in(part: shapely.Geometry, spacing: float) -> int:
    """Upper bound of the number of points in a plane area with pairwise distances of at least ``spacing`` metres."""
    if part.is_empty:
        return 0
    hull = shapely.convex_hull(part)
    if _diameter(hull) < spacing:
        return 1
    border = hull.length if hull.area > 0 else 2 * hull.length
    by_hull = 2 / math.sqrt(3) * hull.area / spacing**2 + border / (2 * spacing) + 1
    by_discs = _buffered(part, spacing / 2 * WIDEN).area / (math.pi * spacing**2 / 4)
    return math.floor(min(float(by_hull), float(by_discs)) + CERTAIN)


def _disc(centre: Vector, radius: float, *, outer: bool) -> shapely.Geometry:
    return _buffered(shapely.Point(centre[0], centre[1]), radius * (WIDEN if outer else 1.0))


def _buffered(geometry: shapely.Geometry, distance: float) -> shapely.Geometry:
    return shapely.buffer(geometry, distance, quad_segs=QUARTER)


def _clipped(corners: list[tuple[float, float]], values: list[float]) -> shapely.Geometry:
    """Part of a convex polygon in which a linear function with these values at the corners is at least 0."""
    vertices: list[tuple[float, float]] = []
    for place, ((x, y), value) in enumerate(zip(corners, values, strict=True)):
        (x0, y0), before = corners[place - 1], values[place - 1]
        if (before < 0) != (value < 0):
            part = before / (before - value)
            vertices.append((x0 + part * (x - x0), y0 + part * (y - y0)))
        if value >= 0:
            vertices.append((x, y))
    return shapely.MultiPoint(vertices).convex_hull if vertices else NOWHERE


def _gaps(heights: Array) -> Array:
    """Vertical gaps between height layers: (layers, 2), metres -> (layers, layers), metres; 0 if layers overlap or
    touch."""
    bottom, top = heights[:, 0], heights[:, 1]
    return np.maximum(np.maximum(bottom[:, None] - top[None, :], bottom[None, :] - top[:, None]), 0.0)


def _finite(distance: float) -> float:
    return math.inf if math.isnan(distance) else float(distance)


def _array(geometries: Iterable[shapely.Geometry]) -> Geometry:
    """Object array of geometries; geometry collections, which numpy would unpack, stay single elements."""
    listed = list(geometries)
    area: Geometry = np.empty(len(listed), dtype=object)
    area[:] = listed
    return area
