"""Who comes too near whom, at the steps and between them, and that what is forbidden then is that and no more."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from missionc import ir
from missionc.backends.smt.refine.lazy_constraints import CUSHION, JointMotion, Separation, too_near
from missionc.backends.smt.roadmap.roadmap import Roadmap
from missionc.backends.smt.sat.solve import Satisfiable, Unsatisfiable
from missionc.base.units import Metres
from tests.support.legal_plans import mission_of
from tests.support.small_roadmaps import Asked, asked, roadmap_of

SQUARE = [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)]
FAST = ir.SingleIntegrator(9.0)


def on(places: list[tuple[float, float]], agents: int, steps: int, radius: float = 0.1) -> Asked:
    """Agents that must keep 0.1 m between them, and may go from each place to each."""
    mission = mission_of([places[0]] * agents, steps, radius=radius, separation=0.1, dynamics=FAST)
    return asked(mission, (roadmap_of(tuple(range(agents)), places, steps),))


def near(case: Asked, states: list[list[int]]) -> list[tuple[int, int, int]]:
    agents = np.arange(len(states))
    found = too_near(np.array(states), agents, case.motion, case.mission)
    return list(zip(found.first.tolist(), found.second.tolist(), found.step.tolist(), strict=True))


def test_agents_that_change_places_meet_between_the_steps() -> None:
    assert near(on(SQUARE, 2, 1), [[0, 1], [1, 0]]) == [(0, 1, 0)]


def test_agents_whose_ways_cross_at_the_same_time_meet() -> None:
    assert near(on(SQUARE, 2, 2), [[0, 3, 3], [1, 2, 2]]) == [(0, 1, 0)]


def test_agents_whose_ways_cross_at_different_times_do_not_meet() -> None:
    assert near(on(SQUARE, 2, 3), [[0, 3, 3, 3], [1, 1, 1, 1]]) == []


def test_one_that_flies_past_another_that_waits_beside_its_way_meets_it_between_the_steps() -> None:
    places = [(0.0, 0.0), (1.0, 0.0), (0.5, 0.25)]
    assert near(on(places, 2, 1), [[0, 1], [2, 2]]) == [(0, 1, 0)]


@pytest.mark.parametrize(("gap", "met"), [(0.29, True), (0.3, True), (0.3 + 3 * CUSHION, False)])
def test_agents_side_by_side_keep_a_hair_more_than_they_must(gap: float, met: bool) -> None:
    places = [(0.0, 0.0), (1.0, 0.0), (0.0, gap), (1.0, gap)]
    assert bool(near(on(places, 2, 1), [[0, 1], [2, 3]])) is met


def test_bodies_of_two_sizes_keep_the_sum_of_their_radii() -> None:
    mission = mission_of([SQUARE[0]] * 2, 0, radius=0.1, separation=0.0)
    wide = replace(mission.agents[1], radius=Metres(0.95))
    mission = replace(mission, agents=(mission.agents[0], wide))
    case = asked(mission, (roadmap_of((0,), SQUARE, 0), roadmap_of((1,), SQUARE, 0)))
    assert near(case, [[0], [1]]) == [(0, 1, 0)]
    assert near(case, [[0], [3]]) == []


def test_a_mission_of_one_step_has_collisions_at_that_step() -> None:
    places = [(0.0, 0.0), (0.2, 0.0), (1.0, 0.0)]
    assert near(on(places, 2, 0), [[0], [1]]) == [(0, 1, 0)]
    assert near(on(places, 2, 0), [[0], [2]]) == []


@st.composite
def joint_motions(draw: st.DrawFn) -> tuple[Asked, list[list[list[int]]]]:
    """Agents on one roadmap or two, and some of their joint motions."""
    agents, steps = draw(st.integers(2, 3)), draw(st.integers(0, 2))
    grid = [(x * 0.25, y * 0.25) for x in range(4) for y in range(3)]
    places = draw(st.lists(st.sampled_from(grid), min_size=4, max_size=7, unique=True))
    split = draw(st.integers(1, agents))
    groups = [tuple(range(split)), tuple(range(split, agents))]
    roadmaps: tuple[Roadmap, ...] = tuple(roadmap_of(group, places, steps) for group in groups if group)
    row = st.lists(st.integers(0, len(places) - 1), min_size=steps + 1, max_size=steps + 1)
    motions = draw(st.lists(st.lists(row, min_size=agents, max_size=agents), min_size=1, max_size=6))
    mission = mission_of([places[0]] * agents, steps, radius=0.1, separation=0.1, dynamics=FAST)
    return asked(mission, roadmaps), motions


@given(case=joint_motions())
@settings(max_examples=40)
def test_what_is_forbidden_are_collisions_and_nothing_else(case: tuple[Asked, list[list[list[int]]]]) -> None:
    made, motions = case
    everyone = np.arange(len(made.mission.agents))
    separation = Separation(made.mission, made.motion, everyone, made.clauses)
    with made.search() as search:
        for states in motions:
            found = too_near(np.array(states), everyone, made.motion, made.mission)
            separation.forbid(found, np.array(states))
            answer = search.ask(made.fixed(states))
            assert isinstance(answer, Unsatisfiable if len(found) else Satisfiable)
        for states in motions:
            free = not len(too_near(np.array(states), everyone, made.motion, made.mission))
            assert isinstance(search.ask(made.fixed(states)), Satisfiable if free else Unsatisfiable)


def literals(case: Asked, joint: list[tuple[int, int, int]]) -> tuple[int, ...]:
    """For each agent, step and state: that it is there."""
    return tuple(int(case.motion.states[agent][step, state]) for agent, step, state in joint)


def test_rounds_end_with_a_joint_motion_in_which_nobody_meets() -> None:
    case = on(SQUARE, 4, 2)
    with case.search() as search:
        found = search.find(literals(case, ACROSS))
        assert isinstance(found, JointMotion)
        assert near(case, found.states.tolist()) == []
        assert found.states[:, [0, 2]].tolist() == [[0, 3], [1, 2], [2, 1], [3, 0]]
        assert search.rounds > 1


ACROSS = [(0, 0, 0), (0, 2, 3), (1, 0, 1), (1, 2, 2), (2, 0, 2), (2, 2, 1), (3, 0, 3), (3, 2, 0)]
"""Agent, step and state: four agents at the corners of a square, each of whom goes to the opposite one."""


def test_rounds_end_with_a_refusal_where_there_is_no_room() -> None:
    case = on(SQUARE[:2], 2, 1)
    with case.search() as search:
        assert isinstance(search.find(literals(case, [(0, 0, 0), (0, 1, 1), (1, 0, 1), (1, 1, 0)])), Unsatisfiable)
        assert search.rounds > 1


def test_that_no_two_are_in_one_place_is_said_before_any_round() -> None:
    case = on(SQUARE[:2], 3, 1)
    with case.search() as search:
        assert isinstance(search.find(()), Unsatisfiable)
        assert search.rounds == 1
