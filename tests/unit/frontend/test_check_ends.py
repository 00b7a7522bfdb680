"""Starts and finishes that break a requirement by themselves: said by the check, with who, where, and by how much."""

from __future__ import annotations

import pytest

from missionc.base.diagnostics.code import CONTRADICTION
from missionc.base.diagnostics.model import Diagnostic
from missionc.base.source import Source
from missionc.compiler.driver import check

HEAD = """\
mission apart
time step 1 s, horizon 5 s
world (0, 0) to (10, 10)
region base = box (0.5, 0.5) to (1.5, 1.5)
region yard = box (7, 7) to (7.4, 7.4)
region near = box (2, 0.5) to (9, 1.5)
beacon mast = (1, 5)
graph radio = proximity 2 m
graph cell = beacons 5 m
formation row = line of drone spacing 1 m tolerance 0.1 m
formation loose = chain of drone spacing 1 m total tolerance 0.1 m
team drone[3] {{ radius 0.1 m  dynamics single_integrator(speed <= 2 m/s)  {} }}
"""

EYES = "obstacle post = box (4, 0.5) to (5, 9)\ngraph eyes = sight 9 m"
POINTS = "start at (1, 1), (2, 1), (6, 1)"
ENDS = "start in base  finish at (1, 1), (2, 1), (6, 1)"


def found(items: str, formula: str) -> list[Diagnostic]:
    text = HEAD.format(items) + f"require r: {formula}\n"
    checked = check(Source("apart.mission", text), backend="any")
    return [each for each in checked.findings if not each.code.warning]


BROKEN = (
    ("always[0, 5 s] connected(radio, drone)", "connected(radio, drone)", 2.0),
    ("connected(cell)", "connected(cell)", 1.4031),
    ("row", "row", 2.9),
    ("loose", "loose", 2.9),
    ("(next row) or distance(drone[1], drone[2]) <= 3 m and row", None, 0.0),
    ("distance(drone[1], drone[2]) <= 3 m", "distance(drone[1], drone[2]) <= 3 m", 1.0),
    ("distance(drone[0], drone[1]) > 1 m", "distance(drone[0], drone[1]) > 1 m", 0.0),
    ("row until[2 s, 3 s] connected(radio)", "row", 2.9),
    ("row until[0, 3 s] (distance(drone[0], drone[2]) <= 4 m)", "distance(drone[0], drone[2]) <= 4 m", 1.0),
    ("every drone: always[0, end] (base reach[hops 0..1 on radio] base)", None, 4.5),
    ("drone[2]: somewhere[hops 0..2 on radio] base", "somewhere[hops 0..2 on radio] base", 2.0),
    ("drone[0]: everywhere[hops 0..1 on radio] base", "everywhere[hops 0..1 on radio] base", 0.5),
    ("every drone: always[0, 2 s] count[hops 1..1 on radio] drone >= 1", "count[hops 1..1 on radio] drone >= 1", 2.0),
    ("at least 2 drone: distance(drone[2]) <= 3 m", "distance(drone[2]) <= 3 m", 1.0),
    ("not (eventually[0, 3 s] distance(drone[0], drone[1]) <= 2 m)", "distance(drone[0], drone[1]) <= 2 m", 1.0),
    ("always[0, 2 s] (not connected(radio, drone) implies row)", None, 2.0),
)


@pytest.mark.parametrize(("formula", "words", "amount"), [each for each in BROKEN if each[2] or each[1]])
def test_what_the_starts_break_is_said_with_the_margin(formula: str, words: str | None, amount: float) -> None:
    (finding,) = found(POINTS, formula)
    assert finding.code is CONTRADICTION
    assert finding.message.startswith("requirement `r` contradicts the start of `drone[")
    assert finding.primary is not None
    if words is not None:
        assert finding.primary.span.text == words
    assert "at 0 s" in finding.primary.message
    assert (f"by {amount:.10g} m" in finding.primary.message) == (amount > 0)
    assert finding.labels
    assert all(each.span.text in POINTS and "here" in each.message for each in finding.labels)
    assert finding.help.startswith("exclude 0 s")


@pytest.mark.parametrize(
    "formula",
    [
        "always[1 s, 5 s] connected(radio, drone)",
        "eventually[0, 5 s] row",
        "row or next row",
        "row until[0, 3 s] distance(drone[0], drone[1]) <= 1 m",
        "connected(radio, drone) iff row",
        "every drone: speed <= 1 m/s",
        "at least 1 drone: distance(drone[2]) <= 3 m",
        "drone[0]: (base reach[hops 0..1 on radio] not base)",
    ],
)
def test_what_is_left_open_or_kept_is_no_finding(formula: str) -> None:
    assert found(POINTS, formula) == []


def test_the_two_that_are_too_far_apart_are_named_with_their_distance() -> None:
    (finding,) = found(POINTS, "always[0, 5 s] connected(radio, drone)")
    assert finding.message == "requirement `r` contradicts the start of `drone[1]` and `drone[2]`"
    assert finding.notes == ("`drone[1]` and `drone[2]` are 4 m apart; the radius of `radio` is 2 m",)


def test_two_that_do_not_see_each_other_where_they_start_are_named_with_what_is_in_the_way() -> None:
    (finding,) = found(POINTS, f"always[0, 5 s] connected(eyes, drone[1..2])\n{EYES}")
    assert finding.message == "requirement `r` contradicts the start of `drone[1]` and `drone[2]`"
    assert finding.primary is not None
    assert finding.primary.message == "false at 0 s by 0.5 m"
    (note,) = finding.notes
    assert (
        note == "`drone[1]` and `drone[2]` are 4 m apart; "
        "the radius of `eyes` is 9 m, and an obstacle blocks the line of sight"
    )


@pytest.mark.parametrize(
    ("formula", "amount"),
    [("always[0, end] connected(radio, drone)", 2.0), ("eventually[5 s, 5 s] row", 2.9), ("always[2 s, end] row", 2.9)],
)
def test_what_the_finishes_break_is_said_too(formula: str, amount: float) -> None:
    (finding,) = found(ENDS, formula)
    assert finding.primary is not None
    assert finding.primary.message == f"false at 5 s by {amount:g} m"
    assert "finish" in finding.message
    assert finding.help.startswith("exclude 5 s")


def test_regions_that_no_choice_mends_are_said_and_others_are_not() -> None:
    other = "start in base }\nagent scout { dynamics single_integrator(speed <= 2 m/s)  start in "
    (finding,) = found(other + "yard", "always[0, 5 s] connected(radio)")
    assert finding.primary is not None
    assert "or more, for all positions in their regions" in finding.primary.message
    assert found(other + "near", "always[0, 5 s] connected(radio)") == []


@pytest.mark.parametrize(
    ("formula", "words"),
    [
        ("drone[0]: once[2 s, 3 s] near", "once[2 s, 3 s] near"),
        (
            "(drone[0]: eventually[2 s, 4 s] once[1 s, 3 s] near) and (drone[0]: base since[2 s, 3 s] near)",
            "base since[2 s, 3 s] near",
        ),
    ],
)
def test_what_no_motion_changes_is_not_blamed_on_a_start_or_a_finish(formula: str, words: str) -> None:
    (finding,) = found("start in near", formula)
    assert finding.message == "requirement `r` cannot be satisfied by any motion"
    assert finding.primary is not None
    assert (finding.primary.span.text, finding.primary.message) == (words, "false at 0 s for every motion")
