"""Configuration space: sets of allowed or forbidden positions of agent centres, with inner and outer bounds.

An *outer* set contains at least the intended points, an *inner* set at most these. Infeasibility is therefore proved if
outer sets are disjoint, or if an outer set lies within an inner set.

Most queries about areas have a simple proof by a witness: two areas meet because one point is certainly in both. Plain
numbers at single points find a witness. Only if they find no witness, the geometry (``layered_geometry``) decides; its
library is loaded and its shapes are made at the first such query. An answer from plain numbers follows from the
definition of outer and inner sets, so the geometry would give the same answer.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import cache
from itertools import chain, product
from typing import TYPE_CHECKING, TypeAlias, assert_never

from missionc.base.late_dataclass import Record
from missionc.geometry import plain_floats
from missionc.geometry.height_layers import Heights, extent, heights_of
from missionc.geometry.plain_floats import Place
from missionc.ir import Ball, Box, Difference, Disc, Intersection, Polygon, Prism, Shape, Union, Vector, World
from missionc.ir.agents import InitialSet
from missionc.ir.distances.signed_distance import measured_outside, signed_distance

if TYPE_CHECKING:
    from missionc.geometry.layered_geometry import Geometry, Layers


SURE = 1e-6
"""Distance, metres, beyond which rounding errors cannot change an answer."""

MANY = 64
"""Maximum number of points, or of parts of an area, for plain numbers; for more, arrays are faster."""

FRACTIONS = (1 / 2, 1 / 6, 5 / 6, 1 / 50, 49 / 50)
"""Fractions of a box's sides at which candidate witnesses are tested."""

UNKNOWN = -math.inf

Measure: TypeAlias = Callable[[Vector], float]
"""Function from a position to a length, metres."""


class Area(Record, eq=False):
    """Set of positions, represented by an inner or outer bound.

    Args:
        layers: geometry operations, created at the first call.
        depth: lower bound of a position's depth in the set, metres; if negative, minus an upper bound of its distance.
        away: lower bound of a position's distance from the set, metres.
        seeds: positions that may be in the set; tested as witnesses.
        geometry: geometry of the set in each height layer, created at the first call.
        extent: lowest and highest corner, metres, if known without the geometry.
    """

    layers: Callable[[], Layers]
    depth: Measure
    away: Measure
    seeds: Callable[[], Iterator[Vector]]
    geometry: Callable[[], Geometry]
    extent: tuple[Vector, Vector] | None = None

    def witness(self, surely: Measure) -> bool:
        """Return true if some seed is certainly in the set and has a positive value of ``surely``, beyond rounding."""
        return any(self.depth(seed) > SURE and surely(seed) > SURE for seed in self.seeds())

    def holds_ball(self, radius: float) -> bool:
        """Return true if the set certainly contains a ball of ``radius`` metres around some seed."""
        return any(self.depth(seed) > radius + SURE for seed in self.seeds())


def unknown(place: Vector) -> float:
    return UNKNOWN


def depth_in(shape: Shape) -> Measure:
    """Function that bounds the depth of a position in an outer set of the shape from below, metres."""
    outside = measured_outside(shape)

    def depth(place: Vector) -> float:
        inside = -signed_distance(plain_floats, shape, Place(place))
        return inside if inside >= 0 or outside else UNKNOWN

    return depth


def away_from(shape: Shape) -> Measure:
    """Function that bounds the distance of a position from an inner set of the shape from below, metres."""

    def away(place: Vector) -> float:
        return _if_positive(signed_distance(plain_floats, shape, Place(place)))

    return away


def within_all(measures: tuple[Measure, ...]) -> Measure:
    """Function that bounds the depth of a position in an intersection of sets, metres; unknown outside any of the
    sets."""
    return lambda place: _if_positive(min(measure(place) for measure in measures))


def largest(measures: tuple[Measure, ...]) -> Measure:
    if len(measures) > MANY:
        return unknown
    return lambda place: max((measure(place) for measure in measures), default=UNKNOWN)


def least(measures: tuple[Measure, ...]) -> Measure:
    if len(measures) > MANY:
        return unknown
    return lambda place: min((measure(place) for measure in measures), default=math.inf)


def changed(measure: Measure, by: float) -> Measure:
    return lambda place: measure(place) + by


