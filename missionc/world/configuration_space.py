"""Configuration space: sets of places an agent's centre may or may not be in, between an inner and an outer bound.

An *outer* set holds at least the points meant, an *inner* one at most, so that
whoever says "impossible" from disjoint outer sets, or from an outer set within
an inner one, is right. Questions are answered by a witness where plain numbers
find one (``area``), and else by the geometries (``layered_geometry``), which
are loaded and made for the first question that has none.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from functools import cache
from typing import TYPE_CHECKING

from missionc.base.late_dataclass import dataclass
from missionc.ir import Ball, Box, Shape, Vector, World
from missionc.world.area import (
    MANY,
    SURE,
    Area,
    Measure,
    away_from,
    changed,
    depth_in,
    joined,
    largest,
    least,
    seeds_in,
    seeds_of,
    unknown,
    within_all,
)
from missionc.world.height_layers import Heights, extent, heights_of

if TYPE_CHECKING:
    from missionc.world.layered_geometry import Layers


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
            from missionc.world.layered_geometry import Layers  # numpy and shapely: for questions without a witness

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
