"""Requirements that contradict on their face, that cannot be violated, and routes that mean nothing."""

from __future__ import annotations

from pathlib import Path

import pytest

from missionc.base.diagnostics.code import (
    CONTRADICTION,
    ESCAPES_AT_ONCE,
    HOPS_BEYOND_TEAM,
    NEVER_HOLDS,
    REACHES_ITSELF,
    TOO_FAR,
    VACUOUS,
)
from missionc.base.diagnostics.model import has_errors
from missionc.compiler.driver import check
from tests.support.check_findings import findings, found, only, text, words

BRICK = "obstacle brick = box (7.2, 7.2) to (8.8, 8.8)"

# -------------------------------------------------------------- contradictions


def test_a_place_avoided_throughout_and_visited_sometime_is_a_contradiction() -> None:
    mission = text(
        "require keep: every drone: always[0, 20 s] not fire",
        "require look: some drone: eventually[3 s, 5 s] fire",
    )
    finding = only(mission, CONTRADICTION)
    assert finding.message == "requirements `keep` and `look` contradict each other"
    assert words(finding) == [
        ("fire", "requires `fire` of some `drone`, at some step from 3 s to 5 s"),
        ("fire", "requires `not fire` of every `drone`, from 0 s to 20 s"),
    ]
    assert finding.notes == ("both apply to one agent and exclude each other, at some step between 3 s and 5 s",)


def test_facts_that_exclude_each_other_are_found(subtests: pytest.Subtests) -> None:
    for one, other in [
        ("every drone: always[3 s, 9 s] goal", "drone[1]: always[9 s, 12 s] base"),
        ("every drone: always[3 s, 9 s] goal", "not (drone[1]: eventually[5 s, 6 s] goal)"),
        ("every drone: always[3 s, 14 s] eventually[0, 5 s] goal", "drone[0]: always[8 s, 15 s] not goal"),
        ("at least 2 drone: always[4 s, 9 s] goal", "at least 2 drone: always[9 s, 10 s] base"),
        ("every drone: always[1 s, 20 s] x <= 4", "some drone: eventually[1 s, 20 s] goal"),
        ("every drone: always[1 s, 20 s] x + 2*y <= 4", "some drone: eventually[1 s, 20 s] 2*x + 4*y >= 9"),
        ("every drone: always[1 s, 20 s] speed >= 1", "some drone: eventually[1 s, 20 s] speed < 1"),
        ("every drone: always[1 s, 20 s] distance(goal) >= 2", "some drone: eventually[1 s, 20 s] goal"),
        ("every drone: always[1 s, 20 s] distance(fire) <= 1.8", "some drone: eventually[1 s, 20 s] goal"),
        ("every drone: always[1 s, 20 s] not touches(fire)", "some drone: eventually[1 s, 20 s] fire"),
        ("always[2 s, 8 s] connected(radio)", "eventually[3 s, 4 s] not connected(radio)"),
        (
            "always[2 s, 8 s] distance(drone[0], drone[1]) >= 3",
            "eventually[5 s, 6 s] distance(drone[0], drone[1]) <= 2",
        ),
        ("every drone: (not goal) until[9 s, 12 s] base", "drone[0]: always[8 s, 9 s] goal"),
        ("every drone: fire release[0, 9 s] not goal", "some drone: always[0, 3 s] x <= 9"),
    ]:
        with subtests.test(one=one, other=other):
            clash = found(text(f"require a: {one}", f"require b: {other}"), CONTRADICTION)
            expected = 0 if "release" in one else 1
            assert len(clash) == expected


@pytest.mark.parametrize(
    ("one", "other"),
    [
        ("every drone: always[3 s, 8 s] goal", "drone[1]: always[12 s, 14 s] base"),
        ("some drone: always[4 s, 9 s] goal", "some drone: always[4 s, 9 s] base"),
        ("at least 2 drone: always[4 s, 9 s] goal", "some drone: always[4 s, 9 s] base"),
        ("every drone: eventually[4 s, 9 s] goal", "every drone: eventually[4 s, 9 s] base"),
        ("every drone: always[1 s, 20 s] (fire implies not goal)", "some drone: eventually[1 s, 20 s] goal"),
        ("every drone: always[1 s, 20 s] x <= 7", "some drone: eventually[1 s, 20 s] goal"),
        ("every drone: always[1 s, 20 s] distance(fire) <= 2.9", "some drone: eventually[4 s, 20 s] goal"),
        ("eventually[2 s, 8 s] connected(radio)", "eventually[3 s, 4 s] not connected(radio)"),
    ],
)
def test_facts_that_can_both_be_are_left_alone(one: str, other: str) -> None:
    assert found(text(f"require a: {one}", f"require b: {other}"), CONTRADICTION) == []


