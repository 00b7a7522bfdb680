"""What no plan can do, found before planning: figures, polarity, alternatives, and ways round obstacles."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
import shapely

from missionc.base.diagnostics.code import (
    BARRED,
    CROWDED,
    DEAD_BRANCH,
    JUMP,
    NO_FIT,
    RESTLESS,
    STUCK,
    TOO_FAR,
    Code,
)
from missionc.base.source import Source
from missionc.compiler.front_end import check
from missionc.geometry.clear_ways import ClearWays
from missionc.geometry.geodesic_bounds import VisibilityGraph, around, widest_passage
from missionc.ir import Box, World
from tests.support.check_findings import words

ROOT = Path(__file__).resolve().parents[3]
IMPOSSIBLE = (TOO_FAR, BARRED, JUMP, RESTLESS, CROWDED, NO_FIT, STUCK, DEAD_BRANCH)

HEAD = """\
mission sample
time step 1 s, horizon 20 s
world (0, 0) to (10, 10)
region west = box (0.5, 0.5) to (2, 2)
region east = box (6.4, 0.5) to (8, 2)
region near = box (3.5, 0.5) to (5, 2)
region pad = box (4, 4) to (5, 5)
region yard = box (0, 0) to (10, 10)
"""
DRONES = "team drone[3] { radius 0.1 m  dynamics single_integrator(speed <= 2 m/s)  start in west }"
PLANES = "team drone[2] { radius 0.1 m  dynamics unicycle(speed 1.5..2 m/s, turn <= 20 deg/s)  start in west }"
MANY = "team drone[20] { radius 0.2 m  dynamics single_integrator(speed <= 2 m/s)  start in yard }"
FIVE = "team drone[5] { radius 0.2 m  dynamics single_integrator(speed <= 1 m/s)  start in west }"
WALL = "obstacle wall = box (3, 0) to (3.2, 9)"


def found(goal: str, *items: str, agents: str = DRONES) -> list[tuple[Code, str, str]]:
    """What is said of what cannot be: the code, and the words and the figure that it points at."""
    text = HEAD + "\n".join((*items, agents, goal)) + "\n"
    findings = check(Source("sample.mission", text), backend="any").findings
    assert all(each.code.warning or each.code in IMPOSSIBLE for each in findings), findings
    return [(each.code, *words(each)[0]) for each in findings if each.code in IMPOSSIBLE]


@pytest.mark.parametrize(
    ("formula", "expected"),
    [
        ("west until[3 s, 10 s] east", True),
        ("west until[0, 10 s] east", True),
        ("west until[0, 10 s] near", False),
        ("west until[0, 10 s] west", False),
        ("(not east) until[3 s, 10 s] east", False),
        ("(west or near) until[3 s, 10 s] east", False),
        ("(west or pad) until[3 s, 10 s] east", True),
        ("not (west until[3 s, 10 s] east)", False),
        ("(west until[3 s, 10 s] east) or eventually[0, 10 s] east", False),
        ("eventually[0, 5 s] ((west until[2 s, 5 s] east) and (yard until[0, 2 s] yard))", True),
    ],
)
def test_an_until_takes_a_jump_where_its_sides_are_further_apart_than_a_step(formula: str, expected: bool) -> None:
    said = found(f"require r: drone[0]: {formula}")
    assert (JUMP in {code for code, *_ in said}) == expected
    if expected:
        assert said[0][1] == "east"
        assert said[0][2].endswith("m apart; 2 m per step")


def test_the_sides_of_an_until_may_be_apart_because_of_a_wall() -> None:
    next_ = "drone[0]: west until[3 s, 10 s] near"
    assert found(f"require r: {next_}") == []
    ((code, _, figure),) = found(f"require r: {next_}", WALL)
    assert code is JUMP
    assert "around the obstacles; 2 m per step" in figure


def test_a_whole_is_dead_where_all_alternatives_are_and_one_is_warned_of_where_another_lives() -> None:
    jump, late = "(west until[3 s, 10 s] east)", "(eventually[0, 1 s] east)"
    (whole,) = found(f"require r: drone[0]: {jump} or {late}")
    assert whole[0] is JUMP
    (warned,) = found(f"require r: drone[0]: {jump} or (eventually[0, 9 s] east)")
    assert warned[0] is DEAD_BRANCH
    (late_one,) = found(f"require r: drone[0]: {late} or (eventually[0, 9 s] east)")
    assert late_one == (DEAD_BRANCH, "east", "4.4 m away, which takes 3 s at 2 m/s")


def test_an_alternative_that_is_too_late_at_first_only_is_not_dead() -> None:
    assert found("require r: drone[0]: always[0, 10 s] (west or near or yard)") == []
    assert found("require r: drone[0]: always[0, 10 s] ((eventually[0, 1 s] west) or (eventually[0, 1 s] east))") == []


def test_what_is_asked_over_links_is_left_open() -> None:
    graph, late = "graph radio = proximity 2 m", "(eventually[0, 1 s] east)"
    ((code, *_),) = found(f"require r: drone[0]: {late} or somewhere[hops 1..1 on radio] east", graph)
    assert code is DEAD_BRANCH
    assert found("require r: drone[0]: eventually[0, 1 s] somewhere[hops 0..1 on radio] drone", graph) == []


def test_a_preference_that_cannot_hold_is_warned_of() -> None:
    ((code, at, _),) = found("prefer p: drone[0]: eventually[0, 1 s] east weight 1")
    assert (code, at) == (DEAD_BRANCH, "east")


@pytest.mark.parametrize(
    ("formula", "expected"),
    [
        ("every drone: eventually[5 s, 9 s] always[0, 5 s] east", True),
        ("every drone: eventually[5 s, 9 s] always[0, 1 s] east", False),
        ("every drone: eventually[5 s, 9 s] always[0, 5 s] yard", False),
        ("drone[0]: always[16 s, end] pad", True),
        ("drone[0]: eventually[5 s, 20 s] always[0, end] pad", False),
        ("drone[0]: eventually[5 s, 6 s] (pad until[4 s, 5 s] yard)", True),
        ("drone[0]: eventually[5 s, 9 s] always[0, 1 s] (east or near)", False),
    ],
)
def test_a_stay_is_forbidden_by_a_lowest_speed_and_a_bounded_turn(formula: str, expected: bool) -> None:
    goal = f"require r: {formula}"
    assert bool(found(goal, agents=PLANES)) == expected
    assert not found(goal, agents=PLANES.replace("1.5..2", "0..2"))


def test_the_curve_is_told_from_the_straight_way() -> None:
    ((code, _, figure),) = found("require r: some drone: eventually[5 s, 9 s] always[0, 5 s] east", agents=PLANES)
    two = 1.5 * math.sin(2 * math.radians(20) / 2) / math.sin(math.radians(20) / 2)
    assert code is RESTLESS
    assert f"{two:.4f} m away after 2 steps" in figure


@pytest.mark.parametrize(
    ("formula", "expected"),
    [
        ("eventually[0, 20 s] at least 14 drone: pad", True),
        ("eventually[0, 20 s] at least 9 drone: pad", False),
        ("at least 20 drone: eventually[0, 20 s] pad", False),
        ("eventually[0, 20 s] every drone: pad", True),
        ("eventually[0, 20 s] every drone: (pad or east)", False),
        ("eventually[0, 20 s] ((at least 14 drone: pad) or (every drone: yard))", False),
        ("eventually[0, 20 s] not (at least 14 drone: pad)", False),
    ],
)
def test_more_agents_than_there_is_room_for_at_one_step(formula: str, expected: bool) -> None:
    said = found(f"require r: {formula}", agents=MANY)
    assert (CROWDED in {code for code, *_ in said}) == expected
    if expected:
        assert said[0][2] == "room for at most 13 agents, with centres 0.4 m apart"


def test_nine_bodies_that_fit_in_a_square_are_not_too_many() -> None:
    """Three times three, 0.4 m apart, take 0.8 m of the 1 m that there are; Oler's bound lets 13 in."""
    assert found("require r: eventually[0, 20 s] at least 9 drone: pad", agents=MANY) == []


