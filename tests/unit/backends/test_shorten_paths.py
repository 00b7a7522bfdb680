"""Plans without idle ways, and the shortest of them: what is kept, and that what is said of them is so."""

from __future__ import annotations

import re

import numpy as np
import pytest

import missionc
from missionc.backends.options import Options
from missionc.backends.smt.encode.clauses import Clauses
from missionc.backends.smt.encode.lower_motion import Motion, all_ways, lower_motion
from missionc.backends.smt.lift import lift
from missionc.backends.smt.refine.lazy_constraints import too_near
from missionc.backends.smt.refine.problem import effort
from missionc.backends.smt.roadmap.roadmap import NoRoadmap, build_roadmaps
from missionc.backends.smt.settings import SmtSettings
from missionc.backends.smt.shorten.shorten_paths import JointPaths, shorten_paths
from missionc.base.source import Source
from missionc.compiler.results import Verified
from missionc.ir import Mission
from missionc.ir.kernel.nodes import Kernel
from missionc.verification.monitoring.monitor import truth

pytestmark = pytest.mark.usefixtures("coarse_covers")

TEAM = """
mission calm
time step 1 s, horizon 8 s
world (0, 0) to (8, 8)
region base = box (0.5, 0.5) to (3, 3)
region goal = box (5, 5) to (7, 7)
region pond = disc at (4, 4) radius 1 m
team drone[3] { radius 0.1 m dynamics unicycle(speed 0..2 m/s) start in base }
graph radio = proximity 2 m
solve with smt { nodes = 40 }
require visit: some drone: eventually[0, 6 s] goal
require home: every drone: eventually[6 s, 8 s] base
require dry: every drone: always[0, 8 s] (not pond)
require near: drone[1]: always[0, 3 s] (drone reach[hops 1..2 on radio] base)
"""

PAIR = """
mission pair
time step 1 s, horizon 3 s
world (0, 0) to (6, 3)
region west = box (0.2, 0.5) to (1.8, 2.5)
region east = box (4.2, 0.5) to (5.8, 2.5)
team a[1] { radius 0.3 m dynamics unicycle(speed 0..3 m/s) start in west }
team b[1] { radius 0.3 m dynamics unicycle(speed 0..3 m/s) start in east }
separation 0.2 m
minimize distance
solve with smt { nodes = 12, neighbors = 4 }
require over: a[0]: eventually[0, 3 s] east
require back: b[0]: eventually[2 s, 3 s] west
"""


@pytest.fixture(autouse=True)
def on_the_roadmap(monkeypatch: pytest.MonkeyPatch) -> None:
    """Plans as the solver leaves them."""
    monkeypatch.setattr("missionc.compiler.plan_with_margin.load_straighten", lambda engine: None)
    monkeypatch.setattr("missionc.compiler.wider_margins.widens", lambda checked, request: False)


def meant(text: str) -> tuple[Mission, Kernel]:
    checked = missionc.check(Source("calm.mission", text))
    assert checked.mission is not None
    assert checked.kernel is not None
    return checked.mission, checked.kernel


def motion_of(mission: Mission, nodes: int, neighbours: int, seed: int) -> Motion:
    roadmaps = build_roadmaps(mission, nodes, neighbours, np.random.default_rng([seed, 0]))
    assert not isinstance(roadmaps, NoRoadmap)
    return lower_motion(roadmaps, all_ways(roadmaps, {}), frozenset(), Clauses(1_000_000))


def states_of(outcome: Verified, motion: Motion) -> np.ndarray:
    """The states, (agents, steps + 1), that a plan on these roadmaps goes through."""
    rows = []
    for agent, track in enumerate(outcome.plan.trace.position):
        apart = np.linalg.norm(motion.roadmap(agent).position[None] - track[:, None], axis=-1)
        assert apart.min(axis=1).max() < 1e-9
        rows.append(apart.argmin(axis=1))
    return np.array(rows)


def said_of(outcome: Verified) -> tuple[float, float]:
    """The metres of the plan, and those that no plan goes below."""
    note = next(note for note in outcome.report.notes if note.startswith("distance ") and "on this roadmap" in note)
    if found := re.fullmatch(r"distance (\S+) m, optimal on this roadmap", note):
        return float(found[1]), float(found[1])
    found = re.fullmatch(r"distance (\S+) m, lower bound (\S+) m on this roadmap, optimality gap .* %", note)
    assert found, note
    return float(found[1]), float(found[2])


def test_who_has_nothing_to_do_stays_where_it_is() -> None:
    outcome = missionc.compile(Source("calm.mission", TEAM)).outcome
    assert isinstance(outcome, Verified)
    ways = np.linalg.norm(np.diff(outcome.plan.trace.position, axis=1), axis=-1).sum(axis=1)
    assert np.sort(ways)[0] == 0


