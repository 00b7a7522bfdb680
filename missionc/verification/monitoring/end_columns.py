"""The first and the last step of a mission as two columns, and the windows that contain these steps."""

from __future__ import annotations

FIRST, LAST = 0, 1
"""Column indices of the first and the last step."""

MOST_NODES = 5_000
"""Maximum number of kernel nodes; formulas with more nodes get no result."""


def columns(last: int, low: int, high: int | None, column: int) -> tuple[list[int], bool]:
    """Columns of the first and last step that lie in a window, and True if the window contains no other step.

    Args:
        last: last step of the mission.
        low, high: the window, in steps ahead of the evaluated step; None means up to the last step.
        column: column of the evaluated step, ``FIRST`` or ``LAST``.
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
