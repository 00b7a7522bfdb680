"""Configuration space: sets of places an agent's centre may or may not be in, with an inner and an outer bound.

An *outer* set holds at least the points meant, an *inner* one at most. So "impossible" is right if outer sets are
disjoint, or if an outer set lies within an inner one.

Most questions about areas have a short answer with a witness: two areas meet, because a place is surely in both.
Plain numbers at single places find a witness. Only if they find none does the geometry (``layered_geometry``) decide:
its library is loaded and its shapes are made at the first such question. An answer of plain numbers follows from the
promise of an outer or an inner set, so the geometry would give the same.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import cache
from itertools import chain, product
from typing import TYPE_CHECKING, TypeAlias, assert_never

from missionc.base.late_dataclass import dataclass
from missionc.geometry import plain_floats
from missionc.geometry.height_layers import Heights, extent, heights_of
from missionc.geometry.plain_floats import Place
from missionc.ir import Ball, Box, Difference, Disc, Intersection, Polygon, Prism, Shape, Union, Vector, World
from missionc.ir.agents import InitialSet
from missionc.ir.distances.signed_distance import measured_outside, signed_distance

if TYPE_CHECKING:
    from missionc.geometry.layered_geometry import Geometry, Layers


SURE = 1e-6
"""Metres beyond which no rounding changes what is said of a place."""

MANY = 64
"""Places, or parts of an area, that plain numbers look at; of more, arrays are quicker."""

FRACTIONS = (1 / 2, 1 / 6, 5 / 6, 1 / 50, 49 / 50)
"""Shares of a box's sides: where places are looked for that may be witnesses."""

UNKNOWN = -math.inf

Measure: TypeAlias = Callable[[Vector], float]
"""Metres, of a place."""


@dataclass(frozen=True, slots=True, eq=False)
class Area:
    """A set of places.

    Args:
        layers: what asks of geometries, made at the first call.
        depth: how deep a place is in the set, at least; below 0, how far outside it is, at most.
        away: how far outside the set a place is, at least.
        seeds: places that may be in the set.
        geometry: in each layer of height, made at the first call.
        extent: the least and the largest coordinates, where they are known without the geometry.
    """

    layers: Callable[[], Layers]
    depth: Measure
    away: Measure
    seeds: Callable[[], Iterator[Vector]]
    geometry: Callable[[], Geometry]
    extent: tuple[Vector, Vector] | None = None

    def witness(self, surely: Measure) -> bool:
        """Whether some seed is surely in the set, and ``surely`` more than nothing."""
        return any(self.depth(seed) > SURE and surely(seed) > SURE for seed in self.seeds())

    def holds_ball(self, radius: float) -> bool:
        """Whether some ball of that radius, metres, is surely in the set."""
        return any(self.depth(seed) > radius + SURE for seed in self.seeds())


def unknown(place: Vector) -> float:
    return UNKNOWN


def depth_in(shape: Shape) -> Measure:
    """The depth of places in a set that has those of a shape, and any more."""
    outside = measured_outside(shape)

    def depth(place: Vector) -> float:
        inside = -signed_distance(plain_floats, shape, Place(place))
        return inside if inside >= 0 or outside else UNKNOWN

    return depth


def away_from(shape: Shape) -> Measure:
    """The distance of places from a set that has those of a shape, or any fewer."""

    def away(place: Vector) -> float:
        return _if_positive(signed_distance(plain_floats, shape, Place(place)))

    return away


def within_all(measures: tuple[Measure, ...]) -> Measure:
    """How deep in several sets at once; nothing is known of places outside one of them."""
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
    """Places of a shape, and of the box around it, in the world."""
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
    """Places in a box, its middle first; none if it is empty."""
    if any(a > b for a, b in zip(low, high, strict=True)):
        return
    for fractions in product(FRACTIONS, repeat=len(low)):
        yield tuple(a + part * (b - a) for part, a, b in zip(fractions, low, high, strict=True))


def _cut(low: Vector, high: Vector, world: World) -> Callable[[], Iterator[Vector]]:
    """The seeds of what is in the world of a box; one without heights has the world's."""
    low, high = low + world.low[len(low) :], high + world.high[len(high) :]
    inner = tuple(map(max, low, world.low)), tuple(map(min, high, world.high))
    return lambda: seeds_in(*inner)


def _standing(low: Vector, high: Vector, band: Prism | None) -> tuple[Vector, Vector]:
    return ((*low, band.low), (*high, band.high)) if band else (low, high)


def _shifted(point: Vector, by: float) -> Vector:
    return tuple(value + by for value in point)


def _if_positive(metres: float) -> float:
    return metres if metres > 0 else UNKNOWN


