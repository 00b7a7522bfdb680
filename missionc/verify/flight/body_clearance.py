"""Lower bounds on the distance of curves from a body, on a whole part of them.

Two bounds, of which the better one counts. The curve is no further from its
middle than its control points: the distance there, less that, bounds the
distance everywhere. And a plane that has the body behind it bounds the
distance by that of the control points to the plane, which is exact along a
straight wall, however long the part is.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import product
from math import isfinite, sqrt
from typing import assert_never

import numpy as np

from missionc.base.trace import Array
from missionc.curves.bernstein_intervals import GROWN, Enclosed, lowered
from missionc.curves.piecewise_polynomials import Indices
from missionc.ir import Ball, Box, Difference, Disc, Intersection, Polygon, Prism, Shape, Union
from missionc.verify.flight.flight_curves import ALLOWANCE
from missionc.verify.plan.obstacle_bodies import solid
from missionc.verify.proof.claims import Bounds, Judge


def clear_of(shape: Shape, dimension: int, need: Array) -> Judge:
    """How much further from the body than ``need``, (items,), metres."""
    bounds = _distance_bounds(shape, dimension)

    def judge(item: Indices, curve: Enclosed) -> Bounds:
        off = curve.radius.max(axis=-1) * sqrt(dimension)
        lower, there, err = bounds(curve.middle().points[..., 0], curve.points, off)
        return lowered(lower - err - need[item]), there + 2 * err - need[item], np.full(item.size, 0.5)

    return judge


def clear_of_growing(judge: Judge) -> Judge:
    """The same of a body that grows: the last coordinate of a curve, metres, says by how much it has."""

    def grown(item: Indices, curve: Enclosed) -> Bounds:
        growth = curve[:, -1]
        lower, seen, share = judge(item, curve[:, :-1])
        half = growth.middle()
        return lowered(lower - growth.high()), seen - half.points[..., 0] + half.radius, share

    return grown


def box_clear_of(shape: Shape, dimension: int) -> Callable[[Array, Array, Array], Array]:
    """How much further from the body than ``need``, metres, all of a box is.

    (parts, dim) twice and (parts,) -> (parts,).
    """
    bounds = _distance_bounds(shape, dimension)

    def far(low: Array, high: Array, need: Array) -> Array:
        at_high = np.array(list(product((False, True), repeat=dimension)))
        corners = np.where(at_high, high[:, None], low[:, None]).swapaxes(1, 2)
        lower, _, err = bounds((low + high) / 2, corners, np.zeros(len(low)))
        return lowered(lower - err - need)

    return far


def _distance_bounds(shape: Shape, dimension: int) -> Callable[[Array, Array, Array], tuple[Array, Array, Array]]:
    """Bounds for parts of which a point is known, (parts, dim), and points around them, (parts, dim, points), but for
    some metres, (parts,).

    Each gives the least distance to the body, the distance of the point, and what both may err by: (parts,) each.
    """
    distance, size = solid(shape, dimension), _size(shape)

    def bounds(centre: Array, around: Array, off: Array) -> tuple[Array, Array, Array]:
        away = np.sqrt(((around - centre[..., None]) ** 2).sum(axis=-2)).max(axis=-1)
        err = ALLOWANCE * (size + np.abs(centre).max(axis=-1) + away) + off * GROWN
        there = distance(centre)
        return np.fmax(there - away, _beyond_plane(shape, centre, around)), there, err

    return bounds


def _beyond_plane(shape: Shape, centre: Array, points: Array) -> Array:
    """(parts,): a lower bound of the distance to the body from planes; -inf where none separates ``centre`` from it.

    (parts, dim), (parts, dim, points).
    """
    match shape:
        case Union(left, right):
            return np.minimum(_beyond_plane(left, centre, points), _beyond_plane(right, centre, points))
        case Intersection(left, right):
            return np.maximum(_beyond_plane(left, centre, points), _beyond_plane(right, centre, points))
        case Difference(left, _):
            return _beyond_plane(left, centre, points)
        case Box() | Disc() | Ball() | Polygon():
            normal = centre - _nearest(shape, centre)
            length = np.linalg.norm(normal, axis=-1)
            separate = length > 0
            normal = normal / np.where(separate, length, 1.0)[:, None]
            along = (normal[..., None] * points).sum(axis=-2).min(axis=-1)
            return np.where(separate, along - _support(shape, normal), -np.inf)
        case _:
            assert_never(shape)


def _nearest(shape: Box | Disc | Ball | Polygon, centre: Array) -> Array:
    """The shape's point nearest to each centre, roughly: (parts, dim). The plane it lays is judged by itself."""
    near = centre.copy()
    match shape:
        case Box(low, high):
            return np.clip(centre, low, high)
        case Ball(middle, radius):
            return _in_ball(np.array(middle), radius, centre)
        case Disc(middle, radius, band):
            near[:, :2] = _in_ball(np.array(middle), radius, centre[:, :2])
        case Polygon(corners, band):
            near[:, :2] = _in_polygon(np.array(corners), centre[:, :2])
    if band is not None:
        near[:, 2] = np.clip(centre[:, 2], band.low, band.high)
    return near


