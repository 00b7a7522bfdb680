"""Lazy encoding of *and*, *or* and choices: a formula is encoded only for cells that the previous formulas leave
undecided.

An ``Ask`` is a function from positions of cells to literals for these cells.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

import numpy as np

from missionc.backends.smt.encode.clauses import FALSE, TRUE, Clauses, Literals
from missionc.base.trace import Indices

Ask = Callable[[Indices], Literals]


def join(clauses: Clauses, every: bool, count: int, asks: Iterable[Ask]) -> Literals:
    """For each of ``count`` cells, a literal that implies all conditions, or without ``every``, some condition:
    (count,)."""
    decided, neutral = (FALSE, TRUE) if every else (TRUE, FALSE)
    columns = [np.full(count, neutral, dtype=np.int32)]
    open_ = np.arange(count)
    for ask in asks:
        column = np.full(count, neutral, dtype=np.int32)
        column[open_] = ask(open_)
        columns.append(column)
        open_ = open_[column[open_] != decided]
        if not open_.size:
            break
    matrix = np.stack(columns, axis=1)
    return clauses.all_of(matrix) if every else clauses.any_of(matrix)


def at_least(clauses: Clauses, count: int, asks: Sequence[Ask]) -> Ask:
    """Function to literals that imply at least ``count`` of the conditions, all of which are encoded."""

    def ask(rows: Indices) -> Literals:
        columns = [each(rows) for each in asks]
        matrix = np.stack(columns, axis=1) if columns else np.zeros((len(rows), 0), dtype=np.int32)
        return clauses.at_least(count, matrix)

    return ask


def choose(clauses: Clauses, some: bool, count: int, here: Ask, start: Ask, onward: Ask) -> Literals:
    """Literals of a route, (count,): with ``some``, ``here`` or both ``start`` and ``onward``; otherwise ``here``, and
    ``start`` or ``onward``."""
    decided = TRUE if some else FALSE
    first = here(np.arange(count))
    second = np.full(count, -decided, dtype=np.int32)
    third = second.copy()
    rows = np.flatnonzero(first != decided)
    second[rows] = start(rows)
    rows = rows[(second[rows] != -decided) & (second[rows] != first[rows])]
    third[rows] = onward(rows)
    if some:
        return clauses.either(first, second, third)
    return clauses.all_of(first, clauses.any_of(second, third))
