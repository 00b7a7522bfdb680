"""The first and the last step in a window, against the steps of the window counted one by one."""

from __future__ import annotations

from missionc.verification.monitoring.end_columns import FIRST, LAST, columns


def counted(last: int, low: int, high: int | None, column: int) -> tuple[list[int], bool]:
    """The known steps of a window, and whether there are no others."""
    at = last if column == LAST else 0
    steps = range(max(at + low, 0) if low < 0 else at + low, (last if high is None else at + high) + 1)
    here = [column] if last == 0 else [FIRST, LAST]
    known = [each for each in here if (last if each == LAST else 0) in steps]
    return known, len(steps) == len(known)


def test_a_window_ahead_of_the_first_step_holds_the_two_where_they_are_in_it() -> None:
    for last in range(5):
        for low in range(6):
            for high in (*range(low, 7), None):
                if high is not None or low <= last:
                    assert columns(last, low, high, FIRST) == counted(last, low, high, FIRST), (last, low, high)


def test_a_window_ahead_of_the_last_step_holds_it_alone_or_what_is_not_known() -> None:
    for last in range(5):
        for low in range(4):
            for high in (*range(low, 5), None):
                now = low == 0 and high in (0, None)
                assert columns(last, low, high, LAST) == (([LAST], True) if now else ([], False))


def test_a_window_that_looks_back_holds_no_step_before_the_first() -> None:
    for last in range(5):
        for low in range(-6, 0):
            for high in range(low, 1):
                for column in (FIRST, LAST):
                    assert columns(last, low, high, column) == counted(last, low, high, column), (last, low, high)
