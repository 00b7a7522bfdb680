"""Which agents are given up as too few before a solver is asked, and how places near each other share links."""

from __future__ import annotations

from unittest.mock import patch

import numpy as np

from missionc.backends.smt.encode.lower_motion import all_ways
from missionc.backends.smt.prioritized import single_agent_relaxation
from missionc.backends.smt.prioritized.single_agent_relaxation import SingleAgentRelaxation
from missionc.backends.smt.roadmap import roadmap_links
from missionc.backends.smt.roadmap.labels import Labels
from missionc.backends.smt.roadmap.roadmap import NoRoadmap, build_roadmaps
from missionc.backends.smt.roadmap.roadmap_links import Links, links_between
from missionc.base.source import Source
from missionc.base.units import Metres
from missionc.compiler.driver import check
from missionc.ir import Proximity
from tests.support.random_runs import SPAN

TEAM = """
mission few
time step 1 s, horizon 8 s
world (0, 0) to (10, 10)
region base = box (0.5, 0.5) to (3, 3)
region goal = box (6, 6) to (8, 8)
team drone[3] { radius 0.1 m dynamics unicycle(speed 0..2 m/s) start in base }
graph radio = proximity 2 m
"""
GO = "require go: drone[0]: eventually[0, 8 s] goal\n"
BACK = "require back: drone[0]: eventually[5 s, 6 s] (goal and next always[0, 1 s] base)\n"
LINKED = "require linked: drone[0]: (drone reach[hops 0..2 on radio] base) until[0, 8 s] goal\n"
MET = "require met: drone[0]: eventually[0, 8 s] (goal and somewhere[hops 1..2 on radio] drone)\n"


def given_up(text: str, *agents: int) -> bool:
    checked = check(Source("few.mission", TEAM + text))
    assert checked.mission is not None, checked.findings
    assert checked.kernel is not None, checked.findings
    roadmaps = build_roadmaps(checked.mission, 60, 6, np.random.default_rng(0))
    assert not isinstance(roadmaps, NoRoadmap)
    found = SingleAgentRelaxation(Labels(checked.mission, roadmaps), all_ways(roadmaps, {}), frozenset(agents))
    return found.infeasible(goal.formula for goal in checked.kernel.requirements)


def test_one_agent_goes_to_a_place_by_itself_but_not_to_two_at_once() -> None:
    assert not given_up(GO, 0)
    assert given_up(BACK, 0)


def test_one_agent_is_too_few_where_another_must_be_near() -> None:
    assert given_up(MET, 0)
    assert not given_up(MET, 0, 1)


def test_one_agent_is_too_few_where_it_would_have_to_leave_what_it_must_keep_to() -> None:
    assert given_up(LINKED, 0)
    assert not given_up(LINKED, 0, 2)


def expanded(found: Links, place: int) -> list[int]:
    """The places linked to one, each group taken apart."""
    places = len(found.same)
    parts = found.beside(np.array([place]))[2].tolist()
    whole: list[int] = []
    while parts:
        part = parts.pop()
        if part < places:
            whole.append(part)
        else:
            parts += found.groups[part - places].tolist()
    return sorted(whole)


def test_groups_stand_for_the_places_within_the_radius_and_each_for_once() -> None:
    generator = np.random.default_rng(0)
    for count in (5, 16, 67, 300):
        position = generator.uniform(0, 4, (count, 2))
        position[count // 2] = position[0]  # two places at one point
        graph = Proximity("radio", Metres(1.5), (0, 1), SPAN)
        distance = np.linalg.norm(position[:, None] - position[None], axis=-1)
        for dense in (-1, count):
            with patch.object(roadmap_links, "DENSE", dense):
                found = links_between(graph, position)
            assert bool(len(found.groups)) == (dense < 0)
            for place in range(count):
                near = (distance[place] < 1.5) & (distance[place] > 0)
                assert expanded(found, place) == np.flatnonzero(near).tolist()


def test_looking_further_than_is_worth_while_gives_nobody_up() -> None:
    with patch.object(single_agent_relaxation, "STEPS", 3):
        assert not given_up(LINKED, 0)
