"""May labels: the cells, and the pairs of cells, in which a predicate may hold, and those in which it may fail."""

from __future__ import annotations

from collections.abc import Hashable

import numpy as np

from missionc.backends.cover.cell_view import margin_range
from missionc.backends.cover.cells import Cells
from missionc.backends.cover.may_see import SightLink, hidden
from missionc.backends.smt.roadmap.labels import Labels, Unexpressible
from missionc.backends.smt.roadmap.roadmap import Roadmap
from missionc.base.trace import Flags
from missionc.ir import Mission, Predicate, Sight
from missionc.world.distance_ranges import Range

BORDER = 1e-5
"""Metres by which a predicate that fails may pass for true, and one that holds for false."""


class MayLabels(Labels):
    """Labels of cells; both a predicate and its negation may hold in one.

    Args:
        cells: those that the states of each roadmap stand for.
    """

    def __init__(self, mission: Mission, roadmaps: tuple[Roadmap, ...], cells: tuple[Cells, ...]) -> None:
        super().__init__(mission, roadmaps)
        self.cells = cells
        self._ranges: dict[Hashable, Range] = {}
        self._blind: dict[Hashable, Flags] = {}

    def of_places(self, predicate: Predicate) -> bool:
        """Never: of one cell it may hold and fail, and of an agent in it only one of them."""
        return False

    def moves(self, predicate: Predicate, number: int, holds: bool, *, at_end: bool) -> Flags:
        """During which moves it may hold, or fail, in the cell they start from or, ``at_end``, end in: (moves,)."""
        key = predicate, number, at_end
        if key not in self._ranges:
            cells, (source, target) = self.cells[number], self.roadmaps[number].moves.T
            where = target if at_end else source
            agent = self.roadmaps[number].agents[0]
            way = cells.distance
            speed = Range(way.low[source, target], way.high[source, target]) / self.mission.step
            box = cells.low[where], cells.high[where]
            self._ranges[key] = margin_range(predicate, self.mission, {agent: box}, speed)
        return _may(self._ranges[key], holds, (len(self.roadmaps[number].moves),))

    def states_where(self, predicate: Predicate, number: int, truth: bool) -> Flags:
        """In which cells it may hold, or fail: (cells,)."""
        cells = self.cells[number]
        key = predicate, number
        if key not in self._ranges:
            agent = self.roadmaps[number].agents[0]
            self._ranges[key] = margin_range(predicate, self.mission, {agent: (cells.low, cells.high)})
        return _may(self._ranges[key], truth, (len(cells),))

    def pairs_where(self, predicate: Predicate, agents: tuple[int, int], first: int, second: int, truth: bool) -> Flags:
        """With the two agents in which cells it may hold of the first, or fail: (cells, cells)."""
        key = predicate, agents, first, second
        one, other = self.cells[first], self.cells[second]
        if key not in self._ranges:
            here = one.low[:, None, :], one.high[:, None, :]
            there = other.low[None, :, :], other.high[None, :, :]
            try:
                self._ranges[key] = margin_range(predicate, self.mission, {agents[0]: here, agents[1]: there})
            except ValueError as error:
                raise Unexpressible(f"a comparison: {error}") from error
        may = _may(self._ranges[key], truth, (len(one), len(other)))
        if truth and isinstance(predicate, SightLink):
            return may & ~self._hidden(predicate.sight, first, second)
        return may

    def _hidden(self, graph: Sight, first: int, second: int) -> Flags:
        key = graph, first, second
        if key not in self._blind:
            self._blind[key] = hidden(graph, self.cells[first], self.cells[second])
        return self._blind[key]


def _may(margin: Range, truth: bool, shape: tuple[int, ...]) -> Flags:
    may = margin.high >= -BORDER if truth else margin.low <= BORDER
    return np.broadcast_to(may, shape)
