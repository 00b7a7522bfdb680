"""Which roadmaps are tried and when: shortest ways, samples, and samples in narrow passages."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra

from missionc.backends.smt.roadmap.roadmap import NoRoadmap, Roadmap, build_roadmaps
from missionc.backends.smt.roadmap.sequence import roadmaps_to_try
from missionc.base.source import Source
from missionc.compiler import driver
from missionc.compiler.results import Checked

WORLD = """
mission test
time  step 1 s, horizon 40 s
world (0, 0) to (20, 10)
region left  = box (0.5, 0.5) to (3, 9.5)
region right = box (17, 0.5) to (19.5, 9.5)
"""
ROBOT = "agent robot { radius 0.3 m  dynamics single_integrator(speed <= 1 m/s)  start at (2, 5) }\n"
CROSS = "require cross: robot: eventually[0, 40 s] right\n"


def checked(text: str) -> Checked:
    found = driver.check(Source("test.mission", text))
    assert found.mission is not None, [finding.message for finding in found.diagnostics]
    return found


def order(text: str) -> list[int]:
    """The nodes of the attempts; 0 of the shortest ways."""
    found = checked(text)
    assert found.mission is not None
    assert found.kernel is not None
    return [attempt.nodes for attempt in roadmaps_to_try(found.mission, found.kernel, 0)]


def geodesic(text: str) -> Roadmap:
    found = checked(text)
    assert found.mission is not None
    assert found.kernel is not None
    made = next(roadmaps_to_try(found.mission, found.kernel, 0)).build()
    assert not isinstance(made, NoRoadmap), made.statement
    return made[0]


def shortest(roadmap: Roadmap, low: float) -> float:
    """The length of the shortest way from the start to ``x >= low`` along the moves, metres."""
    source, target = roadmap.moves.T
    length = np.linalg.norm(roadmap.position[source] - roadmap.position[target], axis=1)
    count = len(roadmap.position)
    graph = coo_array((length, (source, target)), shape=(count, count)).tocsr()
    away = np.asarray(dijkstra(graph, indices=int(roadmap.starts[0][0])))
    return float(away[roadmap.position[:, 0] >= low].min())


def test_shortest_ways_come_before_samples() -> None:
    assert order(WORLD + ROBOT + CROSS) == [0, 110, 187, 318]


def test_nodes_that_are_said_are_what_is_sampled_and_nothing_else() -> None:
    assert order(WORLD + ROBOT + CROSS + "solve with smt { nodes = 110 }\n") == [110, 187, 318]


@pytest.mark.parametrize(
    "dynamics", ["unicycle(speed 0.5..1 m/s)", "double_integrator(speed <= 1 m/s, acceleration <= 1 m/s^2)"]
)
def test_who_cannot_stop_at_once_gets_samples_alone(dynamics: str) -> None:
    robot = ROBOT.replace("single_integrator(speed <= 1 m/s)", dynamics)
    assert order(WORLD + robot + CROSS) == [110, 187, 318]


def test_links_between_agents_ask_for_places_all_over_first() -> None:
    team = "team robot[2] { radius 0.3 m  dynamics single_integrator(speed <= 1 m/s)  start in left }\n"
    linked = "graph radio = proximity 4 m\nrequire link: always[0, 40 s] connected(radio)\n"
    assert order(WORLD + team + linked) == [110, 0, 187, 318]


def test_the_way_round_a_wall_is_nearly_the_shortest() -> None:
    text = WORLD + "obstacle wall = box (9.9, 0) to (10.1, 8)\n" + ROBOT + CROSS
    corners = [(2.0, 5.0), (9.6, 8.3), (10.4, 8.3), (17.0, 5.0)]  # of the wall, grown by the body: mitred
    bound = sum(math.dist(one, other) for one, other in pairwise(corners[:3]))
    bound += math.dist(corners[2], (17.0, 8.3))
    assert 0.97 * bound <= shortest(geodesic(text), 17.0) <= 1.06 * bound


def test_the_same_seed_gives_the_same_shortest_ways() -> None:
    text = WORLD + "obstacle pillar = disc at (10, 5) radius 2 m\n" + ROBOT + CROSS
    first, second = geodesic(text), geodesic(text)
    assert np.array_equal(first.position, second.position)
    assert np.array_equal(first.moves, second.moves)


def test_where_many_are_to_rest_there_is_a_place_for_each() -> None:
    team = (
        "team robot[24] { radius 0.3 m  dynamics single_integrator(speed <= 1 m/s)  start in left }\nseparation 0.1 m\n"
    )
    roadmap = geodesic(WORLD + team + "require rest: every robot: eventually[0, 38 s] always[0, 2 s] right\n")
    resting: list[np.ndarray] = []
    for place in roadmap.position[(roadmap.position >= (17.3, 0.8)).all(axis=1)]:
        if all(np.linalg.norm(place - other) > 0.7 for other in resting):
            resting.append(place)
    assert len(resting) >= 20  # the first that come to hand need not be those that go in together


def test_a_place_that_one_is_asked_to_be_in_is_no_place_to_rest_for_all() -> None:
    team = "team robot[24] { radius 0.3 m  dynamics single_integrator(speed <= 1 m/s)  start in left }\n"
    one, all_ = (
        geodesic(WORLD + team + f"require go: {who}: eventually[0, 40 s] right\n")
        for who in ("robot[3]", "every robot")
    )
    there = [int((roadmap.position[:, 0] > 17).sum()) for roadmap in (one, all_)]
    assert there[0] + 15 < there[1]


SHAFT = WORLD + "obstacle low  = box (6, 0) to (14, 4.65)\nobstacle high = box (6, 5.35) to (14, 10)\n" + ROBOT + CROSS
"""A passage of 0.7 m for a body of 0.6 m, 8 m long."""


def sampled(text: str, *, passages: bool) -> Roadmap:
    mission = checked(text).mission
    assert mission is not None
    made = build_roadmaps(mission, 60, 6, np.random.default_rng(0), passages=passages)
    assert not isinstance(made, NoRoadmap), made.statement
    return made[0]


def test_a_passage_just_wide_enough_is_covered() -> None:
    roadmap = sampled(SHAFT, passages=True)
    x, y = roadmap.position.T
    along = np.sort(x[(x > 6) & (x < 14) & (np.abs(y - 5) < 0.06)])
    assert len(along) > 5
    assert np.max(np.diff(along)) < 2.0
    assert math.isfinite(shortest(roadmap, 17.0))


def test_open_ground_gets_no_more_nodes_for_passages() -> None:
    plain, dense = (sampled(WORLD + ROBOT + CROSS, passages=some) for some in (False, True))
    assert np.array_equal(plain.position, dense.position)
