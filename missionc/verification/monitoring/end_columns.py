"""The first and the last step as two columns, and membership of these steps in windows."""

from __future__ import annotations

FIRST, LAST = 0, 1
"""The two known steps, as columns."""

MOST_NODES = 5_000
"""Maximum number of kernel nodes; larger formulas give no result."""


def columns(last: int, low: int, high: int | None, column: int) -> tuple[list[int], bool]:
    """Known steps in a window at one of them, and whether it has no others.

    Args:
        last: last step of the mission.
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
