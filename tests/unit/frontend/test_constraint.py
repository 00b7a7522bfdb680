"""The words of constraints: margins on one line, one line for each violation."""

from __future__ import annotations

from dataclasses import replace

from missionc.base.constraint import MOST_SHOWN, Constraint, NotJudged, all_satisfied, constraint_lines

KEPT = Constraint("world", True, 1.25, "m", 1e-9, 2.0, 2, ("bot[0]",), ((5.0, 1.0),))
WITHIN = replace(KEPT, name="finish", margin=-0.03, tolerance=0.05)
NEAR = Constraint(
    "separation", False, -1.1, "m", 1e-9, 2.0, 2, ("bot[0]", "bot[1]"), ((5.0, 1.0), (5.25, 1.0)), since=2.0
)
TOUCHES = Constraint("clearance", False, -0.0002, "m", 1e-9, 3.0, 3, ("bot[1]",), ((3.0, 1.0),), "wall", since=1.0)
OPEN = replace(KEPT, name="height", satisfied=None, margin=-2.0)


def test_what_is_satisfied_takes_one_line() -> None:
    assert constraint_lines((KEPT, WITHIN), ()) == ["constraint margins: world 1.250 m, finish within 0.05 m"]
    # Rounding below zero is no negative margin.
    assert constraint_lines((replace(KEPT, margin=-1e-10),), ()) == ["constraint margins: world 0.000 m"]
    assert constraint_lines((), ()) == []


def test_each_violation_takes_a_line_with_who_where_when_and_by_how_much() -> None:
    assert constraint_lines((NEAR, TOUCHES), ()) == [
        "violated: separation of `bot[0]` and `bot[1]` by 1.100 m at 2 s, at (5, 1) and (5.25, 1)",
        "violated: clearance of `bot[1]` to `wall` by 0.0002 m at 3 s, at (3, 1), since 1 s",
    ]


def test_what_is_not_decided_or_not_judged_is_listed() -> None:
    bare = NotJudged(("heading",), ("bot[1]",), "no recorded `yaw`")
    unseen = NotJudged(("jerk", "tilt"), (), "positions do not show it")
    assert constraint_lines((OPEN,), (bare, unseen)) == [
        "not decided: height of `bot[0]` at 2 s",
        "not judged: heading of `bot[1]`: no recorded `yaw`",
        "not judged: jerk, tilt: positions do not show it",
    ]


def test_of_many_violations_text_lists_the_first() -> None:
    lines = constraint_lines((NEAR,) * (MOST_SHOWN + 1), ())
    assert len(lines) == MOST_SHOWN + 1
    assert lines[-1] == "1 more violated constraint; JSON has all"


def test_one_violation_outweighs_what_is_not_decided() -> None:
    assert all_satisfied((KEPT, WITHIN)) is True
    assert all_satisfied((KEPT, OPEN)) is None
    assert all_satisfied((OPEN, NEAR)) is False
