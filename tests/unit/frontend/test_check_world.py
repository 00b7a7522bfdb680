"""Starts, regions, graphs, formations and goals that cannot be meant in their world."""

from __future__ import annotations

import pytest

from missionc.base.diagnostics.code import (
    AGENTS_OVERLAP,
    FORMATION_TOO_SMALL,
    FORMATION_TOO_TIGHT,
    GRAPH_TOO_SMALL,
    IN_OBSTACLE,
    NO_AREA,
    NO_ROOM,
    OUTSIDE_WORLD,
    REGION_IN_OBSTACLE,
    REGION_OUTSIDE_WORLD,
    SIGHT_PAST_MOTION,
    TOO_FAR,
    Code,
)
from tests.support.check_findings import found, only, text, words

SAFE = "require safe: every drone: always[1 s, 20 s] not fire"
SHELF = "obstacle shelf = box (4, 1) to (5, 2)"
WORLD_CODES = (
    OUTSIDE_WORLD, IN_OBSTACLE, AGENTS_OVERLAP, REGION_OUTSIDE_WORLD, REGION_IN_OBSTACLE, GRAPH_TOO_SMALL,
    SIGHT_PAST_MOTION, FORMATION_TOO_SMALL, FORMATION_TOO_TIGHT, TOO_FAR, NO_ROOM, NO_AREA,
)  # fmt: skip


def drones(count: int, places: str, *, speed: float = 2, radius: float = 0.1) -> str:
    return f"team drone[{count}] {{ radius {radius} m  dynamics single_integrator(speed <= {speed} m/s)  {places} }}"


# --------------------------------------------------------- starts and finishes


def test_a_start_outside_the_world_is_refused() -> None:
    finding = only(text(SAFE, agents=drones(2, "start at (1, 1), (11, 2)")), OUTSIDE_WORLD)
    assert finding.message == "`drone[1]` starts at (11, 2), outside the world"
    assert words(finding)[0] == ("(11, 2)", "")


def test_a_finish_outside_the_world_is_refused() -> None:
    finding = only(text(SAFE, agents=drones(1, "start in base finish at (5, -1)")), OUTSIDE_WORLD)
    assert finding.message == "`drone[0]` finishes at (5, -1), outside the world"


def test_a_start_on_the_border_of_the_world_is_accepted() -> None:
    assert found(text(SAFE, agents=drones(1, "start at (0, 10)")), OUTSIDE_WORLD) == []


def test_places_on_one_line_are_reported_together() -> None:
    finding = only(text(SAFE, agents=drones(5, "start line (8, 2) to (12, 2)")), OUTSIDE_WORLD)
    assert finding.message.startswith("`drone[3]` starts at (11, 2)")
    assert finding.notes == ("also `drone[4]`",)


def test_a_start_in_an_obstacle_is_refused() -> None:
    finding = only(text(SHELF, SAFE, agents=drones(1, "start at (4.5, 1.5)")), IN_OBSTACLE)
    assert finding.message == "`drone[0]` starts in obstacle `shelf`"
    assert ("shelf", "this obstacle") in words(finding)


def test_radius_and_clearance_keep_a_start_from_an_obstacle() -> None:
    near = text(SHELF, "clearance 0.2 m", SAFE, agents=drones(1, "start at (3.8, 1.5)"))
    finding = only(near, IN_OBSTACLE)
    assert finding.message == "`drone[0]` starts 0.2 m from obstacle `shelf`; its radius and the clearance need 0.3 m"
    assert finding.help == "move the agent at least 0.1 m away from the obstacle"
    assert found(near.replace("(3.8, 1.5)", "(3.69, 1.5)"), IN_OBSTACLE) == []


def test_a_moving_obstacle_counts_where_it_is_then() -> None:
    truck = "obstacle truck = disc at (1, 9) radius 0.5 moving (0.4, 0) m/s"
    start = text(truck, SAFE, agents=drones(1, "start at (1, 9) finish at (1, 9)"))
    assert only(start, IN_OBSTACLE).message == "`drone[0]` starts in obstacle `truck`"
    finish = text(truck, SAFE, agents=drones(1, "start at (9, 9) finish at (9, 9)"))
    finding = only(finish, IN_OBSTACLE)
    assert finding.message == "`drone[0]` finishes in obstacle `truck`"
    assert ("truck", "this obstacle, which has moved there by 20 s") in words(finding)


