"""Signed distances of points to many shapes, each point to its own shape, in one operation on stacked tables.

Every plain shape is a polygon of one or more corners, with a radius, between two heights; a ball is one corner with its
height. Combined shapes are evaluated level by level. The values equal ``ir.distances.signed_distance``.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import assert_never

import numpy as np
from numpy.typing import DTypeLike

from missionc.backends.clot.optimise.dual_numbers import Dual, Values
from missionc.base.late_dataclass import Record
from missionc.base.trace import Array, Indices
from missionc.ir import Ball, Box, Difference, Disc, Intersection, Polygon, Prism, Shape, Union

EVERYWHERE = Prism(-np.inf, np.inf)

OPERATIONS = {Union: (1.0, 1.0), Intersection: (-1.0, -1.0), Difference: (-1.0, 1.0)}
"""Signs that combine two distances as ``own * min(own * left, other * right)``, by set operation."""


class Leaves(Record, eq=False):
    """Table of plain shapes with similar numbers of sides.

    Args:
        sides: (leaves, 6, sides): start of a side (x and y), its direction (x and y), the inverse of its squared
            length, and its slope dx/dy. Sides of length zero have 0; the first corner is the padding.
        own: (leaves, 5): radius, bottom and top, height of the centre of a ball, 1 for balls and 0 for others.
    """

    sides: Array
    own: Array


class Lists(Record, eq=False):
    """List of rows for each shape: rows, (rows,), in sequence; first index and count, (shapes,)."""

    rows: Indices
    first: Indices
    count: Indices

    def of(self, which: Indices) -> tuple[Indices, Indices, Indices]:
        """Rows of the shapes ``which``, (some,): index into ``which``, index in the shape's list, and row, (rows,)
        each."""
        count = self.count[which]
        place = np.repeat(np.arange(len(which)), count)
        within = np.arange(len(place)) - (count.cumsum() - count)[place]
        return place, within, self.rows[self.first[which][place] + within]


class Stacked:
    """Stacked tables of shapes.

    Args:
        dimension: dimension of the points.
        dtype: type of the points.
    """

    def __init__(self, shapes: Sequence[Shape], dimension: int, dtype: DTypeLike = np.float64) -> None:
        self.dimension = dimension
        trees = [_Tree(shape) for shape in shapes]
        plain = [leaf for tree in trees for leaf in tree.leaves]
        corners = [_corners(leaf) for leaf in plain]
        wide = np.array([1 << (len(each) - 1).bit_length() for each in corners], dtype=np.int64)
        self.leaves, bucket, row = [], np.zeros(len(plain), dtype=np.int64), np.zeros(len(plain), dtype=np.int64)
        for number, width in enumerate(np.unique(wide)):
            members = np.flatnonzero(wide == width)
            bucket[members], row[members] = number, np.arange(len(members))
            sides = np.stack([_sides(corners[each], int(width)) for each in members])
            own = np.array([_own(plain[each]) for each in members])
            self.leaves.append(Leaves(sides.astype(dtype), own.astype(dtype)))
        self.bucket, self.row = bucket, row
        self.of_shape = lists([len(tree.leaves) for tree in trees], np.arange(len(plain)))
        self.slots = np.array([len(tree.leaves) + len(tree.folds) for tree in trees], dtype=np.int64)
        folds = [fold for tree in trees for fold in tree.folds]
        self.folds = np.array([fold[1:] for fold in folds], dtype=dtype).reshape(-1, 5)
        level = np.array([fold[0] for fold in folds], dtype=np.int64)
        owner = np.repeat(np.arange(len(trees)), [len(tree.folds) for tree in trees])
        self.levels = [
            lists(np.bincount(owner[level == each], minlength=len(trees)), np.flatnonzero(level == each))
            for each in np.unique(level)
        ]

    def distance(self, points: Values, which: Indices) -> Values:
        """Distance of each point from its shape's border.

        Shape: (rows, dim), (rows,) -> (rows,), metres, negative inside.

        Of dual numbers, with the gradient by the points: a unit vector if defined, as in ``world.signed_distance``.
        """
        if isinstance(points, Dual):
            return points.through(*self.measured(points.value, which, True))
        return self.measured(points, which, False)[0]

    def measured(self, points: Array, which: Indices, slope: bool) -> tuple[Array, Array]:
        """Signed distances, (rows,), metres, and with ``slope`` their gradients, (rows, dim); otherwise empty
        gradients."""
        if not self.levels:
            return self._leaves(points, which, slope)
        place, within, leaf = self.of_shape.of(which)
        slots = self.slots[which]
        base = slots.cumsum() - slots
        total = int(slots.sum())
        value = np.empty(total, points.dtype)
        gradient = np.empty((total if slope else 0, self.dimension), points.dtype)
        slot = base[place] + within
        value[slot], leaf_gradient = self._leaves(points[place], leaf, slope)
        if slope:
            gradient[slot] = leaf_gradient
        for level in self.levels:
            place, _, row = level.of(which)
            fold, begin = self.folds[row], base[place]
            out, left, right = (begin + fold[:, column].astype(np.int64) for column in range(3))
            own, other = fold[:, 3], fold[:, 4]
            one, two = own * value[left], other * value[right]
            value[out] = own * np.minimum(one, two)
            if slope:
                turned = (own * other)[:, None] * gradient[right]
                gradient[out] = np.where((one <= two)[:, None], gradient[left], turned)
        last = base + slots - 1
        return value[last], gradient[last] if slope else gradient

    def _leaves(self, points: Array, leaf: Indices, slope: bool) -> tuple[Array, Array]:
        """Signed distances to plain shapes, by their own indices: (rows,), metres, and gradients, (rows, dim)."""
        chunk = 1 << 16  # numbers in one table, which stays in the cache
        if len(self.leaves) == 1 and len(leaf) * self.leaves[0].sides.shape[2] <= chunk:
            return _plain(points, self.leaves[0].sides[leaf], self.leaves[0].own[leaf], slope)
        value = np.empty(len(leaf), points.dtype)
        gradient = np.empty((len(leaf) if slope else 0, self.dimension), points.dtype)
        bucket, row = self.bucket[leaf], self.row[leaf]
        for number, leaves in enumerate(self.leaves):
            own, size = np.flatnonzero(bucket == number), max(chunk // leaves.sides.shape[2], 1)
            for begin in range(0, len(own), size):
                at = own[begin : begin + size]
                value[at], leaf_gradient = _plain(points[at], leaves.sides[row[at]], leaves.own[row[at]], slope)
                if slope:
                    gradient[at] = leaf_gradient
        return value, gradient


def lists(count: Sequence[int] | Indices, rows: Indices) -> Lists:
    """Lists of ``count`` rows each, one list after the other."""
    counts = np.asarray(count, dtype=np.int64)
    return Lists(rows, counts.cumsum() - counts, counts)


def _plain(points: Array, sides: Array, own: Array, slope: bool) -> tuple[Array, Array]:
    """Signed distance of each point to its plain shape, (rows,), metres, and its gradient, (rows, dim)."""
    x, y, along_x, along_y, scale, slant = (sides[:, column] for column in range(6))
    off_x, off_y = points[:, :1] - x, points[:, 1:2] - y
    row = np.arange(len(points))
    if sides.shape[2] > 1:
        below = off_y < 0
        crosses = (below != np.roll(below, -1, axis=1)) & (off_x < off_y * slant)
        inside = crosses.sum(axis=1) % 2 == 1
        share = np.clip((off_x * along_x + off_y * along_y) * scale, 0.0, 1.0)
        off_x, off_y = off_x - share * along_x, off_y - share * along_y
        side = (off_x * off_x + off_y * off_y).argmin(axis=1)
        off_x, off_y = off_x[row, side], off_y[row, side]
    else:
        inside, off_x, off_y = np.zeros(len(points), dtype=np.bool_), off_x[:, 0], off_y[:, 0]
    nearest = off_x * off_x + off_y * off_y
    radius, bottom, top, middle, ball = own.T
    if points.shape[1] == 3:
        rise = ball * (points[:, 2] - middle)
        nearest = nearest + rise * rise
    length = np.sqrt(nearest)
    plane = np.where(inside, -length, length) - radius
    gradient = np.empty(0)
    if slope:
        ways = [off_x, off_y, rise] if points.shape[1] == 3 else [off_x, off_y]
        unit = np.stack(ways, axis=1) / np.where(length > 0, length, 1.0)[:, None]
        gradient = np.where(inside[:, None], -unit, unit)
    if points.shape[1] == 2:
        return plane, gradient
    height = points[:, 2]
    level = np.maximum(bottom - height, height - top)
    beside, above = np.maximum(plane, 0.0), np.maximum(level, 0.0)
    outside = np.sqrt(beside * beside + above * above)
    if slope:
        out = outside > 0
        scale = np.where(out, outside, 1.0)
        of_plane = np.where(out, beside / scale, plane >= level)
        of_level = np.where(out, above / scale, plane < level)
        gradient = of_plane[:, None] * gradient
        gradient[:, 2] += of_level * np.where(height - top > bottom - height, 1.0, -1.0)
    return outside + np.minimum(np.maximum(plane, level), 0.0), gradient


class _Tree:
    """Plain shapes that a shape combines, in order, and their set operations, lower levels first.

    An operation has its level, its slot, the slots of its two parts and its two signs. Slots are the plain shapes, then
    the operations; the last slot is the shape itself.
    """

    def __init__(self, shape: Shape) -> None:
        self.leaves: list[Box | Disc | Ball | Polygon] = []
        folds: list[tuple[int, int, int, float, float]] = []

        def walk(shape: Shape) -> tuple[int, int]:
            """Level and index of a shape: the index of a plain shape, or the bitwise complement of an operation's
            index."""
            match shape:
                case Union(left, right) | Intersection(left, right) | Difference(left, right):
                    (one, left_number), (two, right_number) = walk(left), walk(right)
                    level = max(one, two) + 1
                    folds.append((level, left_number, right_number, *OPERATIONS[type(shape)]))
                    return level, ~(len(folds) - 1)
                case Box() | Disc() | Ball() | Polygon():
                    self.leaves.append(shape)
                    return 0, len(self.leaves) - 1
                case _:
                    assert_never(shape)

        walk(shape)
        count = len(self.leaves)

        def slot(number: int) -> int:
            return number if number >= 0 else count + ~number

        self.folds = [
            (level, count + place, slot(left), slot(right), own, other)
            for place, (level, left, right, own, other) in enumerate(folds)
        ]


def _corners(shape: Box | Disc | Ball | Polygon) -> list[tuple[float, float]]:
    match shape:
        case Box(low, high):
            return [(low[0], low[1]), (high[0], low[1]), (high[0], high[1]), (low[0], high[1])]
        case Disc(centre, _) | Ball(centre, _):
            return [(centre[0], centre[1])]
        case Polygon(corners):
            return list(corners)
        case _:
            assert_never(shape)


def _sides(corners: list[tuple[float, float]], width: int) -> Array:
    begin = np.array(corners + corners[:1] * (width - len(corners)))
    along = np.roll(begin, -1, axis=0) - begin
    square, rise = (along**2).sum(axis=1), along[:, 1]
    scale, slant = (
        np.divide(each, by, out=np.zeros(width), where=by != 0) for each, by in ((1.0, square), (along[:, 0], rise))
    )
    return np.concatenate([begin.T, along.T, [scale, slant]])


def _own(shape: Box | Disc | Ball | Polygon) -> tuple[float, ...]:
    match shape:
        case Box(low, high):
            band = Prism(low[2], high[2]) if len(low) == 3 else EVERYWHERE
            return 0.0, band.low, band.high, 0.0, 0.0
        case Disc(_, radius, band):
            band = band or EVERYWHERE
            return radius, band.low, band.high, 0.0, 0.0
        case Ball(centre, radius):
            return radius, EVERYWHERE.low, EVERYWHERE.high, centre[-1], 1.0
        case Polygon(_, band):
            band = band or EVERYWHERE
            return 0.0, band.low, band.high, 0.0, 0.0
        case _:
            assert_never(shape)
