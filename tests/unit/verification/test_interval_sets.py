"""Operators on sets of intervals: small sets, and what comes of them worked out by hand."""

from __future__ import annotations

import pytest

from missionc.verification.between.interval_sets import (
    Signal,
    Spans,
    asked_until,
    at_least,
    common,
    looking_back_over,
    merged,
    of_parts,
    sometime,
    throughout,
    until_over_time,
)

NOTHING: Spans = ()


def test_a_union_is_in_order_and_what_touches_is_one() -> None:
    assert merged([(5, 7), (1, 3), (3, 4), (9, 8)]) == ((1, 4), (5, 7))
    assert merged([(0, 9), (2, 3)]) == ((0, 9),)
    assert merged([(2, 2), (4, 3)]) == ((2, 2),)


def test_moments_that_so_many_sets_share() -> None:
    sets = (((0, 5),), ((2, 7),), ((4, 9),))
    assert [at_least(count, sets, 9) for count in range(5)] == [((0, 9),), ((0, 9),), ((2, 7),), ((4, 5),), NOTHING]
    assert at_least(-1, (), 6) == ((0, 6),)
    assert at_least(1, (((3, 4),), ((0, 1),)), 9) == ((0, 1), (3, 4))


def test_sets_that_touch_share_that_moment() -> None:
    assert common(((0, 4),), ((4, 6),)) == ((4, 4),)
    assert common(((0, 4), (6, 9)), ((5, 7),)) == ((6, 7),)
    assert common(((0, 4), (6, 9)), ((7, 2),)) == ()


def test_some_of_the_parts_hold_where_enough_do_and_fail_where_too_many_fail() -> None:
    parts = Signal(((0, 4),), ((6, 9),)), Signal(((2, 5),), ((7, 9),)), Signal((), ((0, 9),))
    assert of_parts(1, parts, 9) == Signal(((0, 5),), ((7, 9),))
    assert of_parts(2, parts, 9) == Signal(((2, 4),), ((6, 9),))
    assert of_parts(3, parts, 9) == Signal((), ((0, 9),))


def test_a_window_widens_where_something_holds_and_narrows_where_it_fails() -> None:
    body = Signal(((5, 7),), ((10, 18),))
    assert sometime(body, 2, 3, 20) == Signal(((2, 5),), ((8, 15),))
    assert throughout(body.denied, 2, 3, 20) == Signal(((8, 15),), ((2, 5),))


def test_what_is_over_before_the_window_opens_is_not_in_it() -> None:
    assert sometime(Signal(((1, 1), (4, 4)), ((0, 3),)), 2, 3, 20) == Signal(((1, 2),), ((0, 0),))
    assert sometime(Signal(((2, 2),), ((0, 2),)), 2, 3, 20) == Signal(((0, 0),), ())


def test_a_window_without_an_end_is_open_until_the_end() -> None:
    assert sometime(Signal(((5, 7),), ((8, 20),)), 2, None, 20) == Signal(((0, 5),), ((6, 18),))
    assert sometime(Signal(((19, 25),), ((1, 19),)), 2, None, 20) == Signal(((0, 18),), ())
    assert sometime(Signal((), ((1, 20),)), 2, None, 20) == Signal((), ((0, 18),))


@pytest.mark.parametrize(
    ("hold", "goal", "low", "found"),
    [
        # What has to hold up to a moment need not hold at it.
        (((0, 6),), ((6, 9),), 1, ((4, 5),)),
        (((0, 6),), ((4, 5), (8, 9)), 1, ((2, 4),)),
        # At once it asks nothing of what has to hold before.
        (((0, 6),), ((4, 5), (8, 9)), 0, ((2, 5), (8, 9))),
        # One stretch has to lead all the way.
        (((0, 3), (5, 9)), ((6, 7),), 1, ((5, 6),)),
    ],
)
def test_until_holds_from_where_one_stretch_leads_to_its_end(hold: Spans, goal: Spans, low: int, found: Spans) -> None:
    assert until_over_time(Signal(hold, ()), Signal(goal, ()), low, 2, 20) == Signal(found, ())


@pytest.mark.parametrize(
    ("fails", "absent", "low", "high", "found"),
    [
        # Absent from all of the window.
        (NOTHING, ((4, 9),), 1, 3, ((3, 6),)),
        # What fails before the window opens lets no end of it count.
        (((10, 11),), NOTHING, 3, 6, ((8, 11),)),
        (((1, 2),), NOTHING, 3, 6, ((0, 2),)),
        # Without a wait, its end may be now.
        (((10, 11),), NOTHING, 0, 6, NOTHING),
        (((10, 14),), ((12, 13),), 0, 6, ((12, 13),)),
        # Absent up to where what has to hold fails.
        (((4, 4), (10, 11)), ((2, 5),), 2, 6, ((0, 4), (9, 11))),
        (((10, 11),), ((8, 10),), 0, 6, ((8, 10),)),
        (((10, 11),), ((8, 9),), 0, 6, NOTHING),
        (((10, 11),), ((10, 12),), 0, 6, ((10, 11),)),
        (((3, 5), (9, 9)), ((4, 10),), 2, 8, ((2, 9),)),
        (((5, 5),), ((1, 6),), 3, None, ((0, 5),)),
    ],
)
def test_until_fails_from_where_its_end_is_absent_as_long_as_it_counts(
    fails: Spans, absent: Spans, low: int, high: int | None, found: Spans
) -> None:
    assert until_over_time(Signal((), fails), Signal((), absent), low, high, 20) == Signal((), found)


def test_what_was_some_time_ago() -> None:
    """From one to two ticks back."""
    assert looking_back_over(sometime, Signal(((3, 4),), ((0, 1), (6, 10))), low=1, high=2, end=10) == Signal(
        ((4, 6),), ((0, 2), (8, 10))
    )


def test_before_the_beginning_there_is_nothing() -> None:
    """What may be so at 0 leaves the moments after 0 open: closed sets know no better."""
    open_at_0 = Signal(((8, 10),), ((1, 2),))
    assert looking_back_over(sometime, open_at_0, low=1, high=2, end=10) == Signal(((9, 10),), ((0, 0), (3, 3)))
    assert looking_back_over(sometime, Signal(((0, 0),), ()), low=1, high=2, end=10) == Signal(((1, 2),), ((0, 0),))


def test_what_has_held_since() -> None:
    hold, goal = Signal(((3, 9),), ((10, 10),)), Signal(((2, 3),), ((0, 1), (5, 10)))
    # Since 3 or before until 7, four ticks later; from 10 on nothing holds any more, nor up to 1.
    assert looking_back_over(until_over_time, hold, goal, low=0, high=4, end=10) == Signal(((2, 7),), ((0, 1), (9, 10)))


def test_what_is_asked_up_to_a_moment_stands_in_nobodys_way_after_it() -> None:
    assert asked_until(4, Signal(((0, 2),), ((3, 9),)), 10) == Signal(((0, 2), (5, 10)), ((3, 4),))
    assert asked_until(4, Signal(((0, 2), (3, 9)), ()), 10) == Signal(((0, 2), (3, 10)), ())
    assert asked_until(4, Signal((), ()), 10) == Signal(((5, 10),), ())


def test_what_is_asked_at_the_beginning_alone_or_never() -> None:
    assert asked_until(0, Signal((), ((0, 9),)), 10) == Signal(((1, 10),), ((0, 0),))
    assert asked_until(-1, Signal((), ((0, 9),)), 10) == Signal(((0, 10),), ())
