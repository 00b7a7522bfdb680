"""Robustness intervals in four rows: over all continuations, and over the continuations with one step of coasting.

Arrays of bounds are (4, rows, columns): minimum and maximum robustness of a formula over all motions within top speeds,
and both again if every agent keeps its present velocity for one more step. A row is an agent, or the single row is the
team; a column is a step, or a cell of future steps (``horizon_cells``).
"""

from __future__ import annotations

from missionc.base.trace import Array
from missionc.ir.language.margins.resources import BORDER

LEAST, MOST = 0, 1
LEASTS, MOSTS = [0, 2], [1, 3]
SWAPPED = [1, 0, 3, 2]
"""Order of the bounds' rows after negation: minimum and maximum values change places."""


def denied(bounds: Array) -> Array:
    """Robustness bounds of a formula's negation, metres: (4, …) -> (4, …), or (2, …) without coasting."""
    return -bounds[SWAPPED[: len(bounds)]]


def of_measure(value: float) -> float:
    """Robustness after removing the offset that ``decided_at_border`` adds to a margin of 0."""
    return 0.0 if abs(value) <= BORDER else value
