"""A formula whose horizon exceeds the mission's, with the horizon of each part."""

from __future__ import annotations

from missionc.base.diagnostics.code import BEYOND_HORIZON, WINDOW_EMPTY
from missionc.base.diagnostics.render import render_text
from missionc.frontend.checks.check_horizons import steps_ahead
from missionc.ir.language.walk_formulas import goals
from tests.support.check_findings import found, meant, only, text, words


def test_a_window_past_the_horizon_is_refused_with_the_part_of_each() -> None:
    mission = text("require watch: every drone: always[0, 16 s] (goal implies eventually[0, 6 s] base)")
    finding = only(mission, BEYOND_HORIZON)
    assert finding.message == "the mission ends before `watch` can be evaluated"
    assert words(finding) == [
        ("always[0, 16 s]", "reaches 16 s ahead"),
        ("eventually[0, 6 s]", "reaches another 6 s ahead"),
    ]
    assert finding.notes == ("the formula needs 22 s; the mission lasts 20 s",)
    assert finding.help == "write `horizon 22 s`"


def test_the_message_reads_as_the_design_shows_it() -> None:
    mission = text("require watch: every drone: always[0, 16 s] (goal implies eventually[0, 6 s] base)")
    shown = render_text([only(mission, BEYOND_HORIZON)], colour=False)
    assert shown.splitlines()[2:] == [
        "10 | require watch: every drone: always[0, 16 s] (goal implies eventually[0, 6 s] base)",
        "   |                             ^^^^^^^^^^^^^^^               ------------------ reaches another 6 s ahead",
        "   |                             reaches 16 s ahead",
        "   = the formula needs 22 s; the mission lasts 20 s",
        "   help: write `horizon 22 s`",
    ]


def test_a_window_that_ends_with_the_mission_is_accepted() -> None:
    mission = text("require r: every drone: always[0, 14 s] eventually[0, 6 s] not fire")
    assert found(mission, BEYOND_HORIZON) == []


def test_seconds_are_shown_as_they_were_meant_whatever_the_step() -> None:
    mission = text(
        "require r: some drone: always[0, 4.7 s] eventually[0, 0.5 s] goal", time="step 0.1 s, horizon 4.7 s"
    )
    assert only(mission, BEYOND_HORIZON).notes == ("the formula needs 5.2 s; the mission lasts 4.7 s",)


def test_the_left_side_of_until_is_asked_one_step_less_far() -> None:
    allowed = text("require r: every drone: (eventually[0, 1 s] base) until[0, 20 s] not fire")
    assert found(allowed, BEYOND_HORIZON) == []
    refused = text("require r: every drone: (eventually[0, 2 s] base) until[0, 20 s] not fire")
    assert only(refused, BEYOND_HORIZON).notes == ("the formula needs 21 s; the mission lasts 20 s",)


def test_the_right_side_of_until_is_asked_at_its_last_step() -> None:
    refused = text("require r: every drone: base until[0, 20 s] next goal")
    assert words(only(refused, BEYOND_HORIZON)) == [
        ("until[0, 20 s]", "reaches 20 s ahead"),
        ("next goal", "reaches another 1 s ahead"),
    ]


def test_release_looks_as_far_as_until() -> None:
    refused = text("require r: every drone: (eventually[0, 2 s] base) release[0, 20 s] not fire")
    assert only(refused, BEYOND_HORIZON).notes == ("the formula needs 21 s; the mission lasts 20 s",)


def test_next_looks_one_step() -> None:
    mission = text("require r: every drone: always[0, 20 s] next not fire")
    assert only(mission, BEYOND_HORIZON).notes == ("the formula needs 21 s; the mission lasts 20 s",)


def test_a_window_to_the_end_leaves_nothing_to_look_at_from_its_last_step() -> None:
    finding = only(text("require r: every drone: always[0, end] eventually[0, 6 s] base"), BEYOND_HORIZON)
    assert words(finding) == [
        ("always[0, end]", "evaluated at every step up to the last, at 20 s"),
        ("eventually[0, 6 s]", "reaches another 6 s ahead"),
    ]
    assert finding.notes == ("no horizon is long enough: the inner window always reaches past the last step",)
    assert finding.help == "write `always[0, 14 s]`"


def test_the_way_out_of_a_window_to_the_end_is_accepted_when_taken() -> None:
    assert found(text("require r: every drone: always[0, 14 s] eventually[0, 6 s] base"), BEYOND_HORIZON) == []
    assert found(text("require r: every drone: always[0, end] eventually[0, end] base"), BEYOND_HORIZON) == []


def test_a_window_to_the_end_under_a_window_is_accepted() -> None:
    mission = text("require r: every drone: (not fire) until[2 s, 20 s] always[0, end] not fire")
    assert found(mission, BEYOND_HORIZON) == found(mission, WINDOW_EMPTY) == []


def test_a_window_to_the_end_that_begins_after_it_holds_no_step() -> None:
    finding = only(text("require r: every drone: always[0, 10 s] eventually[12 s, end] goal"), WINDOW_EMPTY)
    assert finding.message == "in `r`, the window of `eventually[12 s, end]` begins after the last step of the mission"
    assert words(finding)[1] == ("eventually[12 s, end]", "begins another 12 s later")


def test_a_preference_is_held_to_the_horizon_too() -> None:
    mission = text("require r: every drone: always[0, 20 s] not fire\nprefer p: some drone: eventually[0, 21 s] goal")
    assert only(mission, BEYOND_HORIZON).message == "the mission ends before `p` can be evaluated"


def test_every_requirement_that_looks_too_far_is_reported() -> None:
    mission = text(
        "let soon = eventually[0, 15 s] goal",
        "require a: every drone: always[0, 10 s] soon",
        "require b: some drone: always[0, 12 s] soon",
    )
    notes = [finding.notes[0] for finding in found(mission, BEYOND_HORIZON)]
    assert notes == [
        "the formula needs 25 s; the mission lasts 20 s",
        "the formula needs 27 s; the mission lasts 20 s",
    ]


def test_a_shared_formula_is_looked_at_once() -> None:
    lets = ["let f0 = fire"] + [f"let f{n} = (next f{n - 1}) or f{n - 1}" for n in range(1, 18)]
    mission = meant(text(*lets, "require r: every drone: not f17"))
    looks = steps_ahead(goal.formula for goal in goals(mission))
    assert looks[mission.requirements[0].formula].total == 17
    assert len(looks) < 60


def test_one_text_that_looks_too_far_for_several_members_is_one_finding_with_the_longest_horizon() -> None:
    alike = text("require r[i in 0..2]: drone[i]: eventually[0, 25 s] goal")
    assert only(alike, BEYOND_HORIZON).notes[1:] == ("for every `i`",)
    growing = only(text("require r[i in 0..2]: drone[i]: eventually[0, 18 s + i * 2 s] goal"), BEYOND_HORIZON)
    assert growing.help == "write `horizon 22 s`"
    each = text("require r: for i in 0..2: drone[i]: always[0, 10 s] (base implies eventually[0, 15 s] goal)")
    assert only(each, BEYOND_HORIZON).notes[1:] == ("for every `i`",)