@pytest.mark.parametrize("seed", range(4))
def test_a_calmed_plan_keeps_every_requirement_and_every_distance_and_is_no_longer(seed: int) -> None:
    mission, kernel = meant(TEAM)
    text = TEAM + "require busy: every drone: eventually[0, 8 s] not base\n"
    outcome = missionc.compile(
        Source("calm.mission", text), seed=seed, continuous_time=missionc.ContinuousTime.AT_STEPS
    ).outcome
    assert isinstance(outcome, Verified)
    motion = motion_of(mission, 40, 6, seed)
    before = states_of(outcome, motion)
    formulas = [goal.formula for goal in kernel.requirements]  # without the one that made them leave
    after = shorten_paths(before, range(3), formulas, motion, mission)
    assert all(truth(formula, mission, lift(after, motion.own_roadmaps, mission))[0, 0] for formula in formulas)
    assert not len(too_near(after, np.arange(3), motion, mission))
    old, new = JointPaths(before, motion, mission), JointPaths(after, motion, mission)
    costs = [(old.cost(agent), new.cost(agent)) for agent in range(3)]
    assert all(later <= earlier for earlier, later in costs)
    assert sum(later for _, later in costs) < sum(earlier for earlier, _ in costs)


def test_what_does_not_hold_is_left_as_it_is() -> None:
    mission, kernel = meant(TEAM)
    motion = motion_of(mission, 40, 6, 0)
    start = next(state for state in motion.roadmaps[0].starts[0].tolist())
    states = np.full((3, mission.steps + 1), start)  # nobody visits the goal
    assert shorten_paths(states, range(3), [goal.formula for goal in kernel.requirements], motion, mission) is states


def test_after_the_last_step_of_a_shortest_duration_nobody_moves() -> None:
    outcome = missionc.compile(Source("calm.mission", TEAM + "minimize duration\n")).outcome
    assert isinstance(outcome, Verified)
    said = next(note for note in outcome.report.notes if note.startswith("duration"))
    last = int(said.split()[1])
    position = outcome.plan.trace.position
    assert (position[:, last:] == position[:, last, None]).all()


@pytest.mark.parametrize("seed", range(3))
def test_what_is_said_of_the_least_distance_is_so_by_trying_every_motion(seed: int) -> None:
    mission, kernel = meant(PAIR)
    outcome = missionc.compile(Source("pair.mission", PAIR), seed=seed).outcome
    assert isinstance(outcome, Verified)
    assert dict(outcome.report.sizes)["nodes"] == 12  # no finer roadmap was needed
    best, bound = said_of(outcome)
    least = tried(mission, kernel, motion_of(mission, 12, 4, seed), best + 1e-4)
    assert bound - 1e-4 <= least
    assert best - bound <= 0.01 * best


def tried(mission: Mission, kernel: Kernel, motion: Motion, most: float) -> float:
    """The metres of the shortest plan, by going through all of at most so many."""
    one, other = (ways_of(agent, mission, kernel, motion) for agent in range(2))
    whole = np.add.outer([length for length, _ in one], [length for length, _ in other])
    pairs = np.argwhere(whole <= most)
    for first, second in pairs[np.argsort(whole[tuple(pairs.T)])]:
        states = np.array([one[first][1], other[second][1]])
        if not len(too_near(states, np.arange(2), motion, mission)):
            return float(whole[first, second])
    raise AssertionError("there is no plan")


def ways_of(agent: int, mission: Mission, kernel: Kernel, motion: Motion) -> list[tuple[float, tuple[int, ...]]]:
    """Every motion of an agent that keeps its own requirement, and its metres."""
    roadmap = motion.roadmap(agent)
    metres = roadmap.lengths(mission)
    ways = [(0.0, (int(start),)) for start in roadmap.starts[roadmap.agents.index(agent)]]
    for _ in range(mission.steps):
        ways = [
            (length + float(metres[move]), (*way, int(roadmap.moves[move, 1])))
            for length, way in ways
            for move in np.flatnonzero(roadmap.moves[:, 0] == way[-1])
        ]
    found = []
    for length, way in ways:
        states = np.array([way, way])
        states[1 - agent] = way[0]
        if truth(kernel.requirements[agent].formula, mission, lift(states, motion.own_roadmaps, mission))[0, 0]:
            found.append((length, way))
    return found


def test_a_gap_is_said_where_the_search_for_less_takes_too_much() -> None:
    hardly = {"smt.improve_least": 1, "smt.improve_most": 1, "smt.improve_rounds": 1}
    outcome = missionc.compile(Source("pair.mission", PAIR), settings=hardly).outcome
    assert isinstance(outcome, Verified)
    best, bound = said_of(outcome)
    assert 0 < bound < best


@pytest.mark.parametrize("solver", ["z3", "cadical"])
@pytest.mark.parametrize(
    "wish", ["minimize distance", "minimize duration", "prefer out: every drone: always[1 s, 5 s] (not base)"]
)
def test_a_better_plan_is_the_same_plan_each_time(wish: str, solver: str) -> None:
    source, options = Source("calm.mission", f"{TEAM}{wish}\n"), Options(solver=solver)
    first, second = (missionc.compile(source, seed=2, options=options).outcome for _ in range(2))
    assert isinstance(first, Verified)
    assert isinstance(second, Verified)
    assert dict(first.files) == dict(second.files)
    assert first.report.notes == second.report.notes


def test_a_question_about_more_clauses_may_take_fewer_conflicts() -> None:
    few, many = Clauses(10_000_000), Clauses(10_000_000)
    many.add(np.full((1_000_000, 1), 1, dtype=np.int32))
    (asked, _), limits = meant(TEAM), SmtSettings().solver
    fewer, most = (effort(asked, clauses).conflicts for clauses in (many, few))
    assert limits.improve_least <= fewer <= most == limits.improve_most
