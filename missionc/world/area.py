"""A set of places: what is surely so at single places of it in plain numbers, and its geometry, made when asked for.

Most questions about areas have a short answer with a witness: two areas meet,
because a place is surely in both. Plain numbers find such a place; only where
none is found does the geometry decide, and is its library loaded. What plain
numbers say follows from what an outer or an inner set promises, so that the
geometry would say the same.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from itertools import chain, product
from typing import TYPE_CHECKING, TypeAlias, assert_never

from missionc.base.late_dataclass import dataclass
from missionc.ir import Ball, Box, Difference, Disc, Intersection, Polygon, Prism, Shape, Union, Vector, World
from missionc.world import plain_floats
from missionc.world.plain_floats import Place
from missionc.world.signed_distance import measured_outside, signed_distance

if TYPE_CHECKING:
    from missionc.world.layered_geometry import Geometry, Layers

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