@dataclass(frozen=True, slots=True, eq=False)
class Atlas:
    """The layers of a world, and the areas of shapes in them.

    ``layers`` makes their geometries at its first call.
    """

    world: World
    heights: Heights
    layers: Callable[[], Layers]

    @staticmethod
    def of(world: World, shapes: Iterable[Shape]) -> Atlas:
        heights = heights_of(world, shapes)

        def layers() -> Layers:
            from missionc.geometry.layered_geometry import Layers  # numpy and shapely: for questions without a witness

            return Layers.of_world(world, heights)

        return Atlas(world, heights, cache(layers))

    def outer(self, shape: Shape) -> Area:
        """At least the points of the shape."""
        return self._of(shape, outer=True)

    def inner(self, shape: Shape) -> Area:
        """At most the points of the shape."""
        return self._of(shape, outer=False)

    def whole(self) -> Area:
        """The world."""
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
        """The places of the world, and some beside it, with ``constant + weights · place >= 0``, at least."""
        steep = math.hypot(*weights)

        def value(place: Vector) -> float:
            climbed = constant + sum(weight * at for weight, at in zip(weights, place, strict=True))
            return climbed / steep if steep else constant

        whole = self.whole()
        made = cache(lambda: self.layers().half_space(weights, constant))
        return Area(self.layers, within_all((whole.depth, value)), unknown, whole.seeds, made)

    def initial(self, place: InitialSet) -> Area:
        """At least the points of a start or a finish."""
        return self.outer(place.shape) if place.point is None else self.point(place.point)

    def point(self, place: Vector) -> Area:
        def beyond(other: Vector) -> float:
            return math.dist(place, other)

        made = cache(lambda: self.layers().point(place))
        return Area(self.layers, lambda other: -beyond(other), beyond, lambda: iter((place,)), made)

    def grown(self, area: Area, distance: float, *, outer: bool) -> Area:
        """The places within a distance of an area, at least (``outer``) or at most."""
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
        """The places within a distance of a shape, at least (``outer``) or at most; those of a ball are a ball."""
        area = self.outer if outer else self.inner
        if isinstance(shape, Ball):
            return area(Ball(shape.centre, shape.radius + distance))
        return self.grown(area(shape), distance, outer=outer)

    def shrunk(self, area: Area, distance: float) -> Area:
        """The places of an area that are at least so far from its border, at least (heights are left as they are)."""
        depth = within_all((changed(area.depth, -distance),))
        made = cache(lambda: self.layers().shrunk(area.geometry(), distance))
        return Area(self.layers, depth, unknown, area.seeds, made)

    def union(self, areas: Sequence[Area]) -> Area:
        """The points of all areas."""
        depths, aways = tuple(area.depth for area in areas), tuple(area.away for area in areas)
        made = cache(lambda: self.layers().union([area.geometry() for area in areas]))
        return Area(self.layers, largest(depths), least(aways), joined([area.seeds for area in areas]), made)

    def size(self, area: Area, margin: float) -> float:
        """Square (cubic) metres of the area grown by a margin, at most."""
        return self.layers().size(area.geometry(), margin)

    def capacity(self, area: Area, spacing: float) -> int:
        """How many points there are in an area, so far apart from each other, at most."""
        return self.layers().capacity(area.geometry(), spacing)

    def diameter(self, area: Area) -> float:
        """Between the furthest points of an area, at most, metres; 0 where it is empty."""
        return self.layers().diameter(area.geometry())

    def distance(self, first: Area, second: Area) -> float:
        """Between the nearest points of two areas, at most; infinite where one is empty."""
        return self.layers().distance(first.geometry(), second.geometry())

    def distances(self, places: Sequence[Vector], area: Area) -> list[float]:
        """From each of the places to an area, at most, metres; infinite where it is empty."""
        return self.layers().distances(places, area.geometry())

    def holds(self, area: Area, places: Sequence[Vector]) -> list[bool]:
        """Which places are in an area, its border included."""
        if len(places) <= MANY:
            inside = [area.depth(place) > SURE for place in places]
            if all(held or area.away(place) > SURE for held, place in zip(inside, places, strict=True)):
                return inside
        return self.layers().holds(area.geometry(), places)

    def bounds(self, area: Area) -> tuple[Vector, Vector]:
        """The least and the largest coordinates of an area that is not empty."""
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
    """Whether there is no place in it."""
    return not area.witness(area.depth) and area.layers().empty(area.geometry())


def disjoint(first: Area, second: Area) -> bool:
    """Whether two areas have no point in common, borders included."""
    if first.witness(second.depth) or second.witness(first.depth):
        return False
    return first.layers().disjoint(first.geometry(), second.geometry())


def covers(whole: Area, part: Area) -> bool:
    """Whether every point of the part is in the whole."""
    return not part.witness(whole.away) and whole.layers().covers(whole.geometry(), part.geometry())


def common(first: Area, second: Area) -> Area:
    made = cache(lambda: first.layers().common(first.geometry(), second.geometry()))
    depth, away = within_all((first.depth, second.depth)), largest((first.away, second.away))
    return Area(first.layers, depth, away, joined((first.seeds, second.seeds)), made)


def without(area: Area, taken: Area) -> Area:
    """The area less the points of another, but for lines and single points."""
    made = cache(lambda: area.layers().without(area.geometry(), taken.geometry()))
    return Area(area.layers, within_all((area.depth, taken.away)), area.away, area.seeds, made)
