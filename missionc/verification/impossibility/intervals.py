"""Interval arithmetic on arrays, rounded outward, and bounds of predicates' quantities over boxes.

Every bound is the next double beyond the computed one, so that an interval contains every possible value.

Source:
    Moore, Kearfott and Cloud, "Introduction to Interval Analysis", 2009: the natural extension of an expression.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import reduce
from typing import Any, TypeAlias, assert_never

import numpy as np

from missionc import ir
from missionc.base.late_dataclass import Record
from missionc.base.trace import Array
from missionc.ir.distances.signed_distance import signed_distance
from missionc.verification.certificate import CERTAIN, MOTION

Boxes: TypeAlias = tuple[Array, Array]
"""The lowest and the highest corners of boxes, (..., dim) each, metres."""

NEARER = CERTAIN + 2 * MOTION
"""Tolerance of plan verification between two sample times, steps included, metres.

Bodies may be nearer to each other and to obstacles than required by this distance.
"""


class Interval(Record, eq=False):
    """Array of intervals from ``low`` to ``high``, (...) each."""

    low: Array
    high: Array

    __array_ufunc__ = None
    """None, so that an operation with an array on the left uses the methods of ``Interval``."""

    def __add__(self, other: Interval | Array | float) -> Interval:
        other = exactly(other)
        return _outward(self.low + other.low, self.high + other.high)

    __radd__ = __add__

    def __neg__(self) -> Interval:
        return Interval(-self.high, -self.low)

    def __sub__(self, other: Interval | Array | float) -> Interval:
        return self + -exactly(other)

    def __rsub__(self, other: Array | float) -> Interval:
        return exactly(other) + -self

    def __mul__(self, factor: float) -> Interval:
        ends = factor * self.low, factor * self.high
        return _outward(np.minimum(*ends), np.maximum(*ends))

    __rmul__ = __mul__

    def __truediv__(self, divisor: float) -> Interval:
        ends = self.low / divisor, self.high / divisor
        return _outward(np.minimum(*ends), np.maximum(*ends))

    def __abs__(self) -> Interval:
        across = (self.low <= 0) & (self.high >= 0)
        ends = np.abs(self.low), np.abs(self.high)
        return Interval(np.where(across, 0.0, np.minimum(*ends)), np.maximum(*ends))


def exactly(value: Interval | Array | float) -> Interval:
    """The value as an interval; a number becomes an interval of length 0, (...), in any unit."""
    return value if isinstance(value, Interval) else Interval(np.asarray(value), np.asarray(value))


def greater(one: Interval, other: Interval | float) -> Interval:
    """Interval of the greater of two uncertain numbers."""
    other = exactly(other)
    return Interval(np.maximum(one.low, other.low), np.maximum(one.high, other.high))


def less(one: Interval, other: Interval | float) -> Interval:
    """Interval of the smaller of two uncertain numbers."""
    return -greater(-one, -exactly(other))


def length(coordinates: Iterable[Interval]) -> Interval:
    """Interval of the Euclidean length of a vector whose coordinates are intervals."""
    sizes = [abs(each) for each in coordinates]
    total = reduce(Interval.__add__, (_outward(each.low**2, each.high**2) for each in sizes))
    return _outward(np.sqrt(np.maximum(total.low, 0.0)), np.sqrt(total.high))


def _outward(low: Array, high: Array) -> Interval:
    return Interval(np.nextafter(low, -np.inf), np.nextafter(high, np.inf))


def signed_distances(shape: ir.Shape, boxes: Boxes) -> Interval:
    """Intervals of the signed distance between the points of boxes and a shape's boundary, metres, negative inside."""
    low, high = boxes
    axes = [Interval(low[..., axis], high[..., axis]) for axis in range(low.shape[-1])]
    match shape:
        case ir.Box(begin, end):
            return _product([_strip(axis, *ends) for axis, *ends in zip(axes, begin, end, strict=True)])
        case ir.Disc(centre, radius, band):
            return _extruded(length(axis - at for axis, at in zip(axes, centre, strict=False)) - radius, band, axes)
        case ir.Ball(centre, radius):
            return length(axis - at for axis, at in zip(axes, centre, strict=True)) - radius
        case ir.Polygon(corners, band):
            return _extruded(_by_the_middle(ir.Polygon(corners), (low[..., :2], high[..., :2])), band, axes)
        case ir.Union(left, right):
            return less(signed_distances(left, boxes), signed_distances(right, boxes))
        case ir.Intersection(left, right):
            return greater(signed_distances(left, boxes), signed_distances(right, boxes))
        case ir.Difference(left, right):
            return greater(signed_distances(left, boxes), -signed_distances(right, boxes))
        case _:
            assert_never(shape)


def _strip(axis: Interval, begin: float, end: float) -> Interval:
    """Signed distance of ``axis`` to the interval from ``begin`` to ``end``, metres.

    The formula by the interval's middle is convex, so its maximum value is at an end.
    """
    half = (end - begin) / 2
    return abs(axis - (begin + half)) - half


def _product(distances: Sequence[Interval]) -> Interval:
    """Signed distance to a Cartesian product of sets, from the signed distances to each set."""
    return length(greater(each, 0.0) for each in distances) + less(reduce(greater, distances), 0.0)


