"""Columns of bounds along the steps: those that are still read, up to the present one, and then the cells to come."""

from __future__ import annotations

import numpy as np

from missionc.base.trace import Array, Indices
from missionc.verification.monitoring.live.atom_bounds import Cells
from missionc.verification.monitoring.live.needed_steps import StepRange


class Columns:
    """The bounds of one formula: (4, rows, columns), in a buffer that is moved up when it is full.

    Amortised, a step costs as much as the columns that are written in it, however long the mission.
    """

    def __init__(self, asked: StepRange, rows: int) -> None:
        self.asked, self.rows = asked, rows
        self.origin, self.now = asked.first, -1
        self.values = np.empty((4, rows, 0))

    def open(self, now: int, cells: int) -> None:
        """Make room for the present step, and for cells after it; what is no longer read may go."""
        self.now = now
        size = self.future + cells
        if size <= self.values.shape[2]:
            return
        base = max(self.origin, min(now - self.asked.kept - 1, self.asked.last))
        kept = self.values[:, :, base - self.origin :]
        self.origin = base
        grown = np.empty((4, self.rows, 2 * (self.future + cells) + 8))
        grown[:, :, : kept.shape[2]] = kept[:, :, : grown.shape[2]]
        self.values = grown

    @property
    def known(self) -> int:
        """The last step up to now that it is asked at."""
        return min(self.now, self.asked.last)

    @property
    def begin(self) -> int:
        """The first step whose value is not final before the present one."""
        return max(self.asked.first, self.now - self.asked.ahead)

    @property
    def future(self) -> int:
        """Where the cells to come begin."""
        return max(self.known + 1, self.asked.first) - self.origin

    def part(self, begin: int, count: int, cells: int) -> Array:
        """The columns of ``count`` steps from ``begin`` on, and of the first cells after them, not to be kept."""
        start = begin - self.origin if count > 0 else self.future
        return self.values[:, :, start : start + max(count, 0) + cells]

    def steps(self, begin: int, end: int) -> Array:
        """The columns of the steps ``begin`` … ``end`` - 1."""
        return self.values[:, :, begin - self.origin : max(end, begin) - self.origin]

    def to_come(self, cells: int) -> Array:
        """The columns of the cells to come."""
        return self.values[:, :, self.future : self.future + cells]

    def at(self, steps: Indices, cells: Cells) -> Array:
        """The columns of these steps, a cell's where one is to come: (4, rows, steps)."""
        index = steps - self.origin
        if len(cells):
            index = np.where(steps > self.now, self.future + cells.of(steps), index)
        return self.values[:, :, np.clip(index, 0, self.values.shape[2] - 1)]
