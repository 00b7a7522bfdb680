"""Paths in the plane with guaranteed clearance from obstacles, found on a grid in plain numbers.

A path that is found is valid. If no path is found, ``geodesic_bounds``, which needs arrays, decides.
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
"""Approximate number of cells of the grid."""

MOST = 2500
"""Maximum number of cells that a search expands."""

STRAIGHT = 4
"""Number of straight paths that are tried, the shortest first."""

HOPS = 200
"""Maximum number of points tested on a straight path."""

GREED = 2.0
"""Weight of the remaining distance in A*, so that the search finds some path quickly instead of the shortest."""

FAR = 2.0
"""Largest clearance that is computed, in cell sizes."""

PLANE = ((-math.inf, math.inf),)
"""Height range of the only layer of a plane world."""

MOVES = tuple(move for move in product((-1, 0, 1), repeat=2) if any(move))

Cell = tuple[int, int]


@dataclass(slots=True, eq=False)
class ClearWays:
    """Search for paths with a clearance of more than ``room`` metres from static shapes in a two-dimensional world.

    ``pitch`` is the cell size of the grid, metres.
    """

    world: World
    shapes: tuple[Shape, ...]
    room: float
    pitch: float = 0.0
    near: dict[Cell, list[Shape]] = field(default_factory=dict)
    """Shapes that may be near to some point of a cell, by cell; cells without such shapes have no entry."""
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
        """Return true if a path from a start to a goal, no longer than ``longest`` metres, was found.

        Without ``winding``, only straight paths are tested.
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
        """Lower bound of the clearance beyond ``room`` at a point, metres, capped at ``FAR`` cells."""
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
        """Return true if weighted A* over cell centres finds a path from the start to a goal, no longer than
        ``longest`` metres.

        Args:
            goals: goal positions, each with its clearance beyond ``room``, metres.
        """
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
        """Nearest point to ``place`` inside the grid, which ends one world size around the world; metres."""
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
        """Yield the cell of a point and its neighbours, as far as they are in the grid."""
        at = self._cell(place)
        cells = ((at[0] + across, at[1] + up) for across, up in ((0, 0), *MOVES))
        return (cell for cell in cells if self._within(cell))

    def _spare(self, cell: Cell) -> float:
        if cell not in self.known:
            self.known[cell] = self.spare(self._middle(cell)) if self._within(cell) else -math.inf
        return self.known[cell]


def _open(here: float, there: float, length: float) -> bool:
    """Return true if a straight path of ``length`` metres is clear because of the clearances beyond ``room`` at its
    ends."""
    return here > SURE and there > SURE and here + there - length > SURE
