"""Claims of a flight: margins along curves, that can be bounded on any part of them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from missionc.base.trace import Array
from missionc.curves.bernstein_intervals import Enclosed
from missionc.curves.piecewise_polynomials import Indices

Bounds: TypeAlias = tuple[Array, Array, Array]
"""For each part: a lower bound of the margin on all of it, the margin somewhere in it, and at which share of it."""

Curve: TypeAlias = Callable[[Indices], Enclosed]
"""From items to their curves over their whole piece: (items, dim)."""

Far: TypeAlias = Callable[[Indices], Array]
"""From subjects to a lower bound of their margin over the whole flight, from the box around it: (subjects,)."""

Judge: TypeAlias = Callable[[Indices, Enclosed], Bounds]
"""From items and their curves over a part of the item's time, (parts, dim)."""


@dataclass(frozen=True, slots=True, eq=False)
class Claim:
    """That a margin is at least 0 at every moment, for every subject.

    Args:
        name, subject, unit, tolerance, detail: of the check.
        agents: (subjects, one or two): whom each subject is about, by their index.
        times: (pieces + 1,), seconds.
        curve: the curves of items; item ``subject * pieces + piece`` is a subject in a piece.
        judge: bounds of the margin.
        gap: the proved bound may stay so far below the least margin seen.
        far: a bound that is quick, where there is one.
    """

    name: str
    subject: str
    unit: str
    tolerance: float
    detail: str
    agents: Indices
    times: Array
    curve: Curve
    judge: Judge
    gap: float
    far: Far | None = None

    @property
    def pieces(self) -> int:
        return self.times.size - 1

    @property
    def items(self) -> int:
        return len(self.agents) * self.pieces

    def when(self, moment: float) -> float:
        """Seconds; ``moment`` counts pieces: 3.25 is a quarter into the fourth."""
        return float(np.interp(moment, np.arange(self.times.size), self.times))


def everyone(count: int) -> Indices:
    """(count, 1): each agent is a subject."""
    return np.arange(count, dtype=np.int64)[:, None]


def of_agents(curves: Enclosed) -> Curve:
    """The curves of (agents, pieces, dim), each agent a subject."""
    pieces = curves.radius.shape[1]
    return lambda item: curves[item // pieces, item % pieces]