@pytest.mark.parametrize(
    "body",
    [
        "eventually[0, 9 s] (base and goal)",
        "eventually[0, 9 s] (x <= 3 and goal)",
        "eventually[0, 9 s] (goal and always[0, 2 s] not goal)",
        "(not fire) until[0, 9 s] (base and not base)",
        "eventually[0, 9 s] (base and eventually[0, 3 s] (goal and fire))",
    ],
)
def test_two_places_at_once_are_a_contradiction_in_one_requirement(body: str) -> None:
    assert only(text(f"require r: every drone: {body}"), CONTRADICTION).message.startswith("requirement `r` can never")


def test_a_requirement_may_contradict_itself() -> None:
    mission = text("require r: every drone: (always[2 s, 9 s] goal) and (eventually[3 s, 4 s] not goal)")
    assert only(mission, CONTRADICTION).message == "requirement `r` contradicts itself"


def test_a_speed_no_agent_has_can_never_be() -> None:
    finding = only(text("require r: some drone: eventually[0, 20 s] speed >= 3 m/s"), CONTRADICTION)
    assert finding.message == "requirement `r` can never be satisfied"
    assert words(finding) == [("speed >= 3 m/s", "always false: the speed stays between 0 and 2 m/s")]


def test_a_region_too_narrow_for_a_body_can_never_hold_it() -> None:
    mission = text("region slot = box (5, 8) to (5.1, 9)", "require r: some drone: eventually[0, 20 s] inside(slot)")
    assert words(only(mission, CONTRADICTION)) == [("inside(slot)", "false at every possible position")]


def test_a_region_whose_free_places_are_too_near_to_an_obstacle_can_never_be_entered() -> None:
    mission = text("region rim = box (7.1, 7.1) to (8.9, 8.9)", BRICK, "require r: some drone: eventually[0, 20 s] rim")
    assert found(mission, CONTRADICTION) == []
    assert len(found(mission.replace("(7.1, 7.1) to (8.9, 8.9)", "(7.15, 7.15) to (8.85, 8.85)"), CONTRADICTION)) == 1


def test_a_requirement_that_breaks_where_an_agent_starts_is_a_contradiction() -> None:
    finding = only(text("require r: every drone: always[0, 20 s] not base"), CONTRADICTION)
    assert finding.message == "requirement `r` contradicts the start of `drone[0]`"
    assert ("in base", "`drone[0]` starts here, at 0 s") in words(finding)
    assert finding.notes == ("also `drone[1]` and `drone[2]`",)
    assert found(text("require r: every drone: always[1 s, 20 s] not base"), CONTRADICTION) == []


def test_a_start_at_a_point_is_held_against_the_requirements() -> None:
    agents = "team drone[2] { dynamics single_integrator(speed <= 2 m/s)  start at (5, 5.5), (8, 1) }"
    finding = only(text("require r: every drone: always[0, 20 s] not fire", agents=agents), CONTRADICTION)
    assert finding.message == "requirement `r` contradicts the start of `drone[0]`"
    assert found(text("require r: some drone: always[0, 20 s] not fire", agents=agents), CONTRADICTION) == []


def test_a_finish_is_held_against_the_requirements() -> None:
    agents = "team drone[2] { dynamics single_integrator(speed <= 2 m/s)  start in base  finish in goal }"
    finding = only(text("require r: every drone: always[9 s, 20 s] base", agents=agents), CONTRADICTION)
    assert finding.message == "requirement `r` contradicts the finish of `drone[0]`"


def test_what_is_out_of_reach_at_the_start_is_said_once() -> None:
    mission = text("require r: every drone: always[0, 20 s] goal")
    assert len(found(mission, CONTRADICTION)) == 1
    assert found(mission, TOO_FAR) == []


# -------------------------------------------------------------------- vacuous