def test_an_obstacle_that_grows_counts_as_large_as_it_is_then() -> None:
    crowd = "obstacle crowd = disc at (5, 5) radius 0.5 uncertain 0.1 m/s"
    assert found(text(crowd, SAFE, agents=drones(1, "start at (5, 6)")), IN_OBSTACLE) == []
    finish = text(crowd, SAFE, agents=drones(1, "start at (1, 1) finish at (5, 6)"))
    finding = only(finish, IN_OBSTACLE)
    assert finding.message == "`drone[0]` finishes in obstacle `crowd`"
    assert ("crowd", "this obstacle, which has grown by 2 m by 20 s") in words(finding)
    near = text(crowd, SAFE, agents=drones(1, "start at (1, 1) finish at (5, 7.55)"))
    assert only(near, IN_OBSTACLE).message.startswith("`drone[0]` finishes 0.05 m from obstacle `crowd`")
    assert found(near.replace("7.55", "7.7"), IN_OBSTACLE) == []


def test_two_agents_that_start_closer_than_their_bodies_and_separation_are_refused() -> None:
    crowded = text("separation 0.3 m", SAFE, agents=drones(2, "start at (1, 1), (1.4, 1)"))
    finding = only(crowded, AGENTS_OVERLAP)
    assert finding.message == "`drone[0]` and `drone[1]` start 0.4 m apart"
    assert finding.notes == ("the radii and the separation need 0.5 m",)
    assert found(crowded.replace("(1.4, 1)", "(1.51, 1)"), AGENTS_OVERLAP) == []


def test_agents_that_touch_are_too_close() -> None:
    assert found(text(SAFE, agents=drones(2, "start at (1, 1), (1.25, 1)", radius=0.125)), AGENTS_OVERLAP)


def test_a_crowded_line_is_one_finding() -> None:
    finding = only(text(SAFE, agents=drones(6, "start line (1, 1) to (1.5, 1)")), AGENTS_OVERLAP)
    assert finding.message == "`drone[0]` and `drone[1]` start 0.1 m apart"
    assert finding.notes[1].endswith("more pairs of agents are too close")


def test_ten_thousand_agents_at_one_point_are_one_finding() -> None:
    finding = only(text(SAFE, agents=drones(9_999, "start line (1, 1) to (1, 1)")), AGENTS_OVERLAP)
    assert "at the same point" in finding.message


def test_a_region_without_a_free_place_has_no_room_for_a_start() -> None:
    region = "region bay = box (3.95, 1.2) to (4.5, 1.8)"
    finding = only(text(SHELF, region, SAFE, agents=drones(2, "start in bay")), NO_ROOM)
    assert finding.message == "no free position in `bay` for the start of `drone[0]`"
    assert finding.notes == ("also `drone[1]`",)


def test_a_region_with_a_sliver_of_room_is_accepted() -> None:
    region = "region bay = box (3.85, 1.2) to (4.5, 1.8)"
    assert found(text(SHELF, region, SAFE, agents=drones(2, "start in bay")), NO_ROOM) == []


def test_a_region_smaller_than_the_bodies_that_start_in_it_is_refused() -> None:
    region = "region pad = box (1, 1) to (2, 2)"
    finding = only(text(region, SAFE, agents=drones(60, "start in pad")), NO_ROOM)
    assert finding.message == "60 agents start in `pad`, which has room for at most 45 agents"
    assert found(text(region, SAFE, agents=drones(20, "start in pad")), NO_ROOM) == []


# --------------------------------------------------------------------- regions


def test_a_region_outside_the_world_is_refused() -> None:
    mission = text("region moon = disc at (20, 20) radius 1 m", "require r: every drone: always[1 s, 20 s] not moon")
    finding = only(mission, REGION_OUTSIDE_WORLD)
    assert finding.message == "region `moon` lies outside the world"


def test_a_region_partly_outside_the_world_is_accepted() -> None:
    mission = text("region rim = disc at (10, 10) radius 1 m", "require r: every drone: always[1 s, 20 s] not rim")
    assert found(mission, REGION_OUTSIDE_WORLD) == []


