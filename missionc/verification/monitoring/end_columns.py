"""The first and the last step as two columns, and which of them a window of steps holds."""

from __future__ import annotations

FIRST, LAST = 0, 1
"""The two steps that are known, as columns."""

MOST_NODES = 5_000
"""Formulas in kernel form that are looked at; of more, nothing is said."""


def columns(last: int, low: int, high: int | None, column: int) -> tuple[list[int], bool]:
    """The known steps in a window that stands at one of them, and whether it holds no others.

    Args:
        last: the mission's last step.
    """
    if low < 0 and high is not None:
        at = last if column == LAST else 0
        begin, end = max(at + low, 0), at + high
        known = [each for each, step in ((FIRST, 0), (LAST, last)) if begin <= step <= end]
        known = [column] * (high == 0) if last == 0 else known
        return known, max(end - begin + 1, 0) == len(known)
    if column == LAST:
        return ([LAST], True) if low == 0 and high in (0, None) else ([], False)
    end = last if high is None else high
    known = [FIRST] * (low == 0) + [LAST] * (last > 0 and low <= last <= end)
    return known, end - low + 1 == len(known)