def test_a_requirement_that_cannot_be_violated_is_warned_of(subtests: pytest.Subtests) -> None:
    for requirement, part, why in [
        ("every drone: always[0, 20 s] speed <= 3 m/s", "speed <= 3 m/s", "the speed stays between 0 and 2 m/s"),
        ("every drone: always[0, 20 s] (fire or not fire)", "fire or not fire", "true for all values of its operands"),
        (
            "every drone: eventually[0, 9 s] (fire implies fire)",
            "fire implies fire",
            "true for all values of its operands",
        ),
        ("every drone: (fire iff base) or not (fire iff base)", "", "true for all values of its operands"),
        ("every drone: (fire and goal) implies (goal and fire)", "", "true for all values of its operands"),
        ("distance(drone[0], drone[1]) <= 15", "distance(drone[0], drone[1]) <= 15", "between 0.2 and 14.1421 m"),
        ("every drone: always[0, 20 s] x >= 0", "x >= 0", "`x` stays between 0 and 10 m"),
        ("every drone: always[0, 20 s] distance(goal) <= 13", "distance(goal) <= 13", "between -1 and 12.7279 m"),
        ("every drone: always[0, 20 s] altitude <= 2", "altitude <= 2", "the altitude is 1 m"),
        ("some drone: drone", "drone", "always true"),
        (
            "every drone: always[0, 20 s] (everywhere[hops 0..2] (x <= 3 or x > 3))",
            "",
            "true for all values of its operands",
        ),
        ("every drone: always[0, 20 s] count[hops 0..2] fire >= 0", "", "true for every agent"),
    ]:
        with subtests.test(requirement=requirement, part=part, why=why):
            finding = only(text(f"require r: {requirement}"), VACUOUS)
            assert finding.message == "requirement `r` cannot be violated: every plan satisfies it"
            ((where, said),) = words(finding)
            assert why in said
            assert part in ("", where)


def test_a_region_that_covers_the_world_cannot_be_left() -> None:
    mission = text("region all = box (0, 0) to (10, 10)", "require r: every drone: always[0, 20 s] all")
    assert words(only(mission, VACUOUS)) == [("all", "true at every possible position")]
    assert found(mission.replace("(0, 0) to (10, 10)\n", "(0, 0) to (9.9, 10)\n"), VACUOUS)[1:] == []


def test_what_holds_of_one_team_only_is_no_vacuous_requirement_of_another() -> None:
    fast = "agent scout { dynamics single_integrator(speed <= 5 m/s)  start at (5, 1) }"
    slow_only = text(fast, "require r: every drone: always[0, 20 s] speed <= 3 m/s")
    assert len(found(slow_only, VACUOUS)) == 1
    both = text(fast, "group all = drone, scout", "require r: every all: always[0, 20 s] speed <= 3 m/s")
    assert found(both, VACUOUS) == []


def test_a_requirement_that_a_plan_can_violate_is_left_alone() -> None:
    assert found(text("require r: every drone: always[0, 20 s] speed <= 1.9 m/s"), VACUOUS) == []
    assert found(text("require r: every drone: always[1 s, 20 s] (fire or not goal)"), VACUOUS) == []


# --------------------------------------------------------------------- routes


def test_a_route_of_more_hops_than_the_graph_has_agents_for_is_refused() -> None:
    finding = only(text("require r: every drone: eventually[0, 20 s] somewhere[hops 3..4] goal"), HOPS_BEYOND_TEAM)
    assert finding.message == "a route of 3 hops needs 4 agents; graph `radio` has 3"
    assert words(finding)[0][0] == "somewhere[hops 3..4]"
    assert finding.help == "lower the bound to 2 hops or fewer"


def test_an_upper_bound_beyond_the_team_is_harmless() -> None:
    mission = text("require r: every drone: eventually[0, 20 s] somewhere[hops 2..99] goal")
    assert found(mission, HOPS_BEYOND_TEAM) == []


def test_an_escape_from_no_distance_is_warned_of() -> None:
    finding = only(text("require r: drone[0]: always[0, 20 s] escape[hops 0..2 on radio] (not fire)"), ESCAPES_AT_ONCE)
    assert words(finding)[0] == ("escape[hops 0..2 on radio]", "equivalent to `not fire`")
    assert finding.help == "require a distance: `escape[hops 1..2 on radio]`"
    assert found(text("require r: drone[0]: always[1 s, 20 s] escape[hops 1..] (not fire)"), ESCAPES_AT_ONCE) == []


@pytest.mark.parametrize("route", ["somewhere[hops 0..2] drone", "fire reach[hops <= 2] drone"])
def test_a_route_that_the_agent_itself_ends_is_warned_of(route: str) -> None:
    finding = only(text(f"require r: every drone: eventually[0, 20 s] {route}"), REACHES_ITSELF)
    assert finding.message.endswith("each of the 3 agents is the end of its own route of 0 hops")
    assert finding.help.startswith("require another agent: `")
    assert "[hops 1..2 on radio]" in finding.help


