"""From a plan to a better one: preferences by weight, then the objective; what was found is never lost."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace

import numpy as np
import pytest

import missionc
from missionc.backends.api import Report
from missionc.backends.options import Options
from missionc.backends.smt.refine.lazy_constraints import JointMotion, LazyConstraints
from missionc.backends.smt.shorten.improve import improve
from missionc.base.source import Source
from missionc.base.trace import Trace
from missionc.compiler.results import Verified
from missionc.ir import Compare, Coordinate, Objective, SingleIntegrator
from missionc.ir.kernel.nodes import All, Always, At, Atom, Goal, Kernel, Node
from tests.support.legal_plans import SPAN, mission_of
from tests.support.small_missions import SMALL
from tests.support.small_roadmaps import asked, roadmap_of

pytestmark = pytest.mark.usefixtures("coarse_covers")

ONE = SMALL.replace("drone[2]", "drone[1]")
FEW = ONE.replace("nodes = 40", "nodes = 4").replace("6 s", "2 s")
CORNER = "region corner = box (0.2, 2.2) to (1.8, 3.8)\n"
EITHER = ONE.replace("every drone: eventually[0, 6 s] goal", "drone[0]: eventually[0, 6 s] (goal or base)") + CORNER


@pytest.fixture(autouse=True)
def on_the_roadmap(monkeypatch: pytest.MonkeyPatch) -> None:
    """Plans as the solver leaves them."""
    monkeypatch.setattr("missionc.compiler.plan_with_margin.load_straighten", lambda engine: None)
    monkeypatch.setattr("missionc.compiler.wider_margins.widens", lambda checked, request: False)


def planned(text: str, **options: object) -> tuple[Trace, Report]:
    outcome = missionc.compile(Source("improve.mission", text), **options).outcome  # type: ignore[arg-type]
    assert isinstance(outcome, Verified), outcome
    return outcome.plan.trace, outcome.report


def kept(report: Report) -> set[str]:
    return {note.split("`")[1] for note in report.notes if note.endswith("` satisfied")}


def travelled(trace: Trace) -> float:
    return float(np.linalg.norm(np.diff(trace.position, axis=1), axis=-1).sum())


@pytest.mark.parametrize(("stay", "away", "winner"), [(1, 2, "away"), (2, 1, "stay")])
def test_of_two_preferences_that_exclude_each_other_the_heavier_is_kept(stay: int, away: int, winner: str) -> None:
    text = (
        EITHER
        + f"prefer stay: drone[0]: always[0, 6 s] base weight {stay}\n"
        + f"prefer away: drone[0]: eventually[0, 6 s] goal weight {away}\n"
    )
    _, report = planned(text)
    assert kept(report) == {winner}


def test_a_preference_that_no_plan_keeps_costs_nothing_but_a_note() -> None:
    stay, calm = "prefer stay: drone[0]: always[0, 6 s] base\n", "prefer calm: drone[0]: eventually[0, 6 s] goal\n"
    _, report = planned(ONE + stay + calm)
    assert kept(report) == {"calm"}
    assert any(note.startswith("preference `stay` not satisfied: no plan on this roadmap") for note in report.notes)


@pytest.mark.slow
def test_a_shorter_way_is_found_where_distance_is_to_be_least() -> None:
    plain, _ = planned(FEW)
    short, report = planned(FEW + "minimize distance\n")
    assert travelled(short) <= travelled(plain)
    assert any("distance" in note for note in report.notes)


def test_an_early_end_is_found_where_duration_is_to_be_least() -> None:
    trace, report = planned(ONE + "minimize duration\n")
    moving = np.flatnonzero((np.abs(np.diff(trace.position, axis=1)) > 1e-9).any(axis=(0, 2)))
    assert moving.max() + 1 <= 2
    assert any("optimal on this roadmap" in note for note in report.notes)


FAR = """\
mission far
time step 1 s, horizon 12 s
world (0, 0) to (12, 6)
region base = box (0, 0) to (2, 6)
region goal = box (9, 0) to (12, 2)
obstacle wall = box (5, 0) to (6, 4)
team drone[1] { radius 0.1 m  dynamics single_integrator(speed <= 2 m/s)  start in base }
solve with smt { nodes = 20 }
require visit: drone[0]: eventually[0, 12 s] goal
minimize duration
"""


def test_other_roadmaps_are_asked_for_an_earlier_end() -> None:
    """The coarse roadmap that holds a plan first does not hold the soonest of these."""
    alone, _ = planned(FAR, seed=2, options=Options(brief=True))
    trace, report = planned(FAR, seed=2)
    assert trace.lasts < alone.lasts
    assert any(note.startswith("shortest of the plans on") for note in report.notes)


# ------------------------------------------- a plan that was found is not lost

PLACES = [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)]


@contextmanager
def found(
    objective: Objective, *preferences: Node
) -> Iterator[tuple[JointMotion, Callable[[], JointMotion], LazyConstraints]]:
    """A joint motion of two agents, what makes a better one of it, and the search it came from."""
    mission = replace(mission_of([PLACES[0]] * 2, 3, dynamics=SingleIntegrator(9.0)), objective=objective)
    case = asked(mission, (roadmap_of((0, 1), PLACES, 3),), *preferences)
    wishes = tuple(
        Goal(f"wish{number}", node, SPAN, float(len(preferences) - number)) for number, node in enumerate(preferences)
    )
    kernel = Kernel((), wishes)
    with case.search() as search:
        first = search.find(case.fixed([[0, 1, 2, 3], [1, 0, 3, 2]])[::5])
        assert isinstance(first, JointMotion)
        yield first, lambda: improve(first, kernel, case.lowered.goals, search), search


def moves(plan: JointMotion) -> int:
    return int((np.diff(plan.states, axis=1) != 0).sum())


@pytest.mark.parametrize(
    ("objective", "note"),
    [
        (Objective.DISTANCE, "too many clauses to search for a shorter plan"),
        (Objective.DURATION, "to search for fewer"),
    ],
)
def test_where_there_is_no_room_for_more_clauses_the_plan_is_no_worse(
    objective: Objective, note: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(
        "missionc.backends.smt.shorten.improve.shorten_paths", lambda states, *_: states
    )  # nothing is won before
    with found(objective) as (first, better, search):
        search.clauses.limit = search.clauses.count
        assert (better().states == first.states).all()
        assert any(said.endswith(note) for said in search.account.notes)


def test_a_preference_for_which_there_is_no_room_for_clauses_is_not_kept_and_the_plan_stays() -> None:
    left = Atom(Compare(((-1.0, Coordinate(0)), (1.0, Coordinate(1))), -0.5, False))  # of all places only the third
    right = Atom(Compare(((1.0, Coordinate(0)), (1.0, Coordinate(1))), -1.5, False))  # only the fourth
    through_each_other = All((At(0, left), At(1, right), At(0, Always(right, 1, 1)), At(1, Always(left, 1, 1))))
    with found(Objective.NONE, through_each_other) as (first, better, search):
        search.clauses.limit = search.clauses.count
        assert moves(better()) <= moves(first)
        assert search.account.notes == ["preference `wish0` not satisfied: the search ended early"]


def test_where_the_solver_dies_the_plan_is_the_one_found() -> None:
    for objective in (Objective.DISTANCE, Objective.DURATION):
        with found(objective, All(())) as (first, better, search):
            search.solvers.close()
            assert moves(better()) <= moves(first)
            assert search.account.notes[0] == "preference `wish0` not satisfied: the search ended early"
