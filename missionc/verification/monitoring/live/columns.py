"""Robustness bounds of a formula by step: the past steps that are still read, and the future cells."""

from __future__ import annotations

import numpy as np

from missionc.base.trace import Array, Indices
from missionc.verification.monitoring.live.atom_bounds import Cells
from missionc.verification.monitoring.live.needed_steps import StepRange


class Columns:
    """Robustness bounds of one formula by step, (4, rows, columns), in a buffer that shifts when it is full.

    The amortised cost of a step depends on the number of written columns, not on the mission's length.
    """

    def __init__(self, asked: StepRange, rows: int) -> None:
        self.asked, self.rows = asked, rows
        self.origin, self.now = asked.first, -1
        self.values = np.empty((4, rows, 0))

    def open(self, now: int, cells: int) -> None:
        """Allocate columns for the present step and the cells after it.

        Columns that are no longer read may be dropped.
        """
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
        """Last step up to the present at which the formula is evaluated."""
        return min(self.now, self.asked.last)

    @property
    def begin(self) -> int:
        """First step at which the formula's value was not final before the present step."""
        return max(self.asked.first, self.now - self.asked.ahead)

    @property
    def future(self) -> int:
        """Column index of the first future cell."""
        return max(self.known + 1, self.asked.first) - self.origin

    def part(self, begin: int, count: int, cells: int) -> Array:
        """Temporary view of ``count`` steps from ``begin`` on and of the first future cells: (4, rows, columns),
        metres.
        """
        start = begin - self.origin if count > 0 else self.future
        return self.values[:, :, start : start + max(count, 0) + cells]

    def steps(self, begin: int, end: int) -> Array:
        """Bounds at the steps ``begin`` … ``end`` - 1: (4, rows, steps), metres."""
        return self.values[:, :, begin - self.origin : max(end, begin) - self.origin]

    def to_come(self, cells: int) -> Array:
        """Bounds in the future cells: (4, rows, cells), metres."""
        return self.values[:, :, self.future : self.future + cells]

    def at(self, steps: Indices, cells: Cells) -> Array:
        """Bounds at the given steps, for a future step those of its cell: (4, rows, steps), metres."""
        index = steps - self.origin
        if len(cells):
            index = np.where(steps > self.now, self.future + cells.of(steps), index)
        return self.values[:, :, np.clip(index, 0, self.values.shape[2] - 1)]
