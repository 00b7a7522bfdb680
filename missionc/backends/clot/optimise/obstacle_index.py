"""Spatial index of obstacles: near obstacles of many points at once, and the distances to them.

Static obstacles are found by a point's cell of the plane; moving and growing obstacles are all tested. In both cases
bounding boxes filter them, and distances to the remaining obstacles are computed. Differences of boxes are decomposed
into boxes, with exact distances. The signed distance to a difference is only a bound: for a door in a wall, it includes
the edges of the removed part and makes the door too narrow.

Source:
    [clot] III-B, MSD to the obstacles; IV-D.3 (II), obstacles that move.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import DTypeLike

from missionc.backends.clot.optimise.dual_numbers import Values
from missionc.backends.clot.optimise.stacked_shapes import Lists, Stacked, lists
from missionc.base.late_dataclass import Record
from missionc.base.trace import Array, Indices
from missionc.geometry.bounding_box import box_around
from missionc.geometry.displacement import displaced
from missionc.geometry.outline import outlined
from missionc.ir import Box, Difference, Mission, Obstacle, Shape, Union
from missionc.ir.distances.signed_distance import signed_distance


def carved(obstacle: Obstacle) -> list[Obstacle]:
    """Obstacles with plain boxes that together equal an obstacle made of boxes; other obstacles unchanged."""
    pieces = _pieces(obstacle.shape)
    return [obstacle] if pieces is None else [replace(obstacle, shape=piece) for piece in pieces]


def _pieces(shape: Shape) -> list[Box] | None:
    match shape:
        case Box():
            return [shape]
        case Union(left, right):
            one, other = _pieces(left), _pieces(right)
            return None if one is None or other is None else one + other
        case Difference(left, right):
            one, other = _pieces(left), _pieces(right)
            if one is None or other is None:
                return None
            for taken in other:
                one = [piece for box in one for piece in _without(box, taken)]
            return one
        case _:
            return None


def _without(box: Box, taken: Box) -> Iterator[Box]:
    """Yield the boxes that remain of ``box`` without ``taken``, on both sides of it, axis by axis."""
    if any(a >= d or c >= b for a, b, c, d in zip(box.low, box.high, taken.low, taken.high, strict=True)):
        yield box
        return
    low, high = list(box.low), list(box.high)
    for axis, (begin, end) in enumerate(zip(taken.low, taken.high, strict=True)):
        if low[axis] < begin:
            yield Box(tuple(low), (*high[:axis], begin, *high[axis + 1 :]))
            low[axis] = begin
        if end < high[axis]:
            yield Box((*low[:axis], end, *low[axis + 1 :]), tuple(high))
            high[axis] = end


class Pairs(Record, eq=False):
    """Pairs of points and obstacles that may be near each other.

    Args:
        row: index of the point, (pairs,).
        which: index of the obstacle, (pairs,).
        shift: displacement of the obstacle, (pairs, dim), metres.
        grown: growth of the obstacle, (pairs,), metres.
    """

    row: Indices
    which: Indices
    shift: Array
    grown: Array


class _Cells(Record, eq=False):
    """Grid of the plane with the static obstacles within reach of each cell, row by row."""

    low: Array
    size: Array
    along: int
    lists: Lists


class Obstacles:
    """Spatial index of obstacles.

    Args:
        every: obstacles to include.
        times: times of queries, seconds.
        dtype: type of the points.
    """

    def __init__(
        self,
        mission: Mission,
        every: Sequence[Obstacle],
        times: Sequence[float] | Array = (0.0,),
        dtype: DTypeLike = np.float64,
    ) -> None:
        self.mission = mission
        dim = mission.dimension
        if dim == 3:  # in the plane an outline is equally exact, and one obstacle
            every = [piece for obstacle in every for piece in carved(obstacle)]
        self.solid = tuple(every)
        shapes = [outlined(obstacle.shape) for obstacle in every]
        self.stacked = Stacked(shapes, dim, dtype)
        boxes = np.array([box_around(obstacle.shape, dim) for obstacle in every]).reshape(-1, 2, dim)
        boxes.sort(axis=1)  # for a disjoint intersection, the corners are reversed
        self.low, self.high = (boxes[:, side].astype(dtype) for side in (0, 1))
        self.standing = [shape for shape, obstacle in zip(shapes, every, strict=True) if obstacle.constant]
        still = np.array([obstacle.constant for obstacle in every], dtype=np.bool_)
        self.still, self.movers = np.flatnonzero(still), np.flatnonzero(~still)
        self.moved = np.zeros((len(times), len(self.movers), dim), dtype)
        self.grown = np.zeros((len(times), len(self.movers)), dtype)
        for place, obstacle in enumerate(each for each in every if not each.constant):
            self.moved[:, place] = [displaced(obstacle, time, dim) for time in times]
            self.grown[:, place] = [obstacle.grown(time) for time in times]
        self.cells: dict[float, _Cells] = {}

    def near(self, points: Array, instant: Indices, reach: float) -> Pairs:
        """Pairs of points and obstacles whose bounding boxes are less than ``reach`` away from the points.

        Args:
            points: (rows, dim), metres.
            instant: time of each point as an index into ``times``, (rows,).
            reach: metres.
        """
        row, which = self._standing(points, reach)
        shift, swelling = np.zeros((len(row), points.shape[1]), points.dtype), np.zeros(len(row), points.dtype)
        if len(self.movers):
            moved, grown = self.moved[instant], self.grown[instant]
            beside = self._beside(points[:, None] - moved, self.movers[None])
            passing, mover = np.nonzero(beside < (reach + grown) ** 2)
            row, which = np.concatenate([row, passing]), np.concatenate([which, self.movers[mover]])
            shift = np.concatenate([shift, moved[passing, mover]])
            swelling = np.concatenate([swelling, grown[passing, mover]])
        return Pairs(row, which, shift, swelling)

    def distance(self, points: Values, pairs: Pairs) -> Values:
        """Distance of the points of pairs, (pairs, dim), from their obstacles.

        Shape: (pairs,), metres; of dual numbers with the gradient.
        """
        return self.stacked.distance(points - pairs.shift, pairs.which) - pairs.grown

    def room(self, points: Array, instant: Indices, reach: float) -> Array:
        """Distance of points from the nearest obstacle, at most ``reach``: (rows, dim), metres -> (rows,), metres."""
        pairs = self.near(points, instant, reach)
        room = np.full(len(points), reach, points.dtype)
        np.minimum.at(room, pairs.row, self.distance(points[pairs.row], pairs))
        return room

    def standing_room(self, points: Array) -> Array:
        """Distance of points from the nearest static obstacle, without limit: (rows, dim), metres -> (rows,),
        metres."""
        few = 8  # number of obstacles up to which each is evaluated separately
        chunk = 1 << 18  # pairs of points and boxes in one array
        room = np.full(len(points), np.inf)
        if len(self.still) <= few:
            for shape in self.standing:
                room = np.minimum(room, np.asarray(signed_distance(np, shape, points)))
            return room
        size = max(chunk // max(len(self.still), 1), 1)
        for begin in range(0, len(points) if len(self.still) else 0, size):
            some = points[begin : begin + size]
            beside = self._beside(some[:, None], self.still[None])
            nearest = self.stacked.distance(some, self.still[beside.argmin(axis=1)])
            # A shape nearer than that of the nearest box has a nearer box, or one that contains the point.
            row, place = np.nonzero(beside <= (np.maximum(nearest, 0.0) ** 2)[:, None])
            np.minimum.at(nearest, row, self.stacked.distance(some[row], self.still[place]))
            room[begin : begin + size] = nearest
        return room

    def _standing(self, points: Array, reach: float) -> tuple[Indices, Indices]:
        if not len(self.still):
            return self.still, self.still
        if reach not in self.cells:
            self.cells[reach] = self._made(reach)
        cells = self.cells[reach]
        at = _cell(points[:, :2], cells)
        at = at[:, 0] * cells.along + at[:, 1]
        some = np.flatnonzero(cells.lists.count[at])
        place, _, number = cells.lists.of(at[some])
        row, which = some[place], self.still[number]
        close = self._beside(points[row], which) < reach * reach
        return row[close], which[close]

    def _made(self, reach: float) -> _Cells:
        cells = 64  # along each axis of the plane, at most
        low, high = self.low[self.still, :2] - reach, self.high[self.still, :2] + reach
        corner = np.array(self.mission.world.low[:2], low.dtype)
        extent = np.array(self.mission.world.high[:2], low.dtype) - corner
        along = min(cells, 2 * int(np.ceil(np.sqrt(len(self.still)))))
        empty = _Cells(corner, extent / along, along, lists((), np.zeros(0, dtype=np.int64)))
        # Points outside the world use the border cell; a box reaches as far as its points.
        first, last = _cell(low, empty), _cell(high, empty)
        span = last - first + 1
        count = span.prod(axis=1)
        place, within, _ = lists(count, np.arange(count.sum())).of(np.arange(len(span)))
        cell = (first[place, 0] + within // span[place, 1]) * along + first[place, 1] + within % span[place, 1]
        order = cell.argsort(kind="stable")
        return _Cells(corner, empty.size, along, lists(np.bincount(cell, minlength=along * along), place[order]))

    def _beside(self, points: Array, which: Indices) -> Array:
        """Squared distance of points, (..., dim), metres, from bounding boxes: (...), square metres, 0 inside."""
        beside = np.maximum(np.maximum(self.low[which] - points, points - self.high[which]), 0.0)
        squared: Array = (beside * beside).sum(axis=-1)
        return squared


def _cell(points: Array, cells: _Cells) -> Indices:
    """Cell indices of points, metres: (rows, 2) -> (rows, 2), int64; for points outside the world, the nearest cell."""
    return np.clip(np.floor((points - cells.low) / cells.size), 0, cells.along - 1).astype(np.int64)
