"""Robustness intervals in four rows: over all continuations, and over those in which agents coast for a step first.

Arrays of bounds are (4, rows, columns): the least and the most that a formula can come to, whatever the agents do
within their top speeds, and both again where every agent keeps its present velocity for one more step. A row is an
agent, or the one row is the team's; a column is a step, or a cell of steps to come (``horizon_cells``).
"""

from __future__ import annotations

from missionc.base.trace import Array
from missionc.ir.language.margins.resources import BORDER

LEAST, MOST = 0, 1
LEASTS, MOSTS = [0, 2], [1, 3]
SWAPPED = [1, 0, 3, 2]
"""Where the bounds of a negation stand."""


def denied(bounds: Array) -> Array:
    """The bounds of the negation: (4, …) -> (4, …), or (2, …) where nothing coasts."""
    return -bounds[SWAPPED[: len(bounds)]]


def of_measure(value: float) -> float:
    """The robustness without what ``decided_at_border`` added."""
    return 0.0 if abs(value) <= BORDER else value
