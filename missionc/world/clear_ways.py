"""Clear ways: paths in the plane that surely keep clear of what stands, found on a coarse grid in plain numbers.

A way that is found is one; that none is found says nothing, and is for ``geodesic_bounds``, which needs arrays.
"""

from __future__ import annotations

import heapq
import math
from collections.abc import Iterator, Sequence
from dataclasses import field
from itertools import product

from missionc.base.late_dataclass import dataclass
from missionc.ir import Shape, Vector, World
from missionc.world import plain_floats
from missionc.world.area import SURE
from missionc.world.plain_floats import Place
from missionc.world.signed_distance import signed_distance

CELLS = 900
"""Cells of the grid, about."""

HOPS = 100
"""Points of a straight way that are looked at."""

MOST = 1500
"""Places that a search goes on from."""

MOVES = tuple(move for move in product((-1, 0, 1), repeat=2) if any(move))

Cell = tuple[int, int]


@dataclass(frozen=True, slots=True, eq=False)
class ClearWays:
    """Ways of points that keep more than so much room, metres, to shapes that stand in a world of two dimensions."""

    world: World
    shapes: tuple[Shape, ...]
    room: float
    known: dict[Cell, float] = field(default_factory=dict)

    @property
    def pitch(self) -> float:
        width, height = (high - low for low, high in zip(self.world.low, self.world.high, strict=True))
        return math.sqrt(width * height / CELLS)

    def spare(self, place: Vector) -> float:
        """How much more room there is at a place than is kept, at least, metres."""
        return min(signed_distance(plain_floats, shape, Place(place)) for shape in self.shapes) - self.room

    def found(self, starts: Sequence[Vector], goals: Sequence[Vector], longest: float) -> bool:
        """Whether a way from one of the starts to one of the goals, no longer than so much, was found."""
        starts, goals = ([each for each in ends if self.spare(each) > SURE] for ends in (starts, goals))
        pairs = sorted((math.dist(here, there), here, there) for here in starts for there in goals)
        near = [(here, there) for length, here, there in pairs if length <= longest]
        if any(self._straight(here, there) for here, there in near[:4]):
            return True
        return bool(near) and self._searched(near[0][0], goals, longest)

    def _straight(self, here: Vector, there: Vector) -> bool:
        length, gone = math.dist(here, there), 0.0
        for _ in range(HOPS):
            if gone >= length:
                return True
            share = gone / length
            spare = self.spare(tuple(a + share * (b - a) for a, b in zip(here, there, strict=True)))
            if spare <= SURE:
                return False
            gone += spare
        return False

    def _searched(self, start: Vector, goals: Sequence[Vector], longest: float) -> bool:
        """A*, from the start over middles of cells to a goal."""
        begin = self.spare(start)
        best: dict[Cell, float] = {}
        queue: list[tuple[float, float, Cell]] = []

        def offered(gone: float, cell: Cell) -> None:
            if gone < best.get(cell, math.inf):
                left = min(math.dist(self._middle(cell), goal) for goal in goals)
                if gone + left <= longest:
                    best[cell] = gone
                    heapq.heappush(queue, (gone + left, gone, cell))

        for cell in self._around(start):
            length = math.dist(start, self._middle(cell))
            if self._open(begin, self._spare(cell), length):
                offered(length, cell)
        for _ in range(MOST):
            if not queue:
                return False
            _, gone, cell = heapq.heappop(queue)
            if gone > best[cell]:
                continue
            here, spare = self._middle(cell), self._spare(cell)
            for goal in goals:
                length = math.dist(here, goal)
                if gone + length <= longest and (length < spare or self._open(spare, self.spare(goal), length)):
                    return True
            for across, up in MOVES:
                other = cell[0] + across, cell[1] + up
                length = self.pitch * math.hypot(across, up)
                if self._within(other) and self._open(spare, self._spare(other), length):
                    offered(gone + length, other)
        return False

    @staticmethod
    def _open(here: float, there: float, length: float) -> bool:
        """Whether a straight way of that length is clear, by how much room its ends have to spare."""
        return min(here, there) > SURE and here + there - length > SURE

    def _middle(self, cell: Cell) -> Vector:
        return tuple(low + (number + 0.5) * self.pitch for low, number in zip(self.world.low, cell, strict=True))

    def _within(self, cell: Cell) -> bool:
        low, high, middle = self.world.low, self.world.high, self._middle(cell)
        return all(a <= value <= b for a, value, b in zip(low, middle, high, strict=True))

    def _around(self, place: Vector) -> Iterator[Cell]:
        """The cell that a place is in, and those beside it."""
        at = [math.floor((value - low) / self.pitch) for value, low in zip(place, self.world.low, strict=True)]
        cells = ((at[0] + across, at[1] + up) for across, up in ((0, 0), *MOVES))
        return (cell for cell in cells if self._within(cell))

    def _spare(self, cell: Cell) -> float:
        if cell not in self.known:
            self.known[cell] = self.spare(self._middle(cell))
        return self.known[cell]
