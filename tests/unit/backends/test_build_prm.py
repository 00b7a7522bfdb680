"""Algorithm 1 of [strel] as printed, and what a mission may say of it."""

from __future__ import annotations

import numpy as np
import pytest

from missionc.backends.smt.paper.build_prm import build_prms
from missionc.backends.smt.roadmap.roadmap import Roadmap
from missionc.backends.smt.roadmap.sample_nodes import NoRoadmap
from missionc.backends.smt.settings import SmtSettings
from missionc.ir.distances.signed_distance import signed_distance
from tests.support.resolved_missions import demo, mission

HALL = demo(
    things="region base = box (0.5, 0.5) to (3, 3)\nregion goal = box (7, 7) to (9, 9)\n"
    "obstacle wall = box (4, 2) to (5, 8)",
    team="team drone[2] { radius 0.1 m  dynamics unicycle(speed 1..2 m/s)  start in base }",
)

SETTINGS = SmtSettings()
STARTS = SETTINGS.paper.start_samples


def prms_of(text: str, seed: int = 0) -> tuple[Roadmap, ...]:
    built = build_prms(mission(text), np.random.default_rng(seed))
    assert not isinstance(built, NoRoadmap)
    return built


def test_each_agent_has_a_roadmap_of_its_own_with_its_start_set_sampled_in() -> None:
    one, other = prms_of(HALL)
    assert len(one.nodes) == len(other.nodes) == SETTINGS.roadmap.nodes + STARTS
    assert not np.array_equal(one.nodes.position, other.nodes.position)
    base = mission(HALL).regions[0].shape
    inside = np.asarray(signed_distance(np, base, one.nodes.position)) <= 0
    assert inside[:STARTS].all()
    assert np.array_equal(one.starts[0], np.flatnonzero(inside))


def test_nodes_and_neighbors_of_a_mission_are_p_and_k() -> None:
    (one, _) = prms_of(f"{HALL}\nsolve with smt {{ nodes = 40, neighbors = 3 }}")
    assert len(one.nodes) == 40 + STARTS
    assert np.bincount(one.edges.source).max() <= 3


def test_an_edge_leads_to_one_of_the_nearest_and_no_steerable_one_of_these_is_left_out() -> None:
    for prm in prms_of(HALL):
        position = prm.nodes.position
        distance = np.linalg.norm(position[:, None] - position[None], axis=-1)
        for node in range(len(position)):
            nearest = set(np.argsort(distance[node])[1 : SETTINGS.paper.neighbors + 1].tolist())
            found = set(prm.edges.target[prm.edges.source == node].tolist())
            assert found <= nearest
            in_the_open = {
                to for to in nearest if max(position[[node, to], 0]) < 3.8 or min(position[[node, to], 0]) > 5.2
            }
            assert {to for to in in_the_open if distance[node, to] >= 1} <= found


def test_transitions_take_one_step_keep_to_the_speeds_and_miss_the_obstacle_and_their_states_are_in_s() -> None:
    for prm in prms_of(HALL):
        assert len(prm.position) == len(prm.nodes) + (prm.edges.count - 1).sum()
        source, target = (prm.position[prm.moves[:, end]] for end in (0, 1))
        length = np.linalg.norm(target - source, axis=1)
        assert ((length >= 1 - 1e-9) & (length <= 2 + 1e-9)).all()
        points = source + np.linspace(0, 1, 21)[:, None, None] * (target - source)
        wall = mission(HALL).obstacles[0].shape
        assert np.asarray(signed_distance(np, wall, points.reshape(-1, 2))).min() >= 0.1 - 1e-6


def test_an_agent_that_may_stand_still_may_do_so_in_each_state() -> None:
    prm = prms_of(demo())[0]
    waits = prm.moves[prm.moves[:, 0] == prm.moves[:, 1], 0]
    assert np.array_equal(np.sort(waits), np.arange(len(prm.position)))
    assert prm.starts[0].tolist() == [0]
    assert prm.position[0].tolist() == [1.0, 1.0]


@pytest.mark.parametrize("start", ["start at (4.5, 5), (1, 1)", "start in wall_inside"])
def test_a_start_without_free_room_leaves_no_roadmap(start: str) -> None:
    text = demo(
        things="region goal = box (7, 7) to (9, 9)\nregion wall_inside = box (4.2, 4) to (4.8, 6)\n"
        "obstacle wall = box (4, 2) to (5, 8)",
        team=f"team drone[2] {{ radius 0.1 m  dynamics single_integrator(speed <= 2 m/s)  {start} }}",
    )
    built = build_prms(mission(text), np.random.default_rng(0))
    assert isinstance(built, NoRoadmap)
    assert "the start of `drone[0]`" in built.statement
