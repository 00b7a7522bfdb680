"""Missions in which every agent is needed: planned in turns, judged as a whole, given up where turns do not do."""

from __future__ import annotations

import re

import numpy as np
import pytest

import missionc
from missionc.backends.api import Impossible
from missionc.backends.smt.prioritized.prioritized_plan import ShorterMakespan
from missionc.backends.smt.prioritized.prioritized_planning import PrioritizedPlanner
from missionc.backends.smt.prioritized.requirement_parts import named_agents, restricted_to
from missionc.backends.smt.shorten.improve import duration, rests_from
from missionc.base.source import Source
from missionc.compiler.results import Verified
from missionc.ir.kernel.nodes import All, Any, At, AtLeast, Eventually, Is, Node
from missionc.ir.kernel.normal_form import negated

FIELD = """
mission turns
time step 1 s, horizon 12 s
world (0, 0) to (10, 10)
region base = box (0.5, 0.5) to (4, 4)
region post = box (6, 2) to (8.5, 5)
team drone[NUMBER] { radius 0.1 m dynamics unicycle(speed 0..2 m/s) start in base }
graph radio = proximity 2 m
"""
RELAYED = "require relay: every drone: always[0, 12 s] (drone reach[hops 0..3 on radio] base)\n"
VISITS = "require visits: every drone: eventually[0, 12 s] post\n"
VISIT = "require visit: some drone: eventually[0, 12 s] post\n"


HANDOVER = """
mission handover
time step 1 s, horizon 30 s
world (0, 0) to (16, 8)
region west = box (0, 2) to (3, 6)
region east = box (13, 2) to (16, 6)
agent courier { radius 0.2 m  dynamics single_integrator(speed <= 1 m/s)  start at (2, 4) }
agent guard_w { radius 0.2 m  dynamics single_integrator(speed <= 2 m/s)  start at (3, 7) }
agent guard_e { radius 0.2 m  dynamics single_integrator(speed <= 2 m/s)  start at (12, 7) }
require there: courier: eventually[0, 30 s] east
require escorted: courier: always[0, end] (west or distance(guard_w) <= 3 m or distance(guard_e) <= 3 m)
require beat_w: guard_w: always[0, end] x <= 8.5 m
require beat_e: guard_e: always[0, end] x >= 7.5 m
solve with smt
"""
"""Whom nobody escorts all the way is led the way of its own, and the others go by that."""


def compiled(
    text: str, agents: int = 12, seed: int = 0, settings: dict[str, object] | None = None
) -> missionc.Compiled:
    source = Source("turns.mission", FIELD.replace("NUMBER", str(agents)) + text)
    return missionc.compile(source, seed=seed, settings=settings)


