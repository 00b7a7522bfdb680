"""The shortest way of one agent among all ways on a small roadmap, judged by the monitor."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

import missionc
from missionc.backends.smt.encode.clauses import Clauses
from missionc.backends.smt.encode.lower_motion import Ways, lower_motion
from missionc.backends.smt.lift import lift
from missionc.backends.smt.prioritized.requirement_parts import own_formulas
from missionc.backends.smt.prioritized.reservations import Reservations
from missionc.backends.smt.prioritized.single_agent_search import SingleAgentSearch
from missionc.backends.smt.roadmap.labels import Labels
from missionc.base.source import Source
from missionc.ir import Mission
from missionc.ir.kernel.nodes import Kernel
from missionc.planning.progression.residuals import TooComplex
from missionc.verification.monitoring.evaluate import Evaluation
from missionc.verification.monitoring.logic import TRUTH
from tests.support.small_roadmaps import roadmap_of

FIELD = """
mission one
time step 1 s, horizon 5 s
world (0, 0) to (10, 10)
region left = box (0, 0) to (3, 10)
region middle = box (4, 0) to (6, 10)
region right = box (7, 0) to (10, 10)
team bot[2] { radius 0.1 m dynamics unicycle(speed 0..12 m/s) start in left }
flag carries of bot { set in right, cleared in left }
flag seen of bot { set in middle }
resource fuel of bot { start 12, capacity 24, drain 1 per s, drain 1 per m, refill 8 per s in left }
"""

PLACES = ((1.0, 1.0), (5.0, 1.0), (9.0, 1.0), (9.0, 5.0))

ASKED = (
    "eventually[0, end] right",
    "eventually[0, 3 s] (middle and eventually[0, 2 s] left)",
    "eventually[1 s, 4 s] always[0, 1 s] right",
    "(not right) until[0, 4 s] middle",
    "(not right) until[2 s, 4 s] middle",
    "eventually[0, 4 s] (middle and next right)",
    "always[0, 3 s] eventually[0, 2 s] middle",
    "(eventually[0, 2 s] right) or (always[3 s, end] middle)",
    "always[0, end] (right implies speed <= 9 m/s)",
    "not (eventually[0, 2 s] middle) and eventually[0, end] right",
    "always[0, end] (middle implies speed <= 3 m/s) and eventually[0, end] right and eventually[0, end] middle",
    "not ((not right) until[0, 3 s] middle) and eventually[0, end] middle",
    "eventually[0, end] (carries and middle)",
    "eventually[0, 4 s] (not carries and middle and next carries)",
    "(not carries) until[3 s, 4 s] (seen and carries)",
    "eventually[3 s, end] (seen and left and not carries) and eventually[0, 3 s] carries",
)

FUELLED = (
    "always[0, end] fuel >= 1 and eventually[0, end] right",
    "always[0, end] fuel >= 6 and eventually[0, end] middle",
    "eventually[0, end] fuel >= 20 and eventually[0, end] right",
    "eventually[2 s, end] fuel < 5",
    "(not right) until[0, end] fuel >= 14 and eventually[0, end] right",
    "always[0, end] (fuel >= 2 * distance(left) / (2 m)) and eventually[0, end] (middle and seen)",
)
"""What is asked of a resource: sums of whole numbers, so that no two of them are taken for one."""


class OnPlaces:
    """Two agents on four places, of whom the first is asked something."""

    def __init__(self, asked: str) -> None:
        checked = missionc.check(Source("one.mission", FIELD + f"require it: bot[0]: {asked}\n"))
        assert checked.mission is not None
        assert checked.kernel is not None
        self.mission: Mission = checked.mission
        self.kernel: Kernel = checked.kernel
        roadmaps = (roadmap_of((0, 1), PLACES, self.mission.steps),)
        motion = lower_motion(roadmaps, Ways(roadmaps, {}), frozenset(), Clauses(1))
        self.reservations = Reservations(motion, self.mission)
        self.search = SingleAgentSearch(Labels(self.mission, roadmaps), {}, self.reservations, 1, haste=0.0)
        self.formulas = own_formulas(self.kernel.requirements[0].formula, 0)

    def keeps(self, way: np.ndarray) -> bool:
        states = np.stack([way, np.zeros_like(way)])
        trace = lift(states, self.reservations.motion.own_roadmaps, self.mission)
        goal = self.kernel.requirements[0].formula
        return bool(Evaluation(TRUTH, self.mission, trace).values((goal,))[goal][0, 0])

    def metres(self, way: np.ndarray) -> float:
        return self.search.metres(0, way)

    def shorter_than(self, metres: float) -> list[np.ndarray]:
        ways = [np.array(way) for way in product(range(len(PLACES)), repeat=self.mission.steps + 1)]
        return [way for way in ways if self.metres(way) < metres - 1e-6]


@pytest.mark.parametrize("asked", ASKED)
def test_the_way_found_keeps_what_is_asked_and_none_that_does_is_shorter(asked: str) -> None:
    places = OnPlaces(asked)
    way = places.search.alone(0, places.formulas)
    assert way is not None
    assert places.keeps(way)
    shorter = places.shorter_than(places.metres(way))
    few = np.random.default_rng(0).permutation(len(shorter))[:150]
    assert not any(places.keeps(shorter[number]) for number in few.tolist())


@pytest.mark.parametrize("asked", FUELLED)
def test_the_way_found_keeps_a_resource_and_none_that_does_is_shorter(asked: str) -> None:
    places = OnPlaces(asked)
    way = places.search.way(0, places.formulas, places.reservations)
    assert way is not None
    assert places.keeps(way)
    assert not any(places.keeps(shorter) for shorter in places.shorter_than(places.metres(way)))


def test_that_no_way_keeps_a_resource_is_not_said_for_certain() -> None:
    places = OnPlaces("always[1 s, end] fuel >= 16 and eventually[0, end] right")
    assert places.search.way(0, places.formulas, places.reservations) is None
    with pytest.raises(TooComplex):
        places.search.alone(0, places.formulas)


def test_where_no_way_keeps_it_there_is_none_for_certain() -> None:
    places = OnPlaces("eventually[0, 2 s] (right and speed <= 3 m/s and next left)")
    assert places.search.alone(0, places.formulas) is None
    places = OnPlaces("eventually[0, 1 s] (carries and not seen) and eventually[0, end] (left and carries)")
    assert places.search.alone(0, places.formulas) is None


def test_it_keeps_clear_of_who_is_settled_or_pushes_them() -> None:
    places = OnPlaces("always[5 s, end] right")
    states = np.array([[0] * 6, [2] * 6])  # the other stays at one of the two places on the right
    states[1, :2] = 3
    places.reservations.reserve((1,), states, alone=True)
    way = places.search.way(0, places.formulas, places.reservations)
    assert way is not None
    assert way[-1] == 3
    assert not places.reservations.in_the_way(0, way)
    states[0] = [0, 2, 2, 2, 2, 2]
    assert places.reservations.in_the_way(0, states[0]) == [1]
    places.reservations.release((1,))
    assert not places.reservations.tables[0].weight(3, np.arange(16)).any()


def test_a_way_that_may_cost_no_more_than_the_shortest_is_found_and_none_that_costs_less() -> None:
    places = OnPlaces("eventually[0, 3 s] (middle and eventually[0, 2 s] right)")
    way = places.search.way(0, places.formulas, places.reservations)
    assert way is not None
    metres = places.metres(way)
    again = places.search.way(0, places.formulas, places.reservations, most=metres + 1e-3)
    assert again is not None
    assert places.metres(again) == metres
    assert places.search.way(0, places.formulas, places.reservations, most=metres - 0.1) is None
