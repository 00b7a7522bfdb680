"""Cells: boxes that hold every place where the centre of a kind of agent may be.

    in   Mission, a kind of agent
    out  Cells

The world is halved again and again, a box that a border crosses before others and along that border where it runs
along an axis. A box is left out only if no centre in it is clear of what stands.

Source:
    Latombe, "Robot Motion Planning", 1991, chapter 6: approximate cell decomposition.
"""

from __future__ import annotations

import heapq
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from missionc.backends.cover.bodies import SLACK, standing_room
from missionc.backends.cover.borders import Border
from missionc.base.trace import Array, Flags
from missionc.ir import Agent, Mission
from missionc.world.distance_ranges import Range, length_range

CROSSED = 4.0
"""A box that a border crosses is halved as if it were so many times as long."""

EDGE = 0.1
"""A box is cut along a border that is further than this share of its side from its own."""


@dataclass(frozen=True, eq=False)
class Cells:
    """Boxes, (cells, dim) corners each, metres. The last ``points`` are single points: starts and finishes.

    ``left_out`` are the corners of the boxes with no room in them, (boxes, dim) each.
    """

    low: Array
    high: Array
    left_out: tuple[Array, Array]
    points: int = 0

    def __len__(self) -> int:
        return len(self.low)

    @property
    def middle(self) -> Array:
        """(cells, dim), metres."""
        return (self.low + self.high) / 2

    @cached_property
    def distance(self) -> Range:
        """From some point of one to some point of another: (cells, cells), metres."""
        return distance_range(self, self)

    @cached_property
    def touching(self) -> Flags:
        """Which of them have a point in common, (cells, cells)."""
        return self.distance.low <= 0.0

    @cached_property
    def before(self) -> NDArray[np.int32]:
        """On the shortest chain from a cell to each other, by their middles, the one before that: (cells, cells).

        Negative where there is no chain, or where it begins.
        """
        ways = np.linalg.norm(self.middle[:, None] - self.middle[None], axis=-1) + SLACK
        return np.asarray(dijkstra(csr_array(np.where(self.touching, ways, 0.0)), return_predecessors=True)[1])


def distance_range(one: Cells, other: Cells) -> Range:
    """From some point of a cell to some point of another: (cells of one, cells of the other), metres."""
    return length_range(
        [
            Range(
                one.low[:, None, axis] - other.high[None, :, axis], one.high[:, None, axis] - other.low[None, :, axis]
            )
            for axis in range(one.low.shape[1])
        ]
    )


def cells_of(mission: Mission, agent: Agent, borders: Sequence[Border], count: int) -> Cells:
    """So many boxes or fewer over all places where the centre of such an agent may be."""
    standing = [each for each in mission.obstacles if each.constant]
    heap: list[tuple[float, int, Array, Array, tuple[Border, ...]]] = []
    left_out: list[tuple[Array, Array]] = []
    number = 0

    def put(low: Array, high: Array, around: Sequence[Border]) -> None:
        nonlocal number
        if not all(bool(standing_room(each, agent, mission, 0, low, high)) for each in standing):
            left_out.append((low, high))
            return
        crossing = tuple(border for border in around if border.crosses(low, high))
        size = float((high - low).max()) * (CROSSED if crossing else 1.0)
        number += 1
        heapq.heappush(heap, (-size, number, low, high, crossing))

    put(np.array(mission.world.low) - SLACK, np.array(mission.world.high) + SLACK, borders)
    while heap and len(heap) < count:
        _, _, low, high, crossing = heapq.heappop(heap)
        axis, at = _cut(crossing, low, high)
        for begin, end in ((low[axis], at), (at, high[axis])):
            part_low, part_high = low.copy(), high.copy()
            part_low[axis], part_high[axis] = begin, end
            put(part_low, part_high, crossing)
    done = [(low, high) for _, _, low, high, _ in sorted(heap, key=lambda each: each[1])]
    return Cells(*_corners(done, mission.dimension), _corners(left_out, mission.dimension))


def _corners(boxes: list[tuple[Array, Array]], dimension: int) -> tuple[Array, Array]:
    """The corners of boxes, (boxes, dim) each."""
    corners = np.array(boxes, dtype=np.float64).reshape(len(boxes), 2, dimension)
    return corners[:, 0], corners[:, 1]


def _cut(borders: Sequence[Border], low: Array, high: Array) -> tuple[int, float]:
    """Along which axis and where a box is cut: along the border nearest to its middle, or through its middle."""
    longest = int((high - low).argmax())
    best = (np.inf, longest, float((low + high)[longest] / 2))
    for axis in range(len(low)):
        side = float(high[axis] - low[axis])
        for at in (at for border in borders for at in border.edges(axis)):
            inside = min(at - low[axis], high[axis] - at) / side
            if inside > EDGE:
                # the longer the side, and the nearer to its middle, the sooner
                cost = (0.5 - inside) - side / float((high - low).max())
                best = min(best, (cost, axis, float(at)))
    return best[1], best[2]


def with_points(cells: Cells, points: Array) -> Cells:
    """The cells, and single points, (points, dim), after them."""
    return Cells(np.concatenate([cells.low, points]), np.concatenate([cells.high, points]), cells.left_out, len(points))