def _in_ball(middle: Array, radius: float, points: Array) -> Array:
    offset = points - middle
    length = np.linalg.norm(offset, axis=-1, keepdims=True)
    return np.asarray(middle + offset * np.minimum(1.0, radius / np.where(length > 0, length, 1.0)))


def _in_polygon(corners: Array, points: Array) -> Array:
    """Points inside stay where they are."""
    start, along = corners, np.roll(corners, -1, axis=0) - corners
    offset = points[:, None] - start
    square = (along**2).sum(axis=-1)
    share = np.clip((offset * along).sum(axis=-1) / np.where(square > 0, square, 1.0), 0.0, 1.0)
    feet = start + share[..., None] * along
    best = ((points[:, None] - feet) ** 2).sum(axis=-1).argmin(axis=-1)
    above = start[:, 1] > points[:, None, 1]
    crosses = above != np.roll(above, -1, axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        at = start[:, 0] + along[:, 0] * (points[:, None, 1] - start[:, 1]) / along[:, 1]
    inside = (crosses & (points[:, None, 0] < at)).sum(axis=-1) % 2 == 1
    return np.where(inside[:, None], points, feet[np.arange(len(points)), best])


def _support(shape: Box | Disc | Ball | Polygon, normal: Array) -> Array:
    """How far the body reaches along unit vectors: (parts, dim) -> (parts,)."""
    match shape:
        case Box(low, high):
            return np.asarray(sum(_farthest(normal[:, axis], low[axis], high[axis]) for axis in range(len(low))))
        case Ball(middle, radius):
            return np.asarray(normal @ np.array(middle) + radius)
        case Disc(middle, radius, band):
            flat = normal[:, :2]
            reach = flat @ np.array(middle) + radius * np.linalg.norm(flat, axis=-1)
        case Polygon(corners, band):
            reach = (normal[:, :2] @ np.array(corners).T).max(axis=-1)
    return np.asarray(reach if band is None else reach + _farthest(normal[:, 2], band.low, band.high))


def _farthest(slope: Array, low: float, high: float) -> Array:
    """The largest of ``slope * x`` for x from low to high, which may be infinite."""
    end = np.where(slope > 0, high, low)
    return np.where(slope == 0, 0.0, slope * np.where(slope == 0, 0.0, end))


def _size(shape: Shape) -> float:
    """Metres: no number of the shape is larger, but one."""
    match shape:
        case Union(left, right) | Intersection(left, right) | Difference(left, right):
            return max(_size(left), _size(right))
        case Box(low, high):
            numbers = (*low, *high)
        case Ball(middle, radius):
            numbers = (*middle, radius)
        case Disc(middle, radius, band):
            numbers = (*middle, radius, *_heights(band))
        case Polygon(corners, band):
            numbers = (*(value for corner in corners for value in corner), *_heights(band))
        case _:
            assert_never(shape)
    return 1.0 + max(abs(number) for number in numbers if isfinite(number))


def _heights(band: Prism | None) -> tuple[float, ...]:
    return () if band is None else (band.low, band.high)