def test_a_region_inside_an_obstacle_is_refused() -> None:
    region = "region nook = disc at (4.5, 1.5) radius 0.2 m"
    finding = only(text(SHELF, region, "require r: every drone: always[1 s, 20 s] not nook"), REGION_IN_OBSTACLE)
    assert finding.message == "region `nook` lies inside obstacle `shelf`"


def test_a_region_of_the_same_shape_as_an_obstacle_is_inside_it() -> None:
    mission = text(
        "obstacle rock = disc at (5, 2) radius 1.3 m",
        "region stone = rock",
        "require r: every drone: always[1 s, 20 s] not stone",
    )
    assert only(mission, REGION_IN_OBSTACLE).message == "region `stone` lies inside obstacle `rock`"
    assert found(mission.replace("= rock", "= disc at (5, 2) radius 1.35 m"), REGION_IN_OBSTACLE) == []


def test_a_region_that_is_only_measured_or_a_shape_may_be_where_nobody_can_be() -> None:
    mission = text(
        "region nook = box (4.2, 1.2) to (4.8, 1.8)",
        "obstacle post = nook",
        "region mast = box (12, 1) to (13, 2)",
        SHELF,
        "require r: every drone: always[1 s, 20 s] (distance(nook) >= 0.2 and distance(mast) >= 2.5)",
    )
    assert found(mission, REGION_IN_OBSTACLE) == found(mission, REGION_OUTSIDE_WORLD) == []
    entered = mission + "require s: every drone: always[1 s, 20 s] not (touches(nook) or mast)\n"
    assert len(found(entered, REGION_IN_OBSTACLE)) == len(found(entered, REGION_OUTSIDE_WORLD)) == 1


@pytest.mark.parametrize(
    ("asked", "refused"),
    [
        ("some drone: eventually[0, 20 s] (nook or x >= 8)", False),
        ("every drone: eventually[0, 20 s] nook or eventually[0, 20 s] x >= 8", False),
        ("some drone: eventually[0, 20 s] nook", True),
        ("every drone: always[0, 20 s] (x >= 8 or not nook)", True),
    ],
)
def test_a_region_in_an_obstacle_is_accepted_where_another_alternative_does_without_it(
    asked: str, refused: bool
) -> None:
    mission = text(SHELF, "region nook = disc at (4.5, 1.5) radius 0.2 m", f"require r: {asked}")
    assert bool(found(mission, REGION_IN_OBSTACLE)) == refused


def test_a_region_that_two_obstacles_cover_together_is_refused() -> None:
    more = "obstacle crate = box (4, 2) to (5, 3)"
    region = "region nook = box (4.2, 1.5) to (4.8, 2.5)"
    finding = only(text(SHELF, more, region, "require r: every drone: always[1 s, 20 s] not nook"), REGION_IN_OBSTACLE)
    assert finding.message == "region `nook` lies inside obstacles `shelf` and `crate`"


def test_a_region_around_an_obstacle_is_accepted() -> None:
    region = "region apron = box (3.9, 0.9) to (5.1, 2.1)"
    assert found(text(SHELF, region, "require r: every drone: always[1 s, 20 s] not apron"), REGION_IN_OBSTACLE) == []


def test_a_combined_region_that_is_empty_is_refused() -> None:
    mission = text("region both = base * goal", "require r: every drone: always[1 s, 20 s] not both")
    assert only(mission, NO_AREA).message == "region `both` is empty"


# -------------------------------------------------------- graphs and formations


def test_a_graph_over_one_agent_is_refused() -> None:
    mission = text("graph lone = proximity 1 m over drone[0]", "require r: always[1 s, 20 s] connected(lone)")
    assert only(mission, GRAPH_TOO_SMALL).message == "graph `lone` has one agent; a link needs two"


def test_a_sight_past_an_obstacle_that_moves_is_refused_and_any_other_graph_is_not() -> None:
    truck = "obstacle truck = disc at (5, 5) radius 0.3 m moving (0.1, 0) m/s"
    asked = "require r: always[1 s, 20 s] connected(eyes)"
    finding = only(text(SHELF, truck, "graph eyes = sight 5 m", asked), SIGHT_PAST_MOTION)
    assert finding.message == "obstacles of the sight graph `eyes` change: `truck` moves"
    assert found(text(SHELF, truck, "graph eyes = proximity 5 m", asked), SIGHT_PAST_MOTION) == []


