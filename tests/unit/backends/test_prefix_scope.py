"""Which operators before their operand are said to end early, and which are left alone."""

from __future__ import annotations

import pytest

from missionc.base.diagnostics.code import ENDS_EARLY
from missionc.base.diagnostics.model import Diagnostic
from tests.support.check_findings import found, text


def warned(formula: str) -> list[Diagnostic]:
    return found(text(f"require a: some drone: {formula}"), ENDS_EARLY)


@pytest.mark.parametrize(
    ("formula", "words", "whole", "now"),
    [
        (
            "eventually[0, 2 s] base reach[hops 0..1 on radio] goal",
            "eventually[0, 2 s]",
            "eventually[0, 2 s] (base reach[…] goal)",
            "(eventually[0, 2 s] base) reach[…] goal",
        ),
        (
            "G[0, 2 s] (base or goal) U[0, 3 s] (goal)",
            "G[0, 2 s]",
            "G[0, 2 s] ((base or goal) until[…] (goal))",
            "(G[0, 2 s] (base or goal)) until[…] (goal)",
        ),
        (
            "not always[0, 2 s] base surround[hops 0..1 on radio] goal",
            "not always[0, 2 s]",
            "not always[0, 2 s] (base surround[…] goal)",
            "(not always[0, 2 s] base) surround[…] goal",
        ),
        (
            "always[0, 2 s] next not base release[0, 3 s] goal",
            "always[0, 2 s] next",
            "always[0, 2 s] next (not base release[…] goal)",
            "(always[0, 2 s] next not base) release[…] goal",
        ),
        (
            "base until[0, 3 s] next base until[0, 2 s] goal",
            "next",
            "next (base until[…] goal)",
            "(next base) until[…] goal",
        ),
        (
            "somewhere[hops 0..1 on radio] base until[0, 2 s] goal",
            "somewhere[hops 0..1 on radio]",
            "somewhere[hops 0..1 on radio] (base until[…] goal)",
            "(somewhere[hops 0..1 on radio] base) until[…] goal",
        ),
    ],
)
def test_an_operator_that_ends_early_is_shown_with_both_readings(
    formula: str, words: str, whole: str, now: str
) -> None:
    (finding,) = warned(formula)
    assert finding.primary is not None
    assert finding.primary.span.text == words
    assert f"`{whole}`" in finding.help
    assert f"`{now}`" in finding.help
    for reading in (whole, now):
        assert not warned(reading.replace("reach[…]", "reach[hops 0..1]").replace("…", "0, 1 s")), reading


@pytest.mark.parametrize(
    "formula",
    [
        "(eventually[0, 2 s] base) reach[hops 0..1 on radio] goal",
        "eventually[0, 2 s] (base reach[hops 0..1 on radio] goal)",
        "not base until[0, 2 s] goal",
        "not base reach[hops 0..1 on radio] goal",
        "not not base reach[hops 0..1 on radio] goal",
        "base until[0, 2 s] eventually[0, 1 s] goal",
        "base until[0, 2 s] (next base) until[0, 1 s] goal",
        "always[0, 2 s] base and base until[0, 1 s] goal",
        "not (eventually[0, 2 s] base) until[0, 1 s] goal",
        "always[0, 2 s] base implies goal",
        "always[0, 2 s] count[hops 0..1 on radio] base >= 1 or (base until[0, 1 s] goal)",
    ],
)
def test_nothing_is_said_where_the_reading_is_written_or_plain(formula: str) -> None:
    assert warned(formula) == []