@pytest.mark.parametrize(
    ("formation", "expected"),
    [
        ("line of drone spacing 4 m tolerance 0.1 m", True),
        ("line of drone spacing 2 m tolerance 0.1 m", False),
        ("line of drone spacing 2.45 m heading 90 deg tolerance 0.1 m", True),
        ("line of drone spacing 2.2 m heading 0 deg tolerance 0.1 m", False),
        ("circle of drone radius 8 m tolerance 0.1 m", True),
        ("chain of drone spacing 2.2 m tolerance 0.1 m", False),
        ("star of drone spacing 3 m tolerance 0.1 m", False),
        ("grid of drone spacing 1 m tolerance 0.1 m", False),
    ],
)
def test_a_formation_fits_nowhere(formation: str, expected: bool) -> None:
    items = (f"formation row = {formation}", "obstacle wall = box (0, 4.8) to (10, 5.2)")
    said = found("require r: eventually[0, 20 s] row", *items, agents=FIVE)
    assert bool(said) == expected
    assert all(code is NO_FIT for code, *_ in said)
    assert found("require r: eventually[0, 20 s] not row", *items, agents=FIVE) == []


GAP = ("obstacle left = box (0, 3.7) to (4.3, 7.3)", "obstacle right = box (5.7, 3.7) to (10, 7.3)")


