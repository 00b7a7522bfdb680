"""What the SMT backend answers: a plan, a refusal that names the conflict, or neither."""

from __future__ import annotations

from itertools import count
from pathlib import Path

import pytest

import missionc
from missionc.backends.api import Budget, Impossible, NotFound, Reason
from missionc.backends.options import Options
from missionc.backends.smt.backend import SmtBackend
from missionc.backends.smt.roadmap.roadmap import NoRoadmap, build_roadmaps
from missionc.backends.smt.roadmap_answers import refusal
from missionc.base.limits import Limits
from missionc.base.source import Source
from missionc.compiler.results import Verified
from missionc.ir import Mission
from missionc.ir.kernel.nodes import Kernel

GREENHOUSE = Path(__file__).parents[3] / "missions" / "field" / "greenhouse.mission"

TEAM = """
mission outcomes
time step 1 s, horizon 6 s
world (0, 0) to (10, 10)
region base = box (0.5, 0.5) to (3, 3)
region goal = box (5, 5) to (7, 7)
team drone[3] { radius 0.1 m dynamics unicycle(speed 0..2 m/s) start in base }
graph radio = proximity 1 m
"""
GO = "require go: drone[0]: eventually[0, 6 s] goal\n"
NEAR = "require near: drone[0]: always[0, 6 s] (drone reach[hops 0..2 on radio] base)\n"
OTHER = "require other: some drone: eventually[0, 6 s] base\n"


def compiled(text: str, **options: object) -> missionc.Compiled:
    return missionc.compile(Source("outcomes.mission", TEAM + text), **options)  # type: ignore[arg-type]


@pytest.mark.usefixtures("roadmaps_alone")
def test_a_refusal_names_the_requirements_that_conflict_and_no_other() -> None:
    outcome = compiled(GO + NEAR + OTHER).outcome
    assert isinstance(outcome, Impossible)
    assert set(outcome.conflict) == {"go", "near"}
    assert "110, 187 and 318 nodes" in outcome.statement


LATTICE = """\
mission far
time step 1 s, horizon 8 s
world (0, 0) to (10, 10)
region base = box (0.5, 0.5) to (2, 2)
region goal = box (8, 8) to (9.5, 9.5)
team drone[2] { radius 0.1 m  dynamics unicycle(speed 0..2 m/s)  start in base }
graph radio = proximity 1 m
require go:   drone[0]: eventually[0, 8 s] goal
require near: every drone: always[0, 8 s] (drone reach[hops 0..1 on radio] base)
"""


@pytest.mark.usefixtures("roadmaps_alone")
def test_what_conflicts_does_so_on_every_roadmap_that_is_named() -> None:
    """On the finer roadmaps moves are so short that nobody reaches the goal at all; on the first one that is not so."""
    outcome = missionc.compile(Source("far.mission", LATTICE)).outcome
    assert isinstance(outcome, Impossible)
    assert outcome.conflict == ("go", "near")
    assert "on roadmaps of 110, 187 and 318 nodes `go` and `near`" in outcome.statement


@pytest.mark.parametrize("solver", ["z3", "cadical", "race"])
def test_every_solver_finds_a_plan_that_is_verified(solver: str) -> None:
    assert isinstance(compiled(GO, options=Options(solver=solver)).outcome, Verified)


@pytest.mark.parametrize("solver", ["z3", "cadical"])
def test_every_solver_refuses_what_cannot_be(solver: str) -> None:
    assert isinstance(compiled(GO + NEAR, options=Options(solver=solver)).outcome, Impossible)


@pytest.mark.usefixtures("roadmaps_alone")
def test_a_problem_over_the_limit_on_clauses_is_refused_as_too_large_and_not_as_impossible() -> None:
    outcome = compiled(GO + NEAR + "solve with smt\n", limits=Limits(clauses=500)).outcome
    assert isinstance(outcome, NotFound)
    assert outcome.reason is Reason.SIZE


def test_the_same_seed_gives_the_same_bytes() -> None:
    first, second = compiled(GO, seed=4).outcome, compiled(GO, seed=4).outcome
    assert isinstance(first, Verified)
    assert isinstance(second, Verified)
    assert dict(first.files) == dict(second.files)


def test_a_preference_that_can_be_kept_is_kept() -> None:
    outcome = compiled(GO + "prefer stay: drone[1]: always[0, 6 s] base\n").outcome
    assert isinstance(outcome, Verified)
    assert "preference `stay` satisfied" in outcome.report.notes


@pytest.mark.usefixtures("roadmaps_alone")
def test_a_missing_roadmap_names_every_roadmap_that_was_refused_before_it(monkeypatch: pytest.MonkeyPatch) -> None:
    built = count()

    def build_twice(*arguments: object, **passages: object) -> object:
        return build_roadmaps(*arguments, **passages) if next(built) < 2 else NoRoadmap("no path from `base`")  # type: ignore[arg-type]

    monkeypatch.setattr("missionc.backends.smt.roadmap.sequence.build_roadmaps", build_twice)
    outcome = compiled(GO + NEAR + "solve with smt { nodes = 110 }\n").outcome
    assert isinstance(outcome, NotFound)
    assert outcome.reason is Reason.NO_ROADMAP
    assert outcome.statement == "no path from `base`; roadmaps of 110 and 187 nodes contain no plan"


def checked_mission() -> tuple[Mission, Kernel]:
    checked = missionc.check(Source("greenhouse.mission", GREENHOUSE.read_text()))
    assert checked.mission is not None
    assert checked.kernel is not None
    return checked.mission, checked.kernel


def test_a_try_for_few_agents_ends_with_the_turn() -> None:
    """Four tasks that either can do, and two that come again and again: too much for one agent after the other."""
    turns = SmtBackend().turns(*checked_mission(), Options(), Budget(deadline=1e12))
    assert next(turns) == 0.0
    assert 0.5 <= turns.send(0.5) <= 5.0  # two agents have four units in any case
    turns.close()


def test_a_refusal_names_every_requirement_of_the_conflict() -> None:
    assert refusal(("a", "b", "c", "d", "e"), [110]).endswith("`a`, `b`, `c`, `d` and `e` cannot be satisfied together")