def _extruded(plane: Interval, band: ir.Prism | None, axes: Sequence[Interval]) -> Interval:
    return plane if band is None else _product([plane, _strip(axes[2], band.low, band.high)])


POLYGON = 1e-9
"""Error bound of a point's distance to a polygon, metres."""


def _by_the_middle(shape: ir.Shape, boxes: Boxes) -> Interval:
    """Signed distances of all points of boxes, from the distance of their middle points.

    The points are within half a diagonal of the middle, and the distance is 1-Lipschitz.
    """
    low, high = boxes
    middle = (low + high) / 2
    away = length(Interval(np.zeros_like(side), side / 2) for side in np.moveaxis(high - low, -1, 0)).high + POLYGON
    at = signed_distance(np, shape, middle)
    return _outward(at - away, at + away)


def between(one: Boxes, other: Boxes) -> list[Interval]:
    """Coordinate differences from points of the first boxes to points of the second boxes, as one interval per axis."""
    (low, high), (other_low, other_high) = one, other
    return [
        Interval(other_low[..., axis], other_high[..., axis]) - Interval(low[..., axis], high[..., axis])
        for axis in range(low.shape[-1])
    ]


def pairwise(one: Boxes, other: Boxes) -> tuple[Boxes, Boxes]:
    """Both lists of boxes with shapes that broadcast to all pairs: (one, other, dim)."""
    return (one[0][:, None, :], one[1][:, None, :]), (other[0][None, :, :], other[1][None, :, :])


def must_be_apart(mission: ir.Mission, first: int, second: int) -> float:
    """Required distance between the centres of two agents, minus the verification tolerance, metres."""
    return mission.separation + mission.agents[first].radius + mission.agents[second].radius - NEARER


class IntervalView:
    """View of agents that may be anywhere in their boxes; predicates are evaluated for one of them."""

    def __init__(self, mission: ir.Mission, places: Mapping[int, Boxes], speed: Interval | None = None) -> None:
        self.mission, self.dimension, self.places, self.known_speed = mission, mission.dimension, places, speed
        self.oneself = next(iter(places))

    def place(self, agent: int | None) -> Boxes:
        """Corners of the box that contains an agent; None stands for the agent under evaluation.

        Raises:
            ValueError: the agent has no box.
        """
        agent = self.oneself if agent is None else agent
        if agent not in self.places:
            raise ValueError("another agent is not seen here")
        return self.places[agent]

    def radius(self) -> float:
        return float(self.mission.agents[self.oneself].radius)

    def coordinate(self, axis: int) -> Interval:
        low, high = self.place(None)
        return Interval(low[..., axis], high[..., axis])

    def altitude(self) -> Interval:
        if self.dimension == 3:
            return self.coordinate(2)
        return self.nothing() + float(self.mission.agents[self.oneself].altitude or 0.0)

    def speed(self) -> Interval:
        if self.known_speed is None:
            raise ValueError("no speed is seen here")
        return self.known_speed

    def outside(self, region: ir.Region) -> Interval:
        return signed_distances(region.shape, self.place(None))

    def to_beacon(self, beacon: ir.Beacon) -> Interval:
        return length(self.coordinate(axis) - beacon.position[axis] for axis in range(self.dimension))

    def of_place(self, value: Callable[[Any, Array], Array]) -> Interval:
        """Interval of a 1-Lipschitz function of the agent's position over its boxes (..., dim): (...), metres."""
        low, high = self.place(None)
        middle = exactly(np.asarray(value(np, (low + high) / 2)))
        reach = length(Interval(low[..., axis], high[..., axis]) - low[..., axis] for axis in range(self.dimension))
        return Interval((middle - reach * 0.5).low, (middle + reach * 0.5).high)

    def apart(self, first: int | None, second: int) -> Interval:
        first = self.oneself if first is None else first
        distance = length(between(self.place(first), self.place(second)))
        return distance if first == second else greater(distance, must_be_apart(self.mission, first, second))

    def formation_error(self, edge: ir.FormationEdge) -> Interval:
        way = between(self.place(edge.first), self.place(edge.second))
        if isinstance(edge.target, tuple):
            return length(each - offset for each, offset in zip(way, edge.target, strict=True))
        return abs(length(way) - edge.target)

    def larger(self, one: Interval, other: Interval) -> Interval:
        return greater(one, other)

    def nothing(self, *, of_team: bool = False) -> Interval:
        low, _ = self.place(None)
        return exactly(np.zeros(low.shape[:-1]))

    def least_in_motion(self, margin: Callable[[Any], Array]) -> Interval:
        raise ValueError("no motion is seen here")

    def weakest_link(self, graph: ir.Graph) -> Interval:
        raise ValueError("a graph is not seen here")

    def level(self, resource: ir.Resource) -> Interval:
        raise ValueError("the steps before are not seen here")

    def flagged(self, flag: ir.Flag) -> Interval:
        raise ValueError("the steps before are not seen here")

    def facing(self, towards: float | ir.Beacon, within: float) -> Interval:
        raise ValueError("no heading is seen here")