@pytest.mark.parametrize(
    ("formula", "heading", "expected"),
    [
        ("row until[0, 20 s] every drone: top", "0 deg", True),
        ("row until[0, 20 s] every drone: top", "90 deg", False),
        ("(always[0, 20 s] row) and (drone[1]: eventually[0, 20 s] top)", "0 deg", True),
        ("(always[0, 10 s] row) and (drone[1]: eventually[0, 20 s] top)", "0 deg", False),
        ("(always[0, 20 s] row) or (drone[1]: eventually[0, 20 s] top)", "0 deg", False),
        ("(eventually[0, 20 s] row) and (drone[1]: eventually[0, 20 s] top)", "0 deg", False),
    ],
)
def test_a_formation_fits_through_no_passage(formula: str, heading: str, expected: bool) -> None:
    items = (f"formation row = line of drone spacing 1.3 m heading {heading} tolerance 0.05 m", *GAP)
    more = ("region low = box (0, 0) to (10, 3)", "region top = box (1, 8) to (9, 9.8)")
    agents = FIVE.replace("west", "low")
    said = found(f"require r: {formula}", *items, *more, agents=agents)
    assert [code for code, *_ in said if code is not DEAD_BRANCH] == ([STUCK] if expected else [])


# ----------------------------------------------------------------------- ways


def test_a_goal_is_too_far_round_the_obstacles_and_no_further_than_the_way_there() -> None:
    """From (2, 2) by (3, 9.1) and (3.2, 9.1) to (3.5, 2) it is 14.4 m, and the corner of a grown wall is cut."""
    ((code, at, figure),) = found("require r: drone[0]: eventually[0, 7 s] near", WALL)
    assert (code, at) == (TOO_FAR, "near")
    assert "round the obstacles, which takes 8 s" in figure
    assert found("require r: drone[0]: eventually[0, 8 s] near", WALL) == []