def test_a_sight_past_an_obstacle_that_grows_is_refused() -> None:
    asked = "require watch: always[0, 20 s] connected(eyes)"
    crowd = "obstacle crowd = disc at (5, 5) radius 1 m uncertain 0.1 m/s"
    finding = only(text(SHELF, crowd, "graph eyes = sight 5 m", asked), SIGHT_PAST_MOTION)
    assert finding.message == "obstacles of the sight graph `eyes` change: `crowd` grows"
    assert found(text(SHELF, "graph eyes = sight 5 m", asked), SIGHT_PAST_MOTION) == []


def test_a_formation_of_one_agent_is_refused() -> None:
    formation = "formation row = line of drone[0] spacing 1 m tolerance 0.1 m"
    mission = text(formation, "require r: eventually[1 s, 20 s] row")
    assert only(mission, FORMATION_TOO_SMALL).message == "formation `row` has one agent; it needs two"


def test_a_formation_that_its_own_separation_forbids_is_refused() -> None:
    formation = "formation row = chain of drone spacing 0.5 m tolerance 0.1 m"
    mission = text("separation 0.5 m", formation, "require r: eventually[1 s, 20 s] row")
    finding = only(mission, FORMATION_TOO_TIGHT)
    assert finding.message == "formation `row` requires `drone[0]` and `drone[1]` within 0.6 m"
    assert finding.notes[0].endswith("need 0.7 m")
    assert found(mission.replace("spacing 0.5 m", "spacing 0.61 m"), FORMATION_TOO_TIGHT) == []


def test_two_offsets_too_near_to_each_other_are_refused() -> None:
    formation = "formation wedge = offsets of drone (0, 0), (2, 0), (2.1, 0) tolerance 0.01 m"
    mission = text(formation, "require r: eventually[1 s, 20 s] wedge")
    finding = only(mission, FORMATION_TOO_TIGHT)
    assert finding.message == "formation `wedge` requires `drone[1]` and `drone[2]` within 0.12 m"


# ----------------------------------------------------------------------- goals


def test_a_finish_too_far_for_the_time_is_refused() -> None:
    mission = text(SAFE, agents=drones(2, "start at (1, 1), (2, 1) finish at (9, 9), (2, 2)", speed=0.1))
    finding = only(mission, TOO_FAR)
    assert finding.message == "`drone[0]` cannot reach its finish by 20 s"
    assert words(finding) == [
        ("(9, 9)", "11.3137 m away, which takes 114 s at 0.1 m/s"),
        ("(1, 1)", "path starts here"),
    ]


def test_a_finish_exactly_within_reach_is_accepted() -> None:
    assert found(text(SAFE, agents=drones(1, "start at (1, 1) finish at (9, 1)", speed=0.4)), TOO_FAR) == []


def test_a_finish_region_too_far_from_a_start_region_is_refused() -> None:
    mission = text(SAFE, agents=drones(2, "start in base finish in goal", speed=0.2))
    finding = only(mission, TOO_FAR)
    assert finding.message == "`drone[0]` cannot reach its finish by 20 s"
    assert finding.notes == ("also `drone[1]`",)


def test_a_region_out_of_reach_by_the_end_of_its_window_is_refused() -> None:
    mission = text("require r: every drone: eventually[0, 2 s] goal")
    finding = only(mission, TOO_FAR)
    assert finding.message == "`drone[0]` cannot be in `goal` by 2 s"
    assert words(finding)[0] == ("goal", "5.6569 m away, which takes 3 s at 2 m/s")
    assert found(mission.replace("2 s] goal", "3 s] goal"), TOO_FAR) == []


@pytest.mark.parametrize(
    "requirement",
    [
        "every drone: always[2 s, 9 s] goal",
        "drone[0]: base until[0, 2 s] goal",
        "every drone: eventually[0, 2 s] always[0, 3 s] goal",
        "some drone: (not fire) until[0, 2 s] (goal and not fire)",
        "every drone: eventually[0, 2 s] inside(goal)",
        "every drone: eventually[0, 2 s] touches(goal)",
        "every drone: eventually[0, 2 s] distance(goal) <= 0.5 m",
        "every drone: eventually[0, 2 s] x + y >= 13",
        "not some drone: always[0, 2 s] not goal",
    ],
)
def test_a_goal_is_found_out_of_reach_through_every_operator_that_asks_for_it(requirement: str) -> None:
    reachable = "team drone[3] { dynamics single_integrator(speed <= 1 m/s)  start in base }"
    assert found(text(f"require r: {requirement}", agents=reachable), TOO_FAR)


