"""Interval arithmetic of distances: least and greatest values over the points of boxes.

    in   the corners of boxes
    out  Range of the measured values

A range contains every possible value, and may contain more: bounds are rounded outward. Ranges support addition and
scaling like numbers, so that linear expressions in distances need only one implementation.

Source:
    Moore, Kearfott and Cloud, "Introduction to Interval Analysis", 2009, chapters 2 and 5.
"""

from __future__ import annotations

from functools import reduce
from typing import assert_never

import numpy as np

from missionc.base.late_dataclass import Record
from missionc.base.trace import Array
from missionc.ir import Ball, Box, Difference, Disc, Intersection, Polygon, Prism, Shape, Union
from missionc.ir.distances.signed_distance import signed_distance

ROUNDING = 1e-12
"""Outward rounding of each operation, relative to the larger bound and absolute; far above the errors of doubles."""


class Range(Record, eq=False):
    """Intervals from ``low`` to ``high``, arrays (...) of one unit."""

    low: Array
    high: Array

    __array_ufunc__ = None
    """None, so that numpy leaves an operation with an array on the left to the range."""

    def __add__(self, other: Range | Array | float) -> Range:
        other = _range(other)
        return outward(self.low + other.low, self.high + other.high)

    __radd__ = __add__

    def __neg__(self) -> Range:
        return Range(-self.high, -self.low)

    def __sub__(self, other: Range | Array | float) -> Range:
        return self + -_range(other)

    def __rsub__(self, other: Array | float) -> Range:
        return -self + other

    def __mul__(self, factor: float) -> Range:
        ends = factor * self.low, factor * self.high
        return outward(*(ends if factor >= 0 else ends[::-1]))

    __rmul__ = __mul__

    def __truediv__(self, divisor: float) -> Range:
        return self * (1.0 / divisor)

    def magnitude(self) -> Range:
        """Range of the absolute values."""
        least = np.maximum(np.maximum(self.low, -self.high), 0.0)
        return Range(least, np.maximum(np.abs(self.low), np.abs(self.high)))


def _range(value: Range | Array | float) -> Range:
    return value if isinstance(value, Range) else Range(np.asarray(value), np.asarray(value))


def outward(low: Array, high: Array) -> Range:
    """Range from ``low`` to ``high``, (...) each, any unit, rounded outward."""
    return Range(low - ROUNDING * (1.0 + np.abs(low)), high + ROUNDING * (1.0 + np.abs(high)))


def larger(*ranges: Range) -> Range:
    """Range of the maximum of one number from each range."""
    return Range(reduce(np.maximum, [each.low for each in ranges]), reduce(np.maximum, [each.high for each in ranges]))


def smaller(*ranges: Range) -> Range:
    """Range of the minimum of one number from each range."""
    return -larger(*(-each for each in ranges))


def length_range(coordinates: list[Range]) -> Range:
    """Range of the Euclidean length of a vector, from the ranges of its coordinates."""
    sizes = [each.magnitude() for each in coordinates]
    return outward(
        np.sqrt(sum(np.square(each.low) for each in sizes)), np.sqrt(sum(np.square(each.high) for each in sizes))
    )


def signed_distance_range(shape: Shape, low: Array, high: Array) -> Range:
    """Range of the signed distance to a shape's border over the points of boxes, metres.

    Args:
        low: lowest corners, (..., dim), metres; ``high``: highest corners.
    """
    axes = [Range(low[..., axis], high[..., axis]) for axis in range(low.shape[-1])]
    match shape:
        case Box(begin, end):
            return _product([_interval(axis, *ends) for axis, *ends in zip(axes, begin, end, strict=True)])
        case Disc(centre, radius, band):
            plane = length_range([axis - at for axis, at in zip(axes[:2], centre, strict=True)]) - radius
            return _extruded(plane, band, axes)
        case Ball(centre, radius):
            return length_range([axis - at for axis, at in zip(axes, centre, strict=True)]) - radius
        case Polygon(corners, band):
            return _extruded(_around_the_middle(Polygon(corners), low[..., :2], high[..., :2]), band, axes)
        case Union(left, right):
            return smaller(signed_distance_range(left, low, high), signed_distance_range(right, low, high))
        case Intersection(left, right):
            return larger(signed_distance_range(left, low, high), signed_distance_range(right, low, high))
        case Difference(left, right):
            return larger(signed_distance_range(left, low, high), -signed_distance_range(right, low, high))
        case _:
            assert_never(shape)


def _interval(axis: Range, begin: float, end: float) -> Range:
    """Range of the signed distance of a number to the interval from ``begin`` to ``end``; the distance is least at the
    centre."""
    ends = [np.maximum(begin - at, at - end) for at in (axis.low, axis.high)]
    middle = np.clip((begin + end) / 2, axis.low, axis.high)
    return outward(np.maximum(begin - middle, middle - end), np.maximum(*ends))


def _product(distances: list[Range]) -> Range:
    """Range of the signed distance to a product of sets along orthogonal axes, from the ranges of the distances to each
    set."""
    outside = length_range([larger(each, _range(0.0)) for each in distances])
    return outside + smaller(larger(*distances), _range(0.0))


def _extruded(plane: Range, band: Prism | None, axes: list[Range]) -> Range:
    return plane if band is None else _product([plane, _interval(axes[2], band.low, band.high)])


def _around_the_middle(shape: Shape, low: Array, high: Array) -> Range:
    """Range of the signed distance over boxes, (..., dim), metres, from its value at their centres: it is
    1-Lipschitz."""
    away = np.linalg.norm(high - low, axis=-1) / 2
    middle = signed_distance(np, shape, (low + high) / 2)
    return outward(middle - away, middle + away)
