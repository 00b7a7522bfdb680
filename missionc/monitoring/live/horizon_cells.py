"""Cells of the steps to come: few where the mission is long, and exact at the next step and at deadlines.

Nothing is known of a step to come but how far agents can get until then. So bounds only widen from step to step, and
those of the last step of a cell hold for all of it.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Indices = NDArray[np.int64]

MOST_DEADLINES = 8
"""So many of the nearest deadlines to come end a cell of their own."""


@dataclass(frozen=True, slots=True, eq=False)
class Cells:
    """The steps after ``now``, in cells.

    Args:
        ends: the last step of each cell, (cells,), ascending; the first cell is one step, and the last ends with the
            mission. None where the mission is over.
    """

    now: int
    ends: Indices

    def __len__(self) -> int:
        return len(self.ends)

    @property
    def begins(self) -> Indices:
        """The first step of each cell: (cells,)."""
        return np.concatenate(([self.now], self.ends[:-1])) + 1 if len(self.ends) else self.ends

    def of(self, steps: Indices) -> Indices:
        """The cell of each step; of one that is not to come, or beyond the mission, the nearest."""
        return np.minimum(np.searchsorted(self.ends, steps), len(self.ends) - 1)


def cells_after(now: int, last: int, deadlines: Iterable[int], spans: Iterable[int]) -> Cells:
    """The cells of the steps after ``now``: they double, and end at the nearest deadlines.

    Args:
        last: the mission's last step.
        deadlines: steps at which a window ends.
        spans: how many steps ahead windows end that are asked at every step.
    """
    doubling, size = [], 1
    while now + size < last:
        doubling.append(now + size)
        size *= 2
    nearest = sorted({step for step in deadlines if now < step < last})[:MOST_DEADLINES]
    recurring = sorted({now + span for span in spans if 0 < span < last - now})[:MOST_DEADLINES]
    ends = sorted({*doubling, *nearest, *recurring, *([last] if last > now else [])})
    return Cells(now, np.array(ends, dtype=np.int64))
