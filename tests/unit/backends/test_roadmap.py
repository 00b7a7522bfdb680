"""Which roadmaps a mission gets, where agents start and finish on them, and why there is none."""

from __future__ import annotations

import numpy as np
import pytest

from missionc.backends.smt.roadmap.roadmap import NoRoadmap, Roadmap, build_roadmaps
from missionc.base.limits import Limits
from missionc.base.source import Source
from missionc.frontend.resolve.resolve_mission import resolve
from missionc.frontend.syntax.parse import parse
from missionc.frontend.syntax.read_file import unread
from missionc.geometry.vectors import distinct
from missionc.ir import Mission
from missionc.ir.distances.signed_distance import signed_distance

HEAD = """
mission test
time  step 1 s, horizon 8 s
world (0, 0) to (10, 10)
region base = box (0.5, 0.5) to (3, 3)
region goal = disc at (8, 8) radius 0.6
"""
TAIL = """
require there: some robot: eventually[0, 8 s] goal
"""


def resolved(body: str) -> Mission:
    program, slips = parse(Source("test.mission", HEAD + body + TAIL), Limits(), unread)
    assert program is not None, slips
    mission, findings = resolve(program, {}, Limits())
    assert mission is not None, [finding.message for finding in findings]
    return mission


def outcome(body: str, nodes: int = 60) -> tuple[Roadmap, ...] | NoRoadmap:
    return build_roadmaps(resolved(body), nodes, 6, np.random.default_rng(0))


def built(body: str, nodes: int = 60) -> tuple[Roadmap, ...]:
    roadmaps = outcome(body, nodes)
    assert not isinstance(roadmaps, NoRoadmap), roadmaps.statement
    return roadmaps


FREE = "dynamics single_integrator(speed <= 2 m/s)"


def test_agents_alike_share_a_roadmap_and_others_have_their_own() -> None:
    roadmaps = built(
        f"team robot[3] {{ radius 0.1 m {FREE} start in base }}\n"
        "agent fast { radius 0.1 m dynamics unicycle(speed 1..3 m/s) start in base }\n"
        f"agent wide {{ radius 0.4 m {FREE} start in base }}\n"
        f"agent same {{ radius 0.1 m {FREE} start in goal }}\n"
    )
    assert [roadmap.agents for roadmap in roadmaps] == [(0, 1, 2, 5), (3,), (4,)]


def test_exact_places_are_states_and_the_only_start_and_finish() -> None:
    (roadmap,) = built(f"team robot[2] {{ radius 0.1 m {FREE} start at (1, 1), (2, 1) finish at (9, 9), (1, 1) }}")
    places = [roadmap.position[states].tolist() for states in (*roadmap.starts, *roadmap.finishes)]
    assert places == [[[1, 1]], [[2, 1]], [[9, 9]], [[1, 1]]]


def test_without_a_finish_every_state_may_be_the_last() -> None:
    (roadmap,) = built(f"team robot[2] {{ radius 0.1 m {FREE} start in base }}")
    assert roadmap.finishes[0].tolist() == list(range(len(roadmap.position)))


def test_a_finish_in_a_region_has_states_enough_for_all() -> None:
    (roadmap,) = built(f"team robot[5] {{ radius 0.1 m {FREE} start in base finish in goal }}")
    assert len(roadmap.finishes[0]) >= 9
    assert np.all(np.linalg.norm(roadmap.position[roadmap.finishes[0]] - [8, 8], axis=1) <= 0.6)


def test_a_region_that_is_nearly_full_still_takes_all_its_agents() -> None:
    mission = resolved(
        "separation 0.1 m\nregion cell = box (5, 5) to (5.91, 5.91)\n"
        f"team robot[16] {{ radius 0.1 m {FREE} start in cell }}"
    )
    roadmaps = build_roadmaps(mission, 60, 6, np.random.default_rng(0))
    assert not isinstance(roadmaps, NoRoadmap)
    places = roadmaps[0].position[roadmaps[0].starts[0]]
    x, y = np.round((places - 5) / 0.3, 3).T
    assert np.sum((x % 1 < 0.01) & (y % 1 < 0.01)) >= 16


