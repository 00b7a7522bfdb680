"""Requirements that every start satisfies before anybody moves."""

from __future__ import annotations

import pytest

from missionc.base.diagnostics.code import ASKS_NOTHING
from tests.support.check_findings import found, only, text, words

AT = "team drone[3] { radius 0.1 m  dynamics single_integrator(speed <= 2 m/s)  start at (1, 1), (1, 2), (1, 2.9) }"


@pytest.mark.parametrize(
    "formula",
    [
        "every drone: eventually[0, 20 s] base",
        "some drone: eventually[0, 20 s] base",
        "drone[0]: eventually[0, 20 s] (drone reach[hops 0..2 on radio] base)",
        "drone[0]: eventually[0, 20 s] somewhere[distance <= 3 m on radio] base",
        "drone[1]: (not goal) until[0, 20 s] base",
        "eventually[0, 20 s] at least 2 drone: base",
        "every drone: eventually[0, 20 s] eventually[0, 3 s] (base or fire)",
    ],
)
def test_what_a_start_in_the_region_satisfies_is_said(formula: str) -> None:
    assert len(found(text(f"require home: {formula}"), ASKS_NOTHING)) == 1


@pytest.mark.parametrize(
    "formula",
    [
        "every drone: eventually[1 s, 20 s] base",
        "every drone: eventually[0, 20 s] goal",
        "every drone: eventually[0, 20 s] inside(base)",
        "drone[0]: eventually[0, 20 s] (drone reach[hops 1..2 on radio] base)",
        "every drone: eventually[0, 18 s] always[0, 2 s] base",
        "every drone: base until[0, 20 s] goal",
        "every drone: always[0, 10 s] eventually[0, 10 s] base",
        "every drone: eventually[0, 20 s] (base and fire)",
        "every drone: eventually[0, 20 s] not base",
    ],
)
def test_what_has_to_be_done_is_not(formula: str) -> None:
    assert found(text(f"require home: {formula}"), ASKS_NOTHING) == []


def test_given_places_are_looked_at_one_by_one() -> None:
    assert found(text("require low: every drone: eventually[0, 20 s] y <= 2.5", agents=AT), ASKS_NOTHING) == []
    finding = only(text("require low: every drone: eventually[0, 20 s] y <= 2.95", agents=AT), ASKS_NOTHING)
    assert words(finding)[0][1] == "true at 0 s for `drone[0]`, `drone[1]` and `drone[2]`, for every start position"


def test_a_region_within_which_they_start_counts_as_theirs() -> None:
    wide = "region wide = box (0, 0) to (4, 4)"
    assert len(found(text(wide, "require home: every drone: eventually[0, 20 s] wide"), ASKS_NOTHING)) == 1
    part = "region part = box (0.5, 0.5) to (2, 2)"
    assert found(text(part, "require home: every drone: eventually[0, 20 s] part"), ASKS_NOTHING) == []


def test_what_cannot_be_violated_is_said_once() -> None:
    assert found(text("require any: every drone: eventually[0, 20 s] (base or not base)"), ASKS_NOTHING) == []