@pytest.fixture
def in_problem(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """How many agents there were in each problem of a turn."""
    sizes: list[int] = []
    before = PrioritizedPlanner.plan_together

    def together(self: PrioritizedPlanner, batch: frozenset[int]) -> bool:
        sizes.append(len(batch))
        return before(self, batch)

    monkeypatch.setattr(PrioritizedPlanner, "plan_together", together)
    return sizes


def test_who_can_keep_what_is_asked_alone_needs_no_solver(in_problem: list[int]) -> None:
    outcome = compiled(VISITS).outcome
    assert isinstance(outcome, Verified)
    assert dict(outcome.report.sizes)["turns"] == 0
    assert not in_problem


def test_who_needs_others_on_the_way_is_planned_with_as_few_as_it_takes(in_problem: list[int]) -> None:
    outcome = compiled(RELAYED + VISIT).outcome
    assert isinstance(outcome, Verified)
    assert dict(outcome.report.sizes)["turns"] >= 1
    assert 1 < max(in_problem) < 12


def test_who_is_escorted_in_turns_leads_and_the_others_go_by_that(in_problem: list[int]) -> None:
    handover = Source("handover.mission", HANDOVER)
    outcome = missionc.compile(handover, continuous_time=missionc.ContinuousTime.AT_STEPS).outcome
    assert isinstance(outcome, Verified)
    assert dict(outcome.report.sizes)["turns"] == 1
    assert in_problem == [1, 2]


def test_what_others_must_not_do_holds_of_the_whole_team() -> None:
    lonely = "require lonely: drone[0]: eventually[0, 12 s] (post and not somewhere[hops 1..1 on radio] drone)\n"
    assert isinstance(compiled(lonely + VISITS).outcome, Verified)


@pytest.mark.usefixtures("coarse_covers")
def test_a_motion_that_is_over_late_is_made_shorter(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of a motion that begins only after eight steps of waiting."""
    late, find = list[int](), ShorterMakespan.find

    def find_of_delayed(search: ShorterMakespan) -> None:
        waiting = np.repeat(search.states[:, :1], 8, axis=1)
        search.states = np.concatenate([waiting, search.states[:, :-8]], axis=1)
        late.append(search.best)
        find(search)

    monkeypatch.setattr(ShorterMakespan, "find", find_of_delayed)
    text = (
        FIELD.replace("horizon 12 s", "horizon 20 s")
        .replace("NUMBER", "3")
        .replace("unicycle(speed 0..2 m/s)", "single_integrator(speed <= 2 m/s)")
    )
    asked = "require visits: every drone: eventually[0, 20 s] post\nminimize duration\nsolve with smt { nodes = 60 }\n"
    outcome = missionc.compile(
        Source("turns.mission", text + asked), backend="smt", settings={"smt.all_agents": 0}
    ).outcome
    assert isinstance(outcome, Verified)
    (note,) = (note for note in outcome.report.notes if note.startswith("duration"))
    lasts, before = map(int, re.findall(r"\d+", note)[:2])
    assert before == late[0]
    assert lasts <= before - 8


def test_who_rests_from_when_is_told_of_each_agent() -> None:
    states = np.array([[1, 1, 1, 1], [1, 2, 2, 2], [1, 1, 1, 2]])
    assert rests_from(states).tolist() == [0, 1, 3]
    assert duration(states) == 3


def test_where_turns_find_nothing_all_are_planned_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(PrioritizedPlanner, "plan_groups", lambda self, waiting: False)
    outcome = compiled(VISITS, agents=3).outcome
    assert isinstance(outcome, Verified)
    assert "turns" not in dict(outcome.report.sizes)


@pytest.mark.usefixtures("coarse_covers")
def test_what_turns_do_not_find_is_impossible_only_by_a_proof_about_everybody() -> None:
    text = RELAYED.replace("0..3", "0..1") + VISITS
    outcome = compiled(text, agents=3, settings={"smt.failures": 2}).outcome
    assert isinstance(outcome, Impossible)
    assert set(outcome.conflict) == {"relay", "visits"}


def test_the_same_seed_gives_the_same_plan_in_turns() -> None:
    first, second = compiled(RELAYED + VISIT, seed=2).outcome, compiled(RELAYED + VISIT, seed=2).outcome
    assert isinstance(first, Verified)
    assert isinstance(second, Verified)
    np.testing.assert_array_equal(first.plan.trace.position, second.plan.trace.position)


def visit(agent: int) -> Node:
    return At(agent, Eventually(Is(frozenset((agent,))), 0, None))


def test_of_agents_who_are_there_less_is_asked_or_the_same_but_never_more() -> None:
    team = tuple(map(visit, range(4)))
    every, some, two = All(team), Any(team), AtLeast(2, team)
    not_every = negated(every)
    named = named_agents((every, some, two, not_every))
    present = frozenset((1, 2))
    assert restricted_to(every, named, present) is None
    assert restricted_to(every, named, frozenset(range(4))) is every
    left = restricted_to(some, named, present)
    assert isinstance(left, Any)
    assert left.parts == team[1:3]
    assert restricted_to(some, named, frozenset((3,))) is team[3]
    few = restricted_to(two, named, present)
    assert isinstance(few, AtLeast)
    assert (few.count, few.parts) == (2, team[1:3])
    assert restricted_to(two, named, frozenset((1,))) is None
    refused = restricted_to(not_every, named, present)
    assert isinstance(not_every, Any)
    assert isinstance(refused, Any)
    assert refused.parts == not_every.parts[1:3]