@pytest.mark.parametrize(("gap", "barred"), [(0.15, True), (0.21, False)])
def test_a_passage_is_too_narrow_for_a_body(gap: float, barred: bool) -> None:
    wall = (f"obstacle a = box (3, 0) to (3.2, {5 - gap / 2})", f"obstacle b = box (3, {5 + gap / 2}) to (3.2, 10)")
    said = found("require r: every drone: eventually[0, 20 s] east", *wall)
    assert [code for code, *_ in said] == ([BARRED] if barred else [])
    if barred:
        assert said[0][2] == "every path passes within 0.075 m of an obstacle; the radius is 0.1 m"


def test_a_finish_behind_a_wall_is_out_of_reach() -> None:
    agents = (
        "team drone[1] { radius 0.1 m  dynamics single_integrator(speed <= 0.5 m/s)  start at (1, 1) finish at (5, 1) }"
    )
    ((code, _, figure),) = found("require r: every drone: always[0, 20 s] yard", WALL, agents=agents)
    assert code is TOO_FAR
    assert "round the obstacles" in figure


def test_obstacles_that_move_or_grow_bar_no_way() -> None:
    goal = "require r: every drone: eventually[0, 20 s] east"
    assert found(goal, "obstacle wall = box (3, 0) to (3.2, 10) moving (0, 1) m/s") == []


SQUARE = shapely.box(4, -1, 6, 9)
WORLD = shapely.box(0, 0, 10, 10)


def test_a_geodesic_bends_at_corners_and_is_never_longer_than_a_way() -> None:
    here, there = shapely.Point(1, 1), shapely.Point(9, 1)
    exact = 2 * math.dist((1, 1), (4, 9)) + 2
    assert VisibilityGraph.of(SQUARE, WORLD).geodesic(here, there) == pytest.approx(exact)
    assert VisibilityGraph.of(SQUARE, WORLD).geodesic(here, there, exact - 0.1) == math.inf
    assert VisibilityGraph.of(SQUARE, WORLD).geodesic(here, there, exact + 3) >= exact - 1e-9
    grown = around(SQUARE, 0.5, WORLD).geodesic(here, there)
    assert exact < grown < 2 * (math.hypot(2.5, 8.5) + 0.5) + 3


def test_a_set_that_reaches_through_a_body_is_left_on_either_side() -> None:
    wide = shapely.box(1, 1, 7, 3)
    assert VisibilityGraph.of(SQUARE, WORLD).geodesic(wide, shapely.Point(9, 2)) == pytest.approx(2.0)


def test_the_widest_passage_is_measured_to_the_obstacles() -> None:
    walls = shapely.union(shapely.box(4, 0, 6, 4.8), shapely.box(4, 5.2, 6, 10))
    room = widest_passage(walls, 0.5, WORLD, shapely.Point(1, 1), shapely.Point(9, 1))
    assert room == pytest.approx(0.2, abs=1e-3)


def test_a_clear_way_is_found_round_a_wall_where_it_is_short_enough() -> None:
    ways = ClearWays(World((0.0, 0.0), (10.0, 10.0), None), (Box((4.0, 0.0), (6.0, 9.0)),), 0.2)  # type: ignore[arg-type]
    exact = 2 * math.dist((1, 1), (4, 9)) + 2
    assert ways.found([(1.0, 1.0)], [(9.0, 1.0)], 1.3 * exact)
    assert not ways.found([(1.0, 1.0)], [(9.0, 1.0)], exact - 0.1)
    assert not ways.found([(1.0, 1.0)], [(9.0, 1.0)], 1.3 * exact, winding=False)
    assert ways.found([(1.0, 1.0)], [(2.0, 9.5)], 10.0, winding=False)


PLANNED = sorted(path for path in (ROOT / "missions").rglob("*.mission") if not path.stem.startswith("impossible_"))


def test_no_mission_that_is_planned_is_called_impossible(subtests: pytest.Subtests) -> None:
    assert PLANNED
    for path in PLANNED:
        with subtests.test(path.stem):
            assert [each for each in check(path, backend="any").findings if each.code in IMPOSSIBLE] == []
