"""Clearance of line segments from shapes; negative if a segment crosses a shape.

The clearance of a segment is the least signed distance of its points. Along a segment, the distance to a piece of
``convex_pieces`` first falls and then rises, between known positions, so bisection finds the minimum. The code uses
only operations that numpy, torch and ``plain_floats`` share.

Source:
    Boyd and Vandenberghe, "Convex Optimization" (2004), 3.1.5 and 3.4: distances to convex sets are convex, and the
    maximum of quasiconvex functions is quasiconvex.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from functools import partial, reduce
from itertools import pairwise
from types import EllipsisType
from typing import Any, TypeAlias

from missionc.ir import Ball, Disc, Shape
from missionc.ir.distances.convex_pieces import HalfSpace, Outside, Part, Piece, pieces
from missionc.ir.distances.signed_distance import Array, Namespace, distance_between, signed_distance

HALVINGS = 34
"""Number of bisections: the minimum is located up to the length of the segment divided by 2 to this power."""

BESIDE = 1e-6
"""Step of the finite difference that measures a slope, as a fraction of the segment."""


SAMPLES = 8
"""Number of points of a segment in the first evaluation; the search then refines between them."""


def clear_line(
    xp: Namespace, shapes: Iterable[Shape], first: Array, second: Array, enough: Array, floor: float = -math.inf
) -> Array:
    """Clearance of line segments from shapes, at most ``enough``.

    Args:
        xp: array library of the points.
        first: one end of each segment, (..., dim), metres; broadcasts with ``second``, the other end.
        enough: (...), metres; larger clearances are not computed.
        floor: metres; a clearance below it may be returned inexactly.

    Returns:
        (...), metres, symmetric in the two ends. Moving both ends by a metre changes the clearance by at most a metre.
        The sign is exact; the value is that of ``signed_distance`` for plain convex shapes, and never overstated for
        others.
    """
    ends = _in_order(xp, first, second)
    for shape in shapes:
        for piece in pieces(shape):
            enough = _lowered(xp, piece, ends, enough, floor)
    return enough


class _Points:
    """Points as one array (...) per coordinate, metres; indexed like one array: ``points[..., axis]``."""

    def __init__(self, axes: list[Array]) -> None:
        self.axes = axes

    @property
    def shape(self) -> tuple[int, ...]:
        return (len(self.axes),)

    def __getitem__(self, key: tuple[EllipsisType, int | slice]) -> Any:
        chosen = self.axes[key[1]]
        return _Points(chosen) if isinstance(chosen, list) else chosen


class _Lines:
    """Line segments from ``begin`` (fraction 0) to ``begin + way`` (fraction 1); one array (...) per coordinate,
    metres."""

    def __init__(self, begin: list[Array], way: list[Array]) -> None:
        self.begin, self.way = begin, way

    def at(self, share: Array) -> _Points:
        return _Points([begin + share * way for begin, way in zip(self.begin, self.way, strict=True)])

    def taken(self, some: Array) -> _Lines:
        return _Lines([axis[some] for axis in self.begin], [axis[some] for axis in self.way])

    def nearest(self, xp: Namespace, centre: tuple[float, ...]) -> Array:
        """Fraction of each segment at which it is nearest to ``centre``, over the coordinates of ``centre``: (...),
        dimensionless."""
        axes = [(self.begin[axis], self.way[axis], centre[axis]) for axis in range(len(centre))]
        square = sum(way * way for _, way, _ in axes)
        along = sum((middle - begin) * way for begin, way, middle in axes)
        return xp.clip(along / xp.where(square > 0, square, 1.0), 0.0, 1.0)


def _in_order(xp: Namespace, first: Array, second: Array) -> _Lines:
    """Segments that start at the lexicographically smaller end, so that exchanged ends give the same result.

    Shape: (..., dim) twice, metres.
    """
    axes = range(first.shape[-1])
    here = [first[..., axis] + 0.0 * second[..., axis] for axis in axes]
    there = [second[..., axis] + 0.0 * first[..., axis] for axis in axes]
    later = here[0] != here[0]
    for one, other in zip(reversed(here), reversed(there), strict=True):
        later = (one > other) | ((one == other) & later)
    begin = [xp.where(later, other, one) for one, other in zip(here, there, strict=True)]
    way = [xp.where(later, one, other) - start for one, other, start in zip(here, there, begin, strict=True)]
    return _Lines(begin, way)


def _lowered(
    xp: Namespace, piece: Piece, lines: _Lines, enough: Array, floor: float, shares: tuple[float, ...] = (0.5,)
) -> Array:
    """Minimum of ``enough`` and the distances of segments to a piece, computed only for segments that may be that near.

    Shape: (...), metres.

    Args:
        shares: fractions of the segments at which distances are tested first; no point of a segment is further from the
            nearest of them than half their spacing.
    """
    reach = distance_between(xp, lines.at(0.0), lines.at(1.0)) / (2 * len(shares))
    nearest = reduce(xp.minimum, [_depth(xp, piece, lines.at(share)) for share in shares])
    near = (nearest - reach < enough) & (enough > floor)
    if getattr(near, "shape", ()) == ():
        return xp.minimum(enough, _least(xp, piece, lines)) if near else enough
    lowered = enough + 0.0
    if len(shares) > 1:
        below = near & (nearest <= floor)
        lowered[below], near = nearest[below], near & ~below
        if near.any():
            lowered[near] = xp.minimum(enough[near], _least(xp, piece, lines.taken(near)))
    elif near.any():
        evenly = tuple((2 * number + 1) / (2 * SAMPLES) for number in range(SAMPLES))
        lowered[near] = _lowered(xp, piece, lines.taken(near), enough[near], floor, evenly)
    return lowered


def _depth(xp: Namespace, piece: Piece, points: _Points) -> Array:
    """Lower bound of the signed distance of points to a piece, the intersection of its parts: (...), metres."""
    return reduce(xp.maximum, [_distance(xp, part, points) for part in piece])


def _distance(xp: Namespace, part: Part, points: _Points) -> Array:
    match part:
        case HalfSpace(normal, offset):
            return sum(weight * points[..., axis] for axis, weight in enumerate(normal)) - offset
        case Outside(centre, radius):
            return radius - distance_between(xp, points[..., : len(centre)], centre)
        case _:
            return signed_distance(xp, part, points)


def _least(xp: Namespace, piece: Piece, lines: _Lines) -> Array:
    """Least distance of the points of segments to a piece: (...), metres."""
    match piece:
        case (Disc(centre, _, None) | Ball(centre, _),):
            return _depth(xp, piece, lines.at(lines.nearest(xp, centre)))
    held = _Lines([_held(axis) for axis in lines.begin], [_held(axis) for axis in lines.way])
    nothing = 0.0 * held.begin[0]
    turns = _sorted(xp, [held.nearest(xp, part.centre) for part in piece if isinstance(part, Outside)])
    least, low, high, share = reduce(
        partial(_lesser, xp),
        [
            _least_between(xp, lambda share: _depth(xp, piece, held.at(share)), low, high)
            for low, high in pairwise([nothing, *turns, nothing + 1.0])
        ],
    )
    if held.begin[0] is lines.begin[0]:
        return least
    mixed = (1.0 - share) * _depth(xp, piece, lines.at(low)) + share * _depth(xp, piece, lines.at(high))
    return least + (mixed - _held(mixed))


Found: TypeAlias = tuple[Array, Array, Array, Array]
"""Minimum along segments: value, two fractions between which it begins to rise, weight of the second in the slope."""


def _least_between(xp: Namespace, value: Callable[[Array], Array], low: Array, high: Array) -> Found:
    """Minimum of functions that fall and then rise between ``low`` and ``high``, by bisection.

    The arrays have shape (...): values in metres, positions as fractions of the segment. At a kink, the derivative of
    the minimum weights the falling and the rising side such that their slopes balance.
    """
    middle = (low + high) / 2
    amid, least = value(middle), xp.minimum(value(low), value(high))
    for _ in range(HALVINGS):
        left, right = (low + middle) / 2, (middle + high) / 2
        at_left, at_right = value(left), value(right)
        to_left, to_right = at_left < amid, at_right < amid
        low, high, middle, amid = (
            xp.where(to_left, first, xp.where(to_right, second, third))
            for first, second, third in (
                (low, middle, left),
                (middle, high, right),
                (left, right, middle),
                (at_left, at_right, amid),
            )
        )
    fall, rise = (
        xp.clip(value(low - BESIDE) - value(low), 0.0, None),
        xp.clip(value(high + BESIDE) - value(high), 0.0, None),
    )
    both = fall + rise
    share = xp.where(both > 0, fall / xp.where(both > 0, both, 1.0), 0.5)
    return xp.minimum(least, amid), low, high, share


def _lesser(xp: Namespace, one: Found, other: Found) -> Found:
    less = other[0] < one[0]
    least, low, high, share = (xp.where(less, new, old) for old, new in zip(one, other, strict=True))
    return least, low, high, share


def _sorted(xp: Namespace, values: list[Array]) -> list[Array]:
    """Arrays sorted elementwise: the first result has the least value of each element. All arrays are (...), fractions
    of segments."""
    values = list(values)
    for last in range(len(values) - 1, 0, -1):
        for place in range(last):
            one, other = values[place], values[place + 1]
            values[place], values[place + 1] = xp.minimum(one, other), xp.maximum(one, other)
    return values


def _held(value: Array) -> Array:
    """Array of any shape and unit, detached from torch's automatic differentiation."""
    return value.detach() if hasattr(value, "detach") else value
