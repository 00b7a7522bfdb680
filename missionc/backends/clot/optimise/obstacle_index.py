"""Spatial index of obstacles: the near ones for many points at once, and the distances to these.

Static obstacles are looked up by a point's cell of the plane; moving and growing ones are all tested. In both cases
bounding boxes filter them, and distances are computed to the rest. Differences of boxes become the remaining boxes,
with exact distances. The signed distance to a difference is only a bound: for a door in a wall, it includes the edges
of the removed part and makes the door too narrow.

Source:
    [clot] III-B, MSD to the obstacles; IV-D.3 (II), obstacles that move.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
import torch
from torch import Tensor

from missionc.backends.clot.optimise.stacked_shapes import Lists, Stacked, lists
from missionc.base.late_dataclass import Record
from missionc.base.trace import Array
from missionc.geometry.bounding_box import box_around
from missionc.geometry.displacement import displaced
from missionc.geometry.outline import outlined
from missionc.ir import Box, Difference, Mission, Obstacle, Shape, Union
from missionc.ir.distances.signed_distance import signed_distance


def carved(obstacle: Obstacle) -> list[Obstacle]:
    """Split an obstacle of boxes into solid ones; others stay unchanged."""
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
    """Remaining boxes on both sides of the removed one, axis by axis."""
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
    """Points and obstacles that may be near each other.

    Args:
        row: (pairs,), index of the point.
        which: (pairs,), index of the obstacle.
        shift: (pairs, dim), displacement of the obstacle, metres.
        grown: (pairs,), its growth, metres.
    """

    row: Tensor
    which: Tensor
    shift: Tensor
    grown: Tensor


class _Cells(Record, eq=False):
    """Static obstacles within reach of each cell, row by row."""

    low: Tensor
    size: Tensor
    along: int
    lists: Lists


class Obstacles:
    """Obstacles of a mission.

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
        dtype: torch.dtype = torch.float64,
        device: torch.device | None = None,
    ) -> None:
        self.mission = mission
        dim = mission.dimension
        if dim == 3:  # in the plane an outline is equally exact, and one obstacle
            every = [piece for obstacle in every for piece in carved(obstacle)]
        self.solid = tuple(every)
        shapes = [outlined(obstacle.shape) for obstacle in every]
        self.stacked = Stacked(shapes, dim, dtype, device)
        boxes = np.array([box_around(obstacle.shape, dim) for obstacle in every]).reshape(-1, 2, dim)
        boxes.sort(axis=1)  # for a disjoint intersection, the corners are reversed
        self.low, self.high = (torch.from_numpy(boxes[:, side]).to(device, dtype) for side in (0, 1))
        self.standing = [shape for shape, obstacle in zip(shapes, every, strict=True) if obstacle.constant]
        still = [obstacle.constant for obstacle in every]
        self.still = torch.tensor([number for number, stands in enumerate(still) if stands], dtype=torch.int64).to(
            device
        )
        self.movers = torch.tensor([number for number, stands in enumerate(still) if not stands], dtype=torch.int64).to(
            device
        )
        moved = np.zeros((len(times), len(self.movers), dim))
        grown = np.zeros((len(times), len(self.movers)))
        for place, obstacle in enumerate(each for each in every if not each.constant):
            moved[:, place] = [displaced(obstacle, time, dim) for time in times]
            grown[:, place] = [obstacle.grown(time) for time in times]
        self.moved, self.grown = (torch.from_numpy(each).to(device, dtype) for each in (moved, grown))
        self.cells: dict[float, _Cells] = {}

    def near(self, points: Tensor, instant: Tensor, reach: float) -> Pairs:
        """Obstacles with bounding boxes less than ``reach`` away from points.

        Args:
            points: (rows, dim), metres.
            instant: (rows,), index into ``times``.
            reach: metres.
        """
        row, which = self._standing(points, reach)
        shift, swelling = points.new_zeros(len(row), points.shape[1]), points.new_zeros(len(row))
        if len(self.movers):
            moved, grown = self.moved[instant], self.grown[instant]
            beside = self._beside(points[:, None] - moved, self.movers[None])
            passing, mover = torch.nonzero(beside < (reach + grown) ** 2, as_tuple=True)
            row, which = torch.cat([row, passing]), torch.cat([which, self.movers[mover]])
            shift = torch.cat([shift, moved[passing, mover]])
            swelling = torch.cat([swelling, grown[passing, mover]])
        return Pairs(row, which, shift, swelling)

    def distance(self, points: Tensor, pairs: Pairs) -> Tensor:
        """Distance of the points of pairs, (pairs, dim), from their obstacles.

        Shape: (pairs,), metres, with gradient.

        Shape: (pairs,), metres, with its gradient.
        """
        return self.stacked.distance(points - pairs.shift, pairs.which) - pairs.grown

    def room(self, points: Tensor, instant: Tensor, reach: float) -> Tensor:
        """Distance of points from the nearest obstacle, at most ``reach``: (rows,), metres."""
        pairs = self.near(points, instant, reach)
        room = points.new_full((len(points),), reach)
        return room.scatter_reduce_(0, pairs.row, self.distance(points[pairs.row], pairs), "amin")

    def standing_room(self, points: Array) -> Array:
        """Distance of points from the nearest static obstacle, without limit: (rows, dim) -> (rows,), metres.

        Shape: (rows, dim) -> (rows,), metres.
        """
        few = 8  # number of obstacles up to which each is evaluated separately
        chunk = 1 << 18  # pairs of points and boxes in one array
        room = np.full(len(points), np.inf)
        if len(self.still) <= few:
            for shape in self.standing:
                room = np.minimum(room, np.asarray(signed_distance(np, shape, points)))
            return room
        size = max(chunk // max(len(self.still), 1), 1)
        for begin in range(0, len(points) if len(self.still) else 0, size):
            some = torch.from_numpy(points[begin : begin + size])
            beside = self._beside(some[:, None], self.still[None])
            nearest = self.stacked.distance(some, self.still[beside.argmin(dim=1)])
            # A shape nearer than that of the nearest box has a nearer box, or one that contains the point.
            row, place = torch.nonzero(beside <= (nearest.clamp_min(0.0) ** 2)[:, None], as_tuple=True)
            every = self.stacked.distance(some[row], self.still[place])
            room[begin : begin + size] = nearest.scatter_reduce_(0, row, every, "amin").numpy()
        return room

    def _standing(self, points: Tensor, reach: float) -> tuple[Tensor, Tensor]:
        if not len(self.still):
            return self.still, self.still
        if reach not in self.cells:
            self.cells[reach] = self._made(reach)
        cells = self.cells[reach]
        at = _cell(points[:, :2], cells)
        at = at[:, 0] * cells.along + at[:, 1]
        some = torch.nonzero(cells.lists.count[at])[:, 0]
        place, _, number = cells.lists.of(at[some])
        row, which = some[place], self.still[number]
        close = self._beside(points[row], which) < reach * reach
        return row[close], which[close]

    def _made(self, reach: float) -> _Cells:
        cells = 64  # along each axis of the plane, at most
        low, high = self.low[self.still, :2] - reach, self.high[self.still, :2] + reach
        corner = torch.tensor(self.mission.world.low[:2], dtype=low.dtype, device=low.device)
        extent = torch.tensor(self.mission.world.high[:2], dtype=low.dtype, device=low.device) - corner
        along = min(cells, 2 * int(np.ceil(np.sqrt(len(self.still)))))
        empty = _Cells(corner, extent / along, along, lists([], torch.zeros(0, dtype=torch.int64), low.device))
        # Points outside the world use the border cell; a box reaches as far as its points.
        first, last = _cell(low, empty), _cell(high, empty)
        span = last - first + 1
        boxes = lists(span.prod(dim=1).cpu().numpy(), torch.arange(int(span.prod(dim=1).sum())), low.device)
        place, within, _ = boxes.of(torch.arange(len(span), device=low.device))
        cell = (first[place, 0] + within // span[place, 1]) * along + first[place, 1] + within % span[place, 1]
        order = cell.argsort(stable=True)
        count = torch.bincount(cell, minlength=along * along)
        return _Cells(corner, empty.size, along, lists(count.cpu().numpy(), place[order], low.device))

    def _beside(self, points: Tensor, which: Tensor) -> Tensor:
        """Squared distance of points, (..., dim), from boxes: (...), square metres, 0 inside."""
        beside = torch.maximum(self.low[which] - points, points - self.high[which]).clamp_min(0.0)
        return (beside * beside).sum(dim=-1)


def _cell(points: Tensor, cells: _Cells) -> Tensor:
    """Cell indices of points in metres: (rows, 2) -> (rows, 2), int64.

    Outside the world, the nearest cell.
    """
    return ((points - cells.low) / cells.size).floor().clamp(0, cells.along - 1).long()
