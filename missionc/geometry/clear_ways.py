"""Clear ways: paths in the plane that surely keep clear of what stands, found on a grid in plain numbers.

A way that is found is one; that none is found says nothing, and is for ``geodesic_bounds``, which needs arrays.
"""

from __future__ import annotations

import heapq
import math
from collections.abc import Iterator, Sequence
from dataclasses import field
from itertools import product

from missionc.base.late_dataclass import dataclass
from missionc.geometry import plain_floats
from missionc.geometry.configuration_space import SURE
from missionc.geometry.height_layers import extent
from missionc.geometry.plain_floats import Place
from missionc.ir import Shape, Vector, World
from missionc.ir.distances.signed_distance import signed_distance

CELLS = 2500
"""Cells of the grid, about."""

MOST = 2500
"""Places that a search goes on from."""

STRAIGHT = 4
"""Straight ways that are tried, the shortest first."""

HOPS = 200
"""Points of a straight way that are looked at."""

GREED = 2.0
"""How many times the way left counts, so that the search is for some way and not for the shortest."""

FAR = 2.0
"""Sides of a cell: room to spare beyond that is not told apart."""

PLANE = ((-math.inf, math.inf),)
"""The heights of a plane."""

MOVES = tuple(move for move in product((-1, 0, 1), repeat=2) if any(move))

Cell = tuple[int, int]


@dataclass(slots=True, eq=False)
class ClearWays:
    """Ways of points that keep more than so much room, metres, to shapes that stand in a world of two dimensions."""

    world: World
    shapes: tuple[Shape, ...]
    room: float
    pitch: float = 0.0
    near: dict[Cell, list[Shape]] = field(default_factory=dict)
    """By cell, the shapes that any of its places may be near to; none where there is no entry."""
    known: dict[Cell, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        width, height = (high - low for low, high in zip(self.world.low, self.world.high, strict=True))
        self.pitch = math.sqrt(width * height / CELLS)
        around = self.room + FAR * self.pitch
        for shape in self.shapes:
            low, high = extent(shape, PLANE) or (self.world.low, self.world.high)
            first = self._cell(self._not_far(tuple(value - around for value in low)))
            last = self._cell(self._not_far(tuple(value + around for value in high)))
            for cell in product(*(range(a, b + 1) for a, b in zip(first, last, strict=True))):
                self.near.setdefault((cell[0], cell[1]), []).append(shape)

    def found(self, starts: Sequence[Vector], goals: Sequence[Vector], longest: float, *, winding: bool = True) -> bool:
        """Whether a way from one of the starts to one of the goals, no longer than so much, was found.

        ``winding``: one that is not straight is looked for too.
        """
        pairs = sorted((math.dist(here, there), here, there) for here in starts for there in goals)
        near = [(here, there) for length, here, there in pairs if length <= longest]
        if any(self._straight(here, there) for here, there in near[:STRAIGHT]):
            return True
        if not winding:
            return False
        free = [(goal, spare) for goal in goals if (spare := self.spare(goal)) > SURE]
        return bool(near and free) and self._searched(near[0][0], free, longest)

    def spare(self, place: Vector) -> float:
        """How much more room there is at a place than is kept, metres: at least, and no more than is told apart."""
        there, most = Place(place), FAR * self.pitch
        for shape in self.near.get(self._cell(place), ()):
            most = min(most, signed_distance(plain_floats, shape, there) - self.room)
            if most <= 0:
                break
        return most

    def _straight(self, here: Vector, there: Vector) -> bool:
        length, gone = math.dist(here, there), 0.0
        if self.spare(there) <= SURE:
            return False
        for _ in range(HOPS):
            if gone >= length:
                return True
            share = gone / length
            spare = self.spare(tuple(a + share * (b - a) for a, b in zip(here, there, strict=True)))
            if spare <= SURE:
                return False
            gone += spare
        return False

    def _searched(self, start: Vector, goals: Sequence[tuple[Vector, float]], longest: float) -> bool:
        """Weighted A*, from the start over middles of cells to a goal; ``goals`` with the room to spare at each."""
        best: dict[Cell, float] = {}
        queue: list[tuple[float, float, Cell]] = []
        moves = [(across, up, self.pitch * math.hypot(across, up)) for across, up in MOVES]

        def offered(gone: float, cell: Cell) -> None:
            if gone < best.get(cell, math.inf):
                middle = self._middle(cell)
                left = min(math.dist(middle, goal) for goal, _ in goals)
                if gone + left <= longest:
                    best[cell] = gone
                    heapq.heappush(queue, (gone + GREED * left, gone, cell))

        begin = self.spare(start)
        for cell in self._around(start):
            length = math.dist(start, self._middle(cell))
            if _open(begin, self._spare(cell), length):
                offered(length, cell)
        for _ in range(MOST):
            if not queue:
                return False
            _, gone, cell = heapq.heappop(queue)
            if gone > best[cell]:
                continue
            here, spare = self._middle(cell), self._spare(cell)
            for goal, there in goals:
                length = math.dist(here, goal)
                if gone + length <= longest and _open(spare, there, length):
                    return True
            for across, up, length in moves:
                other = cell[0] + across, cell[1] + up
                if gone + length < best.get(other, math.inf) and _open(spare, self._spare(other), length):
                    offered(gone + length, other)
        return False

    def _not_far(self, place: Vector) -> Vector:
        """The place, or one nearer to the world: beyond its own size around it nothing is looked at."""
        sides = zip(place, self.world.low, self.world.high, strict=True)
        return tuple(min(max(value, 2 * low - high), 2 * high - low) for value, low, high in sides)

    def _cell(self, place: Vector) -> Cell:
        across, up = (math.floor((value - low) / self.pitch) for value, low in zip(place, self.world.low, strict=True))
        return across, up

    def _middle(self, cell: Cell) -> Vector:
        return tuple(low + (number + 0.5) * self.pitch for low, number in zip(self.world.low, cell, strict=True))

    def _within(self, cell: Cell) -> bool:
        low, high, middle = self.world.low, self.world.high, self._middle(cell)
        return low[0] <= middle[0] <= high[0] and low[1] <= middle[1] <= high[1]

    def _around(self, place: Vector) -> Iterator[Cell]:
        """The cell that a place is in, and those beside it."""
        at = self._cell(place)
        cells = ((at[0] + across, at[1] + up) for across, up in ((0, 0), *MOVES))
        return (cell for cell in cells if self._within(cell))

    def _spare(self, cell: Cell) -> float:
        if cell not in self.known:
            self.known[cell] = self.spare(self._middle(cell)) if self._within(cell) else -math.inf
        return self.known[cell]


def _open(here: float, there: float, length: float) -> bool:
    """Whether a straight way of that length is clear, by how much room its ends have to spare."""
    return here > SURE and there > SURE and here + there - length > SURE