def seeds_of(shape: Shape, world: World) -> Callable[[], Iterator[Vector]]:
    """Function that yields sample positions of a shape, or of its bounding box, in the world."""
    match shape:
        case Union(left, right) | Intersection(left, right):
            return joined((seeds_of(left, world), seeds_of(right, world)))
        case Difference(left, _):
            return seeds_of(left, world)
        case Box(low, high):
            return _cut(low, high, world)
        case Ball(centre, radius):
            return _cut(_shifted(centre, -radius), _shifted(centre, radius), world)
        case Disc(centre, radius, band):
            return _cut(*_standing(_shifted(centre, -radius), _shifted(centre, radius), band), world)
        case Polygon(corners, band):
            return _cut(*_standing(tuple(map(min, *corners)), tuple(map(max, *corners)), band), world)
        case _:
            assert_never(shape)


def joined(several: Iterable[Callable[[], Iterator[Vector]]]) -> Callable[[], Iterator[Vector]]:
    return lambda: chain.from_iterable(seeds() for seeds in several)


def seeds_in(low: Vector, high: Vector) -> Iterator[Vector]:
    """Sample positions in a box, its centre first; none if the box is empty."""
    if any(a > b for a, b in zip(low, high, strict=True)):
        return
    for fractions in product(FRACTIONS, repeat=len(low)):
        yield tuple(a + part * (b - a) for part, a, b in zip(fractions, low, high, strict=True))


def _cut(low: Vector, high: Vector, world: World) -> Callable[[], Iterator[Vector]]:
    """Function that yields sample positions of the part of a box in the world; a box without heights has the heights of
    the world."""
    low, high = low + world.low[len(low) :], high + world.high[len(high) :]
    inner = tuple(map(max, low, world.low)), tuple(map(min, high, world.high))
    return lambda: seeds_in(*inner)


def _standing(low: Vector, high: Vector, band: Prism | None) -> tuple[Vector, Vector]:
    return ((*low, band.low), (*high, band.high)) if band else (low, high)


def _shifted(point: Vector, by: float) -> Vector:
    return tuple(value + by for value in point)


def _if_positive(metres: float) -> float:
    return metres if metres > 0 else UNKNOWN


