"""Lengths in metres on roadmaps: kept by plans, refused only where nothing rounded is to blame."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

import missionc
from missionc import ir
from missionc.backends.api import Impossible, NotFound
from missionc.backends.smt.encode.clauses import Clauses
from missionc.backends.smt.encode.lower_motion import all_ways, lower_motion
from missionc.backends.smt.encode.metric_bounds import bounded_above
from missionc.backends.smt.prioritized.reservations import Reservations
from missionc.backends.smt.prioritized.single_agent_search import holds_beside
from missionc.backends.smt.roadmap.labels import Labels
from missionc.backends.smt.sat.solve import Satisfiable
from missionc.base.source import Source
from missionc.base.units import Metres
from missionc.compiler.results import Verified
from missionc.ir.kernel.nodes import All, At, EveryRoute, Goal, Is, Kernel, Node, Not, PathLength, Route
from missionc.ir.kernel.nodes import Any as Either
from missionc.planning.progression.residuals import TooComplex
from tests.support.legal_plans import SPAN, mission_of
from tests.support.small_roadmaps import asked, roadmap_of

LINE = [(0.0, 0.0), (2.0, 0.0), (4.0, 0.0), (9.0, 9.0)]
"""Each in reach of the next; the last of none."""

RADIO = ir.Proximity("radio", Metres(2.5), (0, 1, 2), SPAN)
MISSION = replace(mission_of([LINE[0]] * 3, 1, dynamics=ir.SingleIntegrator(99.0)), graphs=(RADIO,))


def to(agent: int, high: float, low: float = 0.0) -> Route:
    return Route(RADIO, All(()), Is(frozenset((agent,))), low, high)


def none_to(agent: int, high: float) -> EveryRoute:
    return EveryRoute(RADIO, Either(()), Not(Is(frozenset((agent,)))), 0.0, high)


def can_be_asked(node: Node, places: Sequence[int]) -> bool:
    """Whether the solver can be asked for it of agent 0 where the agents stand in these places."""
    kernel = bounded_above(Kernel((Goal("asked", node, SPAN),), ()))
    case = asked(MISSION, (roadmap_of((0, 1, 2), LINE, 1),), kernel.requirements[0].formula)
    with case.search() as search:
        fixed = case.fixed([[place, place] for place in places])
        return isinstance(search.ask((*fixed, *case.lowered.goals)), Satisfiable)


@pytest.mark.parametrize(
    ("node", "places", "expected"),
    [
        (to(1, 2.0), (0, 1, 3), True),  # one link may be as long as the bound
        (to(1, 1.9), (0, 1, 3), False),
        (to(2, 5.0), (0, 1, 2), True),  # two links of 2 m
        (to(2, 3.9), (0, 1, 2), False),
        (to(2, 5.0), (0, 3, 2), False),  # nobody between
        (to(2, 5.0, low=3.0), (0, 1, 2), True),
        (to(1, 5.0, low=3.0), (0, 1, 3), False),  # there and back is no route
        (none_to(2, 3.0), (0, 1, 2), True),
        (none_to(2, 4.0), (0, 1, 2), False),
        (none_to(2, 9.0), (0, 3, 2), True),
        (PathLength(RADIO, 1, 1.0, 2.0), (0, 1, 3), True),
        (PathLength(RADIO, 1, 2.1, 3.0), (0, 1, 3), False),
        (Not(PathLength(RADIO, 1, 2.1, 3.0)), (0, 1, 3), True),
    ],
)
def test_a_length_is_asked_for_where_it_is_kept(node: Node, places: Sequence[int], expected: bool) -> None:
    assert can_be_asked(node, places) is expected


def beside(node: Node, settled: dict[int, int]) -> list[bool]:
    """In which places agent 0 may be at step 0 so that it holds, with others settled in theirs."""
    roadmaps = (roadmap_of((0, 1, 2), LINE, 1),)
    motion = lower_motion(roadmaps, all_ways(roadmaps, {}), frozenset(), Clauses(1))
    reservations = Reservations(motion, MISSION)
    for agent, place in settled.items():
        reservations.reserve((agent,), np.full((3, 2), place))
    may = np.ones((2, len(LINE)), dtype=np.bool_)
    found = holds_beside(node, 0, reservations, Labels(MISSION, roadmaps), may)
    assert (found[0] == found[1]).all()
    return [bool(flag) for flag in found[0]]


def test_beside_the_settled_nothing_is_rounded() -> None:
    assert beside(to(1, 2.0), {1: 1}) == [True, True, True, False]
    assert beside(to(2, 4.0), {1: 1, 2: 2}) == [True, True, True, False]
    assert beside(to(2, 4.0), {2: 2}) == [False, True, True, False]
    assert beside(to(1, 2.0), {}) == [False, False, False, False]


def test_what_is_about_agents_that_are_not_settled_is_not_decided_beside_them() -> None:
    with pytest.raises(TooComplex):
        beside(All((At(1, Is(frozenset((1,)))), to(2, 4.0))), {2: 2})


TEAM = """\
mission measured
time step 1 s, horizon 6 s
world (0, 0) to (9, 9)
region base = box (0.5, 0.5) to (2.5, 2.5)
region goal = box (6.5, 6.5) to (8.5, 8.5)
team drone[3] { radius 0.1 m  dynamics unicycle(speed 0..2 m/s)  start in base }
graph radio = proximity 4 m
solve with smt { nodes = 40 }
"""


def planned(requirement: str) -> object:
    return missionc.compile(Source("measured.mission", TEAM + requirement)).outcome


def test_a_route_in_metres_is_planned_on_a_roadmap() -> None:
    far = "require far: some drone: eventually[0, 6 s] (goal and drone reach[distance <= 7.5 m] base)"
    assert isinstance(planned(far), Verified)


@pytest.mark.parametrize("use", ["drone reach[distance <= 5 m] base", "count[distance 1 m..5 m] base >= 1"])
def test_what_is_farther_than_a_route_may_be_is_refused(use: str) -> None:
    outcome = planned(f"require far: some drone: eventually[0, 6 s] (goal and {use})")
    assert isinstance(outcome, Impossible)
    assert outcome.conflict == ("far",)


ROW = """\
mission row
time step 1 s, horizon 3 s
world (0, 0) to (6, 2)
region post = box (4.5, 0.5) to (5.5, 1.5)
team drone[3] { radius 0.1 m  dynamics single_integrator(speed <= 1 m/s)  start at (1, 1), (3, 1), (5, 1) }
graph radio = proximity 2.5 m
require far: drone[0]: drone reach[distance <= 4 m] post
require go:  drone[0]: eventually[0, 3 s] x >= 2
solve with smt { nodes = 10 }
"""
"""Two links of 2 m, as long together as the route may be: rounding leaves none."""


def test_where_lengths_were_rounded_there_is_no_refusal() -> None:
    outcome = missionc.compile(Source("row.mission", ROW)).outcome
    assert isinstance(outcome, NotFound)
    assert "rounded" in outcome.statement


def test_a_preference_that_is_not_kept_is_no_proof_where_lengths_are_rounded() -> None:
    text = ROW.replace("require far:", "prefer far:")
    outcome = missionc.compile(Source("row.mission", text)).outcome
    assert isinstance(outcome, Verified)
    assert any(
        "preference `far` not satisfied: no plan that satisfies it was found" in note for note in outcome.report.notes
    )
