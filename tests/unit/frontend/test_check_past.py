"""Which windows that reach back are said to lie before the mission's start, and what is done with those that do not."""

from __future__ import annotations

import pytest

from missionc.base.diagnostics.code import BEFORE_START, BEYOND_HORIZON, CONTRADICTION, NO_BACKEND, TOO_FAR, WRONG_UNIT
from tests.support.check_findings import findings, found, text


def said(formula: str) -> list[str]:
    return [finding.message for finding in found(text(f"require a: some drone: {formula}"), BEFORE_START)]


@pytest.mark.parametrize(
    ("formula", "message"),
    [
        ("once[1 s, 5 s] base", "this `once` is always false: its window is before the start of the mission"),
        (
            "historically[1 s, 5 s] fire",
            "this `historically` is always true: its window is before the start of the mission",
        ),
        ("base since[2 s, 5 s] fire", "this `since` is always false: its window is before the start of the mission"),
        ("next once[2 s, 5 s] base", "this `once` is always false: its window is before the start of the mission"),
        ("once[0, 5 s] base", "this `once` covers only 0 s: the rest of its window is before the start of the mission"),
        (
            "eventually[0, 3 s] (goal and once[3 s, 5 s] base)",
            "this `once` covers only 0 s: the rest of its window is before the start of the mission",
        ),
        (
            "always[0, 9 s] (goal implies once[4 s, 5 s] once[5 s, 6 s] base)",
            "this `once` covers only 0 s: the rest of its window is before the start of the mission",
        ),
    ],
)
def test_a_window_before_the_start_is_said_to_be(formula: str, message: str) -> None:
    assert said(formula) == [message]


@pytest.mark.parametrize(
    "formula",
    [
        "once[0, 0] base",
        "always[0, 9 s] (goal implies once[0, 20 s] base)",
        "eventually[0, 3 s] (goal and once[2 s, 5 s] base)",
        "eventually[0, 3 s] not (fire since[0, 2 s] base)",
        "base until[0, 4 s] once[3 s, 3 s] base",
        "somewhere[hops 0..1 on radio] next once[0, 3 s] base",
    ],
)
def test_nothing_is_said_where_some_step_is_looked_at(formula: str) -> None:
    assert said(formula) == []


def test_a_window_that_reaches_back_has_an_end() -> None:
    (finding,) = found(text("require a: some drone: eventually[0, 9 s] once[0, end] base"), WRONG_UNIT)
    assert finding.message == "`once` takes a time window that ends, and reaches back"


@pytest.mark.parametrize(
    ("formula", "needs"),
    [
        ("eventually[0, 20 s] once[2 s, 4 s] eventually[0, 2 s] base", 20),
        ("eventually[0, 20 s] once[2 s, 4 s] eventually[0, 5 s] base", 23),
        ("eventually[0, 20 s] ((eventually[0, 1 s] base) since[2 s, 4 s] goal)", 21),
    ],
)
def test_what_looks_back_makes_up_for_what_looks_ahead_below_it(formula: str, needs: int) -> None:
    past = found(text(f"require a: some drone: {formula}"), BEYOND_HORIZON)
    assert [f"the formula needs {needs} s" in finding.notes[0] for finding in past] == ([True] if needs > 20 else [])


def test_what_must_have_been_before_is_too_far_or_a_contradiction() -> None:
    assert found(text("require a: every drone: eventually[3 s, 3 s] once[1 s, 2 s] goal"), TOO_FAR)
    assert not found(text("require a: every drone: eventually[9 s, 9 s] once[1 s, 2 s] goal"), TOO_FAR)
    never = "require a: every drone: always[0, 9 s] not goal\n"
    both = f"{never}require b: every drone: eventually[8 s, 9 s] once[0, 2 s] goal"
    assert found(text(both), CONTRADICTION)
    apart = both.replace("once[0, 2 s]", "historically[9 s, 9 s]")
    assert not [finding for finding in findings(text(apart)) if finding.code is CONTRADICTION]


def test_no_backend_looks_back_below_a_route_in_metres() -> None:
    past = "require a: some drone: eventually[0, 9 s] (drone reach[distance <= 3 m on radio] once[0, 3 s] goal)"
    (finding,) = found(text(past), NO_BACKEND)
    assert "a past operator inside a route in metres" in str(finding)
    assert not found(text(past.replace("distance <= 3 m", "hops 0..2")), NO_BACKEND)