@pytest.mark.parametrize(
    "requirement",
    [
        "every drone: eventually[0, 2 s] (goal or base)",
        "every drone: always[0, 2 s] (fire implies goal)",
        "every drone: always[0, 2 s] not goal",
        "every drone: base release[0, 2 s] (base or goal)",
        "(every drone: eventually[0, 2 s] goal) or (every drone: eventually[0, 20 s] goal)",
        "every drone: eventually[0, 2 s] distance(goal) <= 4.7 m",
    ],
)
def test_nothing_is_out_of_reach_where_another_way_is_left(requirement: str) -> None:
    slow = "team drone[3] { dynamics single_integrator(speed <= 1 m/s)  start in base }"
    assert found(text(f"require r: {requirement}", agents=slow), TOO_FAR) == []


def test_so_many_of_the_agents_as_are_asked_for_have_to_be_near_enough() -> None:
    agents = drones(3, "start at (6, 6), (1, 1), (1.5, 1.5)")
    assert found(text("require r: some drone: eventually[0, 3 s] goal", agents=agents), TOO_FAR) == []
    finding = only(text("require r: at least 2 drone: eventually[0, 3 s] goal", agents=agents), TOO_FAR)
    assert finding.message == "only 1 of the 3 agents of `drone` can be in `goal` by 3 s"
    far = agents.replace("(6, 6)", "(2, 2)")
    finding = only(text("require r: some drone: eventually[0, 1 s] goal", agents=far), TOO_FAR)
    assert finding.message == "no agent of `drone` can be in `goal` by 1 s"
    assert finding.notes == ("`drone[0]` is the nearest",)


# -------------------------------------------------------------------- volumes


VOLUME = """mission cave
world (0, 0, 0) to (6, 6, 3)
region start = box (0, 0, 0) to (1, 1, 1)
region high  = disc at (3, 3) radius 0.4 height 2..2.5
region low   = disc at (3, 3) radius 0.4 height 0..1
region pearl = ball at (5, 5, 1.5) radius 0.3
"""


@pytest.mark.parametrize(
    ("extra", "code"),
    [
        ("obstacle crate = box (2, 2, 0) to (4, 4, 1)", REGION_IN_OBSTACLE),
        ("obstacle shell = ball at (5, 5, 1.5) radius 0.5", REGION_IN_OBSTACLE),
        ("region above = ball at (3, 3, 5) radius 1", REGION_OUTSIDE_WORLD),
        ("region none  = high * low", NO_AREA),
    ],
)
def test_regions_are_checked_in_a_volume(extra: str, code: Code) -> None:
    uses = "above" if "above" in extra else "none" if "none" in extra else "low"
    avoid = f"require r: every drone: always[1 s, 20 s] not {uses}"
    visit = "require q: some drone: (eventually[0, 20 s] high) and eventually[0, 20 s] pearl"
    assert found(text(extra, avoid, visit, world=VOLUME, agents=drones(2, "start in start")), code)


def test_what_is_beside_or_above_an_obstacle_in_a_volume_is_accepted() -> None:
    crate = "obstacle crate = box (2, 2, 0) to (4, 4, 0.9)"
    goal = "require r: some drone: eventually[0, 20 s] (high or low or pearl)"
    mission = text(crate, goal, world=VOLUME, agents=drones(2, "start at (3, 3, 1.1), (1, 1, 1) finish in low"))
    assert all(found(mission, code) == [] for code in WORLD_CODES)


def test_distances_in_a_volume_are_measured_in_three_axes() -> None:
    agents = drones(1, "start at (3, 3, 0.5) finish at (3, 3, 2.5)", speed=0.1)
    goal = "require r: some drone: eventually[0, 14 s] high"
    assert [finding.message for finding in found(text(goal, world=VOLUME, agents=agents), TOO_FAR)] == [
        "`drone[0]` cannot be in `high` by 14 s",
    ]
