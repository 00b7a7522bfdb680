"""Height layers of areas: their boundaries, and the part of a shape in each layer.

A plane has one layer. A volume has one layer for each height at which some shape begins or ends, and one open layer
between each two.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from itertools import pairwise
from typing import TypeAlias, assert_never

from missionc.ir import Ball, Box, Difference, Disc, Intersection, Polygon, Prism, Shape, Union, Vector, World

Heights: TypeAlias = tuple[tuple[float, float], ...]
"""Height range of each layer, metres; infinite in a plane."""

BALL_LAYERS = 8
MOST_LEVELS = 32

QUARTER = 32
"""Number of straight segments that approximate a quarter of a circle."""

WIDEN = 1 / math.cos(math.pi / (4 * QUARTER))
"""Ratio of the radii of the circumscribed and the inscribed regular polygon of a circle."""


def heights_of(world: World, shapes: Iterable[Shape]) -> Heights:
    """Height layers of a world with these shapes."""
    if world.dimension == 2:
        return ((-math.inf, math.inf),)
    levels = sorted({world.low[2], world.high[2], *(level for shape in shapes for level in _levels(shape))})
    if len(levels) > MOST_LEVELS:
        levels = [levels[int(place)] for place in _spaced(0.0, len(levels) - 1.0, MOST_LEVELS)]
    return tuple(sorted([*((level, level) for level in levels), *pairwise(levels)]))


def meets(low: float, high: float, layer: tuple[float, float]) -> bool:
    """Return true if a height range overlaps a layer; with an open layer the overlap must exceed its border."""
    bottom, top = layer
    return low <= top and high >= bottom if bottom == top else low < top and high > bottom


def cross_section(height: float, radius: float, layer: tuple[float, float], *, outer: bool) -> float:
    """Radius of the widest (``outer``) or narrowest disc in which a ball intersects a layer, metres; 0 without an
    intersection.

    ``height`` is the height of the ball's centre, metres.
    """
    bottom, top = layer
    nearest = min(max(height, bottom), top) - height
    farthest = max(abs(bottom - height), abs(top - height))
    square = radius**2 - (nearest**2 if outer else farthest**2)
    return math.sqrt(square) if square > 0 else 0.0


def extent(shape: Shape, heights: Heights) -> tuple[Vector, Vector] | None:
    """Lowest and highest corner of a plain shape's outer area, metres; None for combined shapes and for empty areas."""
    match shape:
        case Box(low, high):
            there = [layer for layer in heights if len(low) == 2 or meets(low[2], high[2], layer)]
            return _upright(low[:2], high[:2], there)
        case Disc((x, y), radius, band):
            wide = radius * WIDEN
            return _upright((x - wide, y - wide), (x + wide, y + wide), _in_band(band, heights))
        case Polygon(corners, band):
            return _upright(tuple(map(min, *corners)), tuple(map(max, *corners)), _in_band(band, heights))
        case Ball((x, y, z), radius):
            discs = {layer: cross_section(z, radius, layer, outer=True) for layer in heights}
            wide = max(discs.values()) * WIDEN
            there = [layer for layer, disc in discs.items() if disc > 0]
            return _upright((x - wide, y - wide), (x + wide, y + wide), there)
        case _:
            return None


def _in_band(band: Prism | None, heights: Heights) -> list[tuple[float, float]]:
    return [layer for layer in heights if band is None or meets(band.low, band.high, layer)]


def _upright(low: Vector, high: Vector, there: list[tuple[float, float]]) -> tuple[Vector, Vector] | None:
    """Lowest and highest corner of a box over all of the given layers; None without layers."""
    if not there:
        return None
    bottom, top = min(layer[0] for layer in there), max(layer[1] for layer in there)
    return (low, high) if math.isinf(bottom) else ((*low, bottom), (*high, top))


def _levels(shape: Shape) -> list[float]:
    """Heights, metres, at which a shape's cross-section begins, ends or (for a ball) is approximated."""
    match shape:
        case Box(low, high):
            return [low[2], high[2]] if len(low) == 3 else []
        case Disc(_, _, band) | Polygon(_, band):
            return [band.low, band.high] if band else []
        case Ball(centre, radius):
            return list(_spaced(centre[2] - radius, centre[2] + radius, BALL_LAYERS + 1))
        case Union(left, right) | Intersection(left, right) | Difference(left, right):
            return _levels(left) + _levels(right)
        case _:
            assert_never(shape)


def _spaced(low: float, high: float, count: int) -> Iterator[float]:
    """Yield ``count`` equidistant numbers from ``low`` to ``high``."""
    yield from (place * ((high - low) / (count - 1)) + low for place in range(count - 1))
    yield high