def test_nodes_asked_for_are_the_states_where_every_edge_is_one_step() -> None:
    (roadmap,) = built("team robot[2] { radius 0.1 m dynamics unicycle(speed 1..2 m/s) start in base }", nodes=110)
    assert 110 <= len(roadmap.position) <= 116


def test_more_nodes_make_a_finer_roadmap() -> None:
    coarse, fine = (
        built("team robot[2] { radius 0.1 m dynamics unicycle(speed 1..2 m/s) start in base }", nodes=nodes)[0]
        for nodes in (60, 240)
    )
    assert len(fine.position) > 3 * len(coarse.position)
    assert len(fine.moves) > 3 * len(coarse.moves)


def test_steerable_neighbours_leave_no_node_alone_where_plain_nearest_ones_would() -> None:
    (roadmap,) = built("team robot[9] { radius 0.1 m dynamics unicycle(speed 1..2 m/s) start in base }", nodes=110)
    ways = np.bincount(roadmap.moves[:, 0], minlength=len(roadmap.position))
    assert ways.min() >= 2
    assert np.median(ways) >= 6


def test_a_narrow_passage_joins_two_rooms() -> None:
    walls = "obstacle low = box (4, 0) to (5, 4.8)\nobstacle high = box (4, 5.3) to (5, 10)\n"
    (roadmap,) = built(walls + f"team robot[2] {{ radius 0.1 m {FREE} start in base }}", nodes=60)
    assert np.any(roadmap.position[:, 0] > 5)
    assert (
        signed_distance(
            np, resolved(f"team robot[2] {{ {FREE} start in base }}").regions[1].shape, roadmap.position
        ).min()
        < 0
    )


def test_a_start_with_no_other_node_near_gets_stepping_stones() -> None:
    box = "\n".join(
        f"obstacle wall{number} = box {corners}"
        for number, corners in enumerate(
            ("(0, 4) to (4, 4.2)", "(0, 6) to (4, 6.2)", "(0, 4) to (0.2, 6.2)", "(3.8, 4) to (4, 6.2)")
        )
    )
    (roadmap, *_) = built(
        f"{box}\nagent robot {{ radius 0.1 m dynamics unicycle(speed 1..1.2 m/s) start at (2, 5) }}", nodes=8
    )
    assert len(roadmap.moves) >= 2


def test_a_region_that_an_obstacle_fills_has_no_free_place() -> None:
    result = outcome(f"obstacle rock = box (0.4, 0.4) to (3.1, 3.1)\nteam robot[2] {{ {FREE} start in base }}")
    assert isinstance(result, NoRoadmap)
    assert result.statement == "no free position for `robot[0]` in `base`"


def test_a_region_that_a_moving_obstacle_fills_at_the_start_has_no_free_place_then() -> None:
    truck = "obstacle truck = box (0.4, 0.4) to (3.1, 3.1) moving (1, 0) m/s\n"
    result = outcome(truck + f"team robot[2] {{ {FREE} start in base }}")
    assert isinstance(result, NoRoadmap)
    (roadmap,) = built(truck + f"team robot[2] {{ {FREE} start at (5, 5), (5, 6) finish in base }}")
    assert len(roadmap.finishes[0]) >= 6


def test_a_start_too_near_an_obstacle_is_named_with_the_distance_it_needs() -> None:
    result = outcome(
        "clearance 0.2 m\nobstacle rock = disc at (5, 5) radius 1\n"
        f"agent robot {{ radius 0.1 m {FREE} start at (5, 6.2) }}"
    )
    assert isinstance(result, NoRoadmap)
    assert result.statement == (
        "`robot` starts at (5, 6.2), which is outside the world or less than 0.3 m from an obstacle"
    )