class Atlas(Record, eq=False):
    """Height layers of a world, and the areas of shapes in them.

    ``layers`` creates the geometry operations at its first call.
    """

    world: World
    heights: Heights
    layers: Callable[[], Layers]

    @staticmethod
    def of(world: World, shapes: Iterable[Shape]) -> Atlas:
        heights = heights_of(world, shapes)

        def layers() -> Layers:
            from missionc.geometry.layered_geometry import Layers  # for questions without a witness

            return Layers.of_world(world, heights)

        return Atlas(world, heights, cache(layers))

    def outer(self, shape: Shape) -> Area:
        """Outer set of a shape: an area that contains at least its points."""
        return self._of(shape, outer=True)

    def inner(self, shape: Shape) -> Area:
        """Inner set of a shape: an area that contains at most its points."""
        return self._of(shape, outer=False)

    def whole(self) -> Area:
        """Area of the whole world."""
        low, high = self.world.low, self.world.high
        box = Box(low, high)
        return Area(
            self.layers,
            depth_in(box),
            away_from(box),
            lambda: seeds_in(low, high),
            cache(lambda: self.layers().whole()),
        )

    def half_space(self, weights: Vector, constant: float) -> Area:
        """Outer set of the world's positions that satisfy ``constant + weights · position >= 0``."""
        steep = math.hypot(*weights)

        def value(place: Vector) -> float:
            climbed = constant + sum(weight * at for weight, at in zip(weights, place, strict=True))
            return climbed / steep if steep else constant

        whole = self.whole()
        made = cache(lambda: self.layers().half_space(weights, constant))
        return Area(self.layers, within_all((whole.depth, value)), unknown, whole.seeds, made)

    def initial(self, place: InitialSet) -> Area:
        """Outer set of the allowed positions of a start or a finish."""
        return self.outer(place.shape) if place.point is None else self.point(place.point)

    def point(self, place: Vector) -> Area:
        def beyond(other: Vector) -> float:
            return math.dist(place, other)

        made = cache(lambda: self.layers().point(place))
        return Area(self.layers, lambda other: -beyond(other), beyond, lambda: iter((place,)), made)

    def grown(self, area: Area, distance: float, *, outer: bool) -> Area:
        """Positions within ``distance`` metres of an area, as an outer set (``outer``) or inner set."""
        depth: Measure = changed(area.depth, distance) if outer and distance >= 0 else unknown
        away: Measure = unknown if outer else changed(area.away, -max(distance, 0.0))
        return Area(
            self.layers,
            depth,
            away,
            area.seeds,
            cache(lambda: self.layers().grown(area.geometry(), distance, outer=outer)),
        )

    def near(self, shape: Shape, distance: float, *, outer: bool) -> Area:
        """Positions within ``distance`` metres of a shape, as an outer set (``outer``) or inner set; exact for a
        ball."""
        area = self.outer if outer else self.inner
        if isinstance(shape, Ball):
            return area(Ball(shape.centre, shape.radius + distance))
        return self.grown(area(shape), distance, outer=outer)

    def shrunk(self, area: Area, distance: float) -> Area:
        """Outer set of the positions in an area at least ``distance`` metres from its border; the height range is
        unchanged."""
        depth = within_all((changed(area.depth, -distance),))
        made = cache(lambda: self.layers().shrunk(area.geometry(), distance))
        return Area(self.layers, depth, unknown, area.seeds, made)

    def union(self, areas: Sequence[Area]) -> Area:
        """Union of areas."""
        depths, aways = tuple(area.depth for area in areas), tuple(area.away for area in areas)
        made = cache(lambda: self.layers().union([area.geometry() for area in areas]))
        return Area(self.layers, largest(depths), least(aways), joined([area.seeds for area in areas]), made)

    def size(self, area: Area, margin: float) -> float:
        """Upper bound of the size of an area grown by ``margin`` metres: square metres in a plane, cubic metres in a
        volume."""
        return self.layers().size(area.geometry(), margin)

    def capacity(self, area: Area, spacing: float) -> int:
        """Upper bound of the number of points in an area with pairwise distances of at least ``spacing`` metres."""
        return self.layers().capacity(area.geometry(), spacing)

    def diameter(self, area: Area) -> float:
        """Upper bound of the distance between two points of an area, metres; 0 if it is empty."""
        return self.layers().diameter(area.geometry())

    def distance(self, first: Area, second: Area) -> float:
        """Upper bound of the least distance between two areas, metres; infinite if one is empty."""
        return self.layers().distance(first.geometry(), second.geometry())

    def distances(self, places: Sequence[Vector], area: Area) -> list[float]:
        """Upper bounds of the distances from positions to an area, metres; infinite if the area is empty."""
        return self.layers().distances(places, area.geometry())

    def holds(self, area: Area, places: Sequence[Vector]) -> list[bool]:
        """Return true for each position that is in an area, border included."""
        if len(places) <= MANY:
            inside = [area.depth(place) > SURE for place in places]
            if all(held or area.away(place) > SURE for held, place in zip(inside, places, strict=True)):
                return inside
        return self.layers().holds(area.geometry(), places)

    def bounds(self, area: Area) -> tuple[Vector, Vector]:
        """Lowest and highest corner of a non-empty area's bounding box, metres."""
        return area.extent or self.layers().bounds(area.geometry())

    def _of(self, shape: Shape, *, outer: bool) -> Area:
        return Area(
            self.layers,
            depth_in(shape) if outer else unknown,
            unknown if outer else away_from(shape),
            seeds_of(shape, self.world),
            cache(lambda: self.layers().of(shape, outer=outer)),
            extent(shape, self.heights) if outer else None,
        )


def empty(area: Area) -> bool:
    """Return true if an area contains no position."""
    return not area.witness(area.depth) and area.layers().empty(area.geometry())


def disjoint(first: Area, second: Area) -> bool:
    """Return true if two areas, including their borders, have no common point."""
    if first.witness(second.depth) or second.witness(first.depth):
        return False
    return first.layers().disjoint(first.geometry(), second.geometry())


def covers(whole: Area, part: Area) -> bool:
    """Return true if every point of ``part`` is in ``whole``."""
    return not part.witness(whole.away) and whole.layers().covers(whole.geometry(), part.geometry())


def common(first: Area, second: Area) -> Area:
    made = cache(lambda: first.layers().common(first.geometry(), second.geometry()))
    depth, away = within_all((first.depth, second.depth)), largest((first.away, second.away))
    return Area(first.layers, depth, away, joined((first.seeds, second.seeds)), made)


def without(area: Area, taken: Area) -> Area:
    """Area without the points of ``taken``; lines and single points in ``taken`` are ignored."""
    made = cache(lambda: area.layers().without(area.geometry(), taken.geometry()))
    return Area(area.layers, within_all((area.depth, taken.away)), area.away, area.seeds, made)
