"""Changes of a mission's text: which there are, what they say, and which of them is tried next."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from missionc.backends.smt.settings import smt_settings
from missionc.base.source import Source
from missionc.compiler.front_end import Checked, check
from missionc.compiler.relax import relax_world
from missionc.compiler.relax.edits import (
    ConflictTarget,
    ConflictTargets,
    Edit,
    RelaxationParameter,
    changes,
    conflict_targets,
    edited,
)
from missionc.compiler.relax.search_relaxations import Bracket

RICH = """\
mission rich
param T = 12 s
param R = 1.5 m
time step 1 s, horizon T
world (0, 0) to (10, 10)
region base = box (1, 1) to (3, 3)
region mast = disc at (5, 5) radius 0.5 m
region fire = disc at (8, 8) radius 0.5 m
team drone[4] {
  radius   0.1 m
  dynamics single_integrator(speed <= 1 m/s)
  start    in base
}
graph radio = proximity R
graph quiet = proximity 0.4 m
formation row = line of drone spacing 0.5 m tolerance 0.2 m
separation 0.3 m
"""

HEARD = "require heard: every drone: always[0, T] somewhere[hops 0..2 on radio] base\n"


def checked(text: str, **overrides: str) -> Checked:
    found = check(Source("a.mission", text), overrides=overrides)
    assert found.ok, found.findings
    return found


def asks(found: Checked) -> ConflictTargets:
    assert found.kernel is not None
    return conflict_targets(goal.formula for goal in found.kernel.requirements)


def knobs(found: Checked) -> list[RelaxationParameter]:
    """All there are but those that leave something out."""
    mission, asked = found.mission, asks(found)
    assert mission is not None
    return [
        *relax_world.horizon(found, mission),
        *relax_world.windows(found, mission, asked),
        *relax_world.lengths(found, mission, asked),
        *relax_world.counts(found, asked),
        *relax_world.comparisons(found, asked),
        *relax_world.headings(found, asked),
        *relax_world.graphs(found, asked),
        *relax_world.formations(found, asked),
        *relax_world.regions(found, mission, asked),
        *relax_world.margins(found),
        *relax_world.teams(found),
        *relax_world.roadmap(found, 318),
    ]


def said(found: Checked, notches: int = 1) -> list[str]:
    edits = [knob.edit(notches) for knob in knobs(found)]
    return [edit.says for edit in edits if edit is not None]


def lines(found: Checked, edit: Edit | None) -> list[str]:
    assert edit is not None
    return [change.after for change in changes(edit, found.overrides)]


def test_a_mission_is_changed_where_its_requirements_look_and_nowhere_else() -> None:
    assert said(checked(RICH + HEARD)) == [
        "horizon 13 s instead of 12 s",
        "in `heard`, the end of `always[0, T]` at 11 s instead of 12 s",
        "the bound of `[hops 0..2 on radio]` 3 instead of 2",
        "the radius of `radio` 1.6 m instead of 1.5 m",
        "`base` larger by 0.1 m to each side",
        "separation 0.29 m instead of 0.3 m",
        "the size of team `drone` 5 instead of 4",
        "a finer roadmap, of 541 nodes",
    ]


@pytest.mark.parametrize(
    ("formula", "change"),
    [
        ("some drone: eventually[0, 5 s] mast", "the end of `eventually[0, 5 s]` at 6 s instead of 5 s"),
        ("every drone: always[0, 5 s] base", "the end of `always[0, 5 s]` at 4 s instead of 5 s"),
        ("every drone: not eventually[0, 5 s] mast", "the end of `eventually[0, 5 s]` at 4 s instead of 5 s"),
        ("every drone: (not mast) until[0, 5 s] mast", "the end of `until[0, 5 s]` at 6 s instead of 5 s"),
        ("every drone: mast release[0, 5 s] base", "the end of `release[0, 5 s]` at 4 s instead of 5 s"),
        ("every drone: not everywhere[hops 0..2 on radio] base", "the bound of `[hops 0..2 on radio]` 3 instead of 2"),
        ("every drone: everywhere[hops 0..2 on radio] base", "the bound of `[hops 0..2 on radio]` 1 instead of 2"),
        ("every drone: everywhere[hops 0..2 on radio] base", "the radius of `radio` 1.4 m instead of 1.5 m"),
        ("every drone: somewhere[distance <= 3 m on radio] base", "the bound of `[distance <= 3 m on radio]` 3.1 m"),
        ("every 5 s: some drone: mast", "in `asked`, the period 6 s instead of 5 s"),
        ("every (R * 4 s / (1.5 m)): some drone: mast", "the radius of `mast` 0.51 m instead of 0.5 m"),
        ("at least 2 drone: base", "at least, of `drone`, 1 instead of 2"),
        ("every drone: count[hops 0..1 on radio] base >= 2", "`count[hops 0..1 on radio] base >= 2` 1 instead of 2"),
        ("every drone: count[hops 0..1 on radio] mast <= 2", "`count[hops 0..1 on radio] mast <= 2` 3 instead of 2"),
        ("every drone: always[0, T] x <= 3 m", "the bound of `x <= 3 m` 3.1 m instead of 3 m"),
        ("every drone: always[0, T] x >= 3 m", "the bound of `x >= 3 m` 2.9 m instead of 3 m"),
        ("every drone: always[0, T] 3 m >= x", "the bound of `3 m >= x` 3.1 m instead of 3 m"),
        ("every drone: always[0, T] not x <= 3 m", "the bound of `x <= 3 m` 2.9 m instead of 3 m"),
        ("every drone: always[0, T] distance(mast) > 50 cm", "the bound of `distance(mast) > 50 cm` 49 cm"),
        ("eventually[0, T] row", "the tolerance of `row` 0.21 m instead of 0.2 m"),
        ("always[0, T] connected(radio)", "the radius of `radio` 1.6 m instead of 1.5 m"),
        ("some drone: eventually[0, T] mast", "the radius of `mast` 0.51 m instead of 0.5 m"),
    ],
)
def test_a_number_moves_the_way_that_asks_for_less(formula: str, change: str) -> None:
    assert any(change in each for each in said(checked(f"{RICH}require asked: {formula}\n")))


def test_what_is_to_be_kept_away_from_does_not_grow() -> None:
    found = checked(RICH + "require away: every drone: always[0, T] not fire\n")
    assert asks(found).regions == {"fire": ConflictTarget.LESS}
    assert not any("fire" in each for each in said(found))


def test_what_a_formula_needs_both_ways_stays_as_it_is() -> None:
    found = checked(RICH + "require both: every drone: eventually[0, T] (base iff x <= 3 m)\n")
    assert not any("the bound of" in each or "larger" in each for each in said(found))


@pytest.mark.parametrize("ask", [HEARD, "require late: some drone: eventually[0, 12 s] mast\n"])
def test_every_change_is_of_a_text_that_checks(ask: str) -> None:
    found = checked(
        RICH.replace("horizon T", "horizon 12 s").replace("param T = 12 s\n", "") + ask.replace("T]", "end]")
    )
    for knob in knobs(found):
        for notches in {1, knob.first}:
            edit = knob.edit(notches)
            assert edit is not None
            source, overrides = edited(found, edit)
            again = check(source, overrides=overrides)
            assert again.ok, (edit.says, again.findings)


def test_windows_that_are_written_with_the_horizons_parameter_follow_it() -> None:
    found = checked(RICH + HEARD)
    assert found.mission is not None
    (horizon,) = relax_world.horizon(found, found.mission)
    assert lines(found, horizon.edit(14)) == ["param T = 26 s"]


def test_windows_that_end_with_the_mission_follow_its_horizon_however_they_are_written() -> None:
    text = RICH.replace("horizon T", "horizon 12 s").replace("param T = 12 s\n", "param LATE = 12 s\n")
    found = checked(
        f"{text}require one: every drone: always[0, 12 s] x <= 9 m\n"
        "require two: some drone: (eventually[0, LATE] mast and eventually[0, 5 s] base)\n"
        "require three: some drone: eventually[0, LATE] fire\n"
    )
    assert found.mission is not None
    (horizon,) = relax_world.horizon(found, found.mission)
    edit = horizon.edit(3)
    assert edit is not None
    assert edit.says == "horizon 15 s instead of 12 s, with the windows that end with it"
    assert lines(found, edit) == [
        "param LATE = 15 s",
        "time step 1 s, horizon 15 s",
        "require one: every drone: always[0, 15 s] x <= 9 m",
    ]


def test_a_parameter_given_on_the_command_line_is_changed_there() -> None:
    found = checked(RICH + HEARD, T="13s", R="2 m")
    assert found.mission is not None
    (horizon,) = relax_world.horizon(found, found.mission)
    edit = horizon.edit(13)
    assert edit is not None
    (change,) = changes(edit, found.overrides)
    assert (change.file, change.line, change.before, change.after) == ("", 0, "-D T=13s", "-D T=26s")
    assert edited(found, edit)[1] == {"T": "26s", "R": "2 m"}


def test_a_window_that_ends_past_the_mission_takes_the_horizon_with_it() -> None:
    text = RICH.replace("horizon T", "horizon 12 s").replace("param T = 12 s\n", "")
    found = checked(text + "require late: some drone: eventually[0, 11 s] mast\n")
    assert found.mission is not None
    (window,) = relax_world.windows(found, found.mission, asks(found))
    assert lines(found, window.edit(1)) == ["require late: some drone: eventually[0, 12 s] mast"]
    assert lines(found, window.edit(3)) == [
        "time step 1 s, horizon 14 s",
        "require late: some drone: eventually[0, 14 s] mast",
    ]


def test_two_numbers_on_one_line_are_one_change() -> None:
    found = checked(RICH + HEARD)
    assert found.mission is not None
    (base,) = relax_world.regions(found, found.mission, asks(found))
    edit = base.edit(15)
    assert edit is not None
    (change,) = changes(edit, {})
    assert change.line == 6
    assert change.before == "region base = box (1, 1) to (3, 3)"
    assert change.after == "region base = box (0, 0) to (4.5, 4.5)", "no larger than the world"


def test_a_requirement_left_out_is_a_line_less() -> None:
    found = checked(RICH + HEARD)
    assert found.mission is not None
    (knob,) = relax_world.without(found, found.mission, ("heard",))
    edit = knob.edit(1)
    assert edit is not None
    (change,) = changes(edit, {})
    assert (change.before + "\n", change.after) == (HEARD, "")


@pytest.mark.parametrize(
    ("solve", "after"),
    [
        ("", "solve with smt { nodes = 541 }"),
        ("solve with smt\n", "solve with smt { nodes = 541 }"),
        ("solve with smt { nodes = 318 }\n", "solve with smt { nodes = 541 }"),
        ("solve with smt { neighbors = 8 }\n", "solve with smt { nodes = 541, neighbors = 8 }"),
    ],
)
def test_a_finer_roadmap_is_written_where_the_mission_says_how_to_solve_it(solve: str, after: str) -> None:
    found = checked(RICH + HEARD + solve)
    (knob,) = relax_world.roadmap(found, 318)
    edit = knob.edit(1)
    assert lines(found, edit) == [after]
    assert edit is not None
    again = check(edited(found, edit)[0])
    assert again.mission is not None
    assert smt_settings(again.mission).roadmap.nodes == 541


def test_what_is_written_in_another_file_is_not_changed() -> None:
    found = checked(RICH + HEARD)
    elsewhere = Checked(
        "b.mission", (), found.sources, program=found.program, mission=found.mission, kernel=found.kernel
    )
    assert [each for each in said(elsewhere) if "roadmap" not in each] == []


@given(st.integers(1, 40), st.integers(1, 40), st.integers(1, 60))
def test_the_smallest_change_that_does_is_found(first: int, most: int, threshold: int) -> None:
    most = max(first, most)
    trying = Bracket(RelaxationParameter(lambda notches: Edit(str(notches)), 1.0, first, most))
    tried = []
    while (notches := trying.next()) is not None:
        tried.append(notches)
        trying.learn(notches, does=notches >= threshold, proven=True)
    assert len(set(tried)) == len(tried) <= 12
    assert all(1 <= notches <= most for notches in tried)
    assert trying.best == (threshold if threshold <= most else None)
    assert trying.smallest == (threshold <= most)


def test_a_change_below_one_that_was_left_open_is_not_called_the_smallest() -> None:
    trying = Bracket(RelaxationParameter(lambda notches: Edit(str(notches)), 1.0, 2, 2))
    trying.learn(2, does=True, proven=False)
    trying.learn(1, does=False, proven=False)
    assert (trying.best, trying.next(), trying.smallest) == (2, None, False)