def test_a_start_that_just_touches_an_obstacle_is_free() -> None:
    (roadmap,) = built(
        f"obstacle rock = box (4, 4) to (5, 5)\nagent robot {{ radius 0.1 m {FREE} start at (5.1, 4.5) }}"
    )
    assert roadmap.position[roadmap.starts[0]].tolist() == [[5.1, 4.5]]


def test_a_start_without_a_way_out_is_named() -> None:
    cage = "obstacle cage = box (4, 4) to (6, 6) - box (4.5, 4.5) to (5.5, 5.5)\n"
    result = outcome(cage + "agent robot { radius 0.1 m dynamics unicycle(speed 2..3 m/s) start at (5, 5) }")
    assert isinstance(result, NoRoadmap)
    assert result.statement == "no path from (5, 5) for `robot`"


def test_a_finish_without_a_way_in_is_named() -> None:
    cage = "obstacle cage = box (7, 7) to (9, 9) - box (7.2, 7.2) to (8.8, 8.8)\n"
    result = outcome(cage + f"team robot[2] {{ radius 0.1 m {FREE} start in base finish in goal }}")
    assert isinstance(result, NoRoadmap)
    assert result.statement == "no path to `goal` for `robot[0]`"


@pytest.mark.parametrize("dynamics", ["unicycle(speed 1..2 m/s)", "single_integrator(speed <= 1 m/s)"])
def test_a_world_without_moving_obstacles_is_open_all_the_time(dynamics: str) -> None:
    (roadmap,) = built(f"team robot[2] {{ dynamics {dynamics} start in base }}")
    assert roadmap.standing.all()
    assert roadmap.standing.shape == (9, len(roadmap.position))
    assert roadmap.allowed.all()
    assert roadmap.allowed.shape == (8, len(roadmap.moves))


def test_without_any_node_asked_for_places_and_regions_have_theirs() -> None:
    (roadmap,) = built(f"team robot[2] {{ radius 0.1 m {FREE} start in base }}", nodes=0)
    assert 6 <= len(np.unique(roadmap.position, axis=0)) < 40


@pytest.mark.parametrize(
    "shape",
    [
        "disc at (6, 2) radius 0.05",
        "box (9.5, 0.2) to (9.9, 9.8)",
        "box (5, 5) to (6, 6) - disc at (5.5, 5.5) radius 0.45",
        "polygon (9, 9), (9.6, 9.9), (9.9, 9.7)",
        "disc at (0.4, 9.6) radius 0.2 + disc at (9.6, 9.6) radius 0.2",
    ],
)
@pytest.mark.parametrize("dynamics", [FREE, "dynamics unicycle(speed 1..2 m/s)"])
def test_a_region_named_in_a_requirement_has_a_state_however_small_it_is(shape: str, dynamics: str) -> None:
    body = f"region spot = {shape}\nteam robot[2] {{ radius 0.1 m {dynamics} start in base }}\n"
    body += "require spot: some robot: eventually[0, 8 s] spot"
    mission = resolved(body)
    spot = next(region for region in mission.regions if region.name == "spot")
    for nodes in (0, 60):
        roadmaps = build_roadmaps(mission, nodes, 6, np.random.default_rng(1))
        assert not isinstance(roadmaps, NoRoadmap), roadmaps.statement
        assert signed_distance(np, spot.shape, roadmaps[0].position).min() <= 0


@pytest.mark.parametrize("kind", [np.float64, np.int64, np.uint8])
def test_rows_are_told_apart_as_numpy_does(kind: type[np.generic]) -> None:
    rows = np.random.default_rng(1).integers(0, 3, size=(200, 3)).astype(kind)
    found, first, kinds = np.unique(rows, axis=0, return_index=True, return_inverse=True)
    own_first, own_kinds = distinct(rows)
    assert np.array_equal(own_first, first)
    assert np.array_equal(own_kinds, kinds.reshape(-1))
    assert np.array_equal(rows[own_first], found)
    assert distinct(rows[:0])[0].size == 0