@pytest.mark.parametrize(
    "route",
    ["somewhere[hops 1..2] drone", "somewhere[hops 0..2] (drone and not fire)", "drone reach[hops 0..2] base",
     "somewhere[hops 0..2] drone[1]"],
)  # fmt: skip
def test_a_route_that_has_to_go_somewhere_is_left_alone(route: str) -> None:
    assert found(text(f"require r: every drone: eventually[0, 20 s] {route}"), REACHES_ITSELF) == []


# --------------------------------------------------------------------- corpus


def test_the_missions_have_no_errors_and_one_promised_warning(missions: Path) -> None:
    told = {}
    for path in sorted(missions.glob("*.mission")):
        checked = check(path)
        assert not has_errors(list(checked.findings)), path.name
        told[path.stem] = {finding.code for finding in checked.findings} & {VACUOUS, ESCAPES_AT_ONCE, REACHES_ITSELF}
    assert {name: codes for name, codes in told.items() if codes} == {"strel_escape": {ESCAPES_AT_ONCE}}


def test_a_mission_without_any_of_this_is_clean() -> None:
    mission = text("require r: every drone: always[0, 20 s] (not fire implies somewhere[hops 0..2] (goal or base))")
    assert findings(mission) == []


def test_no_more_findings_come_than_anybody_reads_and_errors_come_before_warnings() -> None:
    vacuous = [f"require v{number}: every drone: x >= 0" for number in range(150)]
    impossible = "require i: every drone: always[0, 5] (goal and not goal)"
    said = [finding.code for finding in findings(text(*vacuous, impossible))]
    assert len(said) <= 110
    assert CONTRADICTION in said


def test_many_conditions_in_one_formula_are_looked_at_in_one_pass() -> None:
    """Each reaches as far ahead as the others; a pair by pair comparison of them would take minutes."""
    many = " or ".join(f"x <= {number}" for number in range(4_000))
    assert findings(text(f"require r: every drone: {many}", "require q: every drone: goal or fire or base")) != []


# ------------------------------------------------ comparisons that never hold


@pytest.mark.parametrize(
    ("goal", "part", "why"),
    [
        ("require a: some drone: eventually[0, 20 s] (y > 12 or goal)", "y > 12", "`y` stays between 0 and 10 m"),
        ("prefer a: some drone: eventually[0, 20 s] y > 12", "y > 12", "`y` stays between 0 and 10 m"),
        ("require a: every drone: always[0, 20 s] (not (x < -1) and x < 9)", "x < -1", "`x` stays between 0 and 10 m"),
        (
            "let fast = speed >= 3 m/s\nrequire a: some drone: eventually[0, 20 s] (fast or goal)",
            "speed >= 3 m/s",
            "the speed stays between 0 and 2 m/s",
        ),
    ],
)
def test_a_comparison_that_never_holds_is_pointed_at_where_its_goal_may_hold_without_it(
    goal: str, part: str, why: str
) -> None:
    finding = only(text(goal), NEVER_HOLDS)
    assert words(finding) == [(part, f"always false: {why}")]
    assert not has_errors([finding])


def test_a_comparison_that_decides_its_requirement_is_said_once_and_of_the_requirement() -> None:
    mission = text("require a: some drone: eventually[0, 20 s] y > 12")
    assert found(mission, NEVER_HOLDS) == []
    assert words(only(mission, CONTRADICTION)) == [("y > 12", "always false: `y` stays between 0 and 10 m")]


def test_a_comparison_used_twice_is_said_once_and_one_that_some_agent_can_satisfy_not_at_all() -> None:
    high = "let high = y > 12"
    one = "require a: some drone: eventually[0, 20 s] (high or goal)"
    other = "require b: every drone: always[0, 20 s] (high or not fire)"
    assert len(found(text(high, one, other), NEVER_HOLDS)) == 1
    fast = "agent jet { radius 0.1 m  dynamics single_integrator(speed <= 9 m/s)  start in base }"
    mission = text(fast, "require a: some (drone + jet): eventually[0, 20 s] (speed >= 3 m/s or goal)")
    assert found(mission, NEVER_HOLDS) == []


def test_a_place_that_an_obstacle_fills_is_given_as_the_reason_and_not_the_size_of_the_world() -> None:
    wall = "obstacle wall = box (8, 0) to (10, 10)"
    finding = only(text(wall, "require a: some drone: eventually[0, 20 s] (x > 8.5 or fire)"), NEVER_HOLDS)
    assert words(finding) == [("x > 8.5", "false at every possible position")]
