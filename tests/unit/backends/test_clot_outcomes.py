"""What the transport backend answers: plans, the same for a seed, and what it says where it finds none."""

from __future__ import annotations

import json
import time

import numpy as np
import pytest

pytest.importorskip("torch")

from missionc.backends.acceptance import attempt
from missionc.backends.api import Budget, NotFound, Planned, Progress, Reason, Report, Turns
from missionc.backends.clot import backend as transport
from missionc.backends.options import Options
from missionc.base.source import Source
from missionc.base.trace import Trace
from missionc.base.units import Seconds
from missionc.cli.summary import attempt_lines, compiled_document, compiled_lines
from missionc.compiler import driver
from missionc.compiler.relax import search_relaxations
from missionc.compiler.relax.search_relaxations import near_miss
from missionc.compiler.results import Blame, Compiled, Verified
from missionc.ir import Mission
from missionc.ir.kernel.nodes import Kernel
from tests.support.small_missions import SMALL
from tests.support.transport_missions import checked

pytestmark = pytest.mark.usefixtures("coarse_covers")

TOGETHER = """\
mission together
time step 0.2 s, horizon 4 s
world (0, 0) to (8, 6)
region base = box (0.5, 0.5) to (2.5, 2.5)
region goal = box (5, 3) to (7.5, 5.5)
obstacle rock = disc at (3.8, 2.8) radius 0.5
team drone[3] { radius 0.1 m  dynamics single_integrator(speed <= 3 m/s)  start in base }
graph radio = proximity 1.2 m
formation row = line of drone spacing 0.6 m tolerance 0.1 m
require visit: eventually[0, 4 s] every drone: goal
require link:  always[0, 4 s] connected(radio)
require row:   eventually[1 s, 3 s] always[0, 0.4 s] row
"""


def compiled(text: str, *, limit: float = 120.0, seed: int = 0, backend: str = "clot", schedules: int = 40) -> Compiled:
    source, settings = Source("a.mission", text), {"clot.schedules": schedules}
    return driver.compile(source, backend=backend, seed=seed, time_limit=Seconds(limit), settings=settings)


def verified(text: str, **options: int) -> Verified:
    outcome = compiled(text, **options).outcome
    assert isinstance(outcome, Verified), outcome
    return outcome


def test_a_formation_mission_becomes_a_verified_plan() -> None:
    outcome = verified(TOGETHER)
    assert outcome.certificate.passed
    assert outcome.plan.backend == "clot"


def test_the_same_seed_gives_the_same_bytes_and_another_another_plan() -> None:
    first, again, other = verified(TOGETHER), verified(TOGETHER), verified(TOGETHER, seed=1)
    assert first.files == again.files
    assert not np.array_equal(first.plan.trace.position, other.plan.trace.position)


def test_second_order_agents_are_planned_within_their_limits() -> None:
    text = TOGETHER.replace(
        "single_integrator(speed <= 3 m/s)", "double_integrator(speed <= 3 m/s, acceleration <= 6 m/s^2)"
    )
    assert verified(text).certificate.passed


def test_a_volume_and_an_obstacle_that_moves_are_planned() -> None:
    text = """\
mission above
time step 0.2 s, horizon 4 s
world (0, 0, 0) to (6, 4, 3)
region base = box (0.5, 0.5, 0.5) to (1.5, 3.5, 1.5)
region top  = box (4, 1, 2) to (5.5, 3, 2.8)
obstacle cart = box (2.5, 0, 0) to (3, 1, 3) moving (0 m/s, 0.5 m/s, 0 m/s)
team kite[2] { radius 0.1 m  dynamics single_integrator(speed <= 3 m/s)  start in base }
require up: every kite: eventually[0, 4 s] top
"""
    assert verified(text).certificate.passed


def test_a_preference_is_kept_where_it_can_be_and_noted_where_not() -> None:
    outcome = verified(
        TOGETHER
        + "prefer back: eventually[3 s, 4 s] some drone: distance(goal) >= 0.5 weight 2\n"
        + "prefer away: eventually[0, 4 s] every drone: distance(goal) >= 20 weight 1\n"
    )
    assert "preference `back` satisfied" in outcome.report.notes
    assert any(note.startswith("preference `away` not satisfied") for note in outcome.report.notes)


@pytest.mark.parametrize("objective", ["distance", "energy"])
def test_an_objective_is_no_worse_than_without_it(objective: str) -> None:
    def measure(found: Verified) -> float:
        trace = found.plan.trace
        if objective == "distance":
            return float(np.linalg.norm(np.diff(trace.position, axis=1), axis=-1).sum())
        return float((np.diff(trace.velocity, axis=1) ** 2).sum())

    assert measure(verified(TOGETHER + f"minimize {objective}\n")) <= measure(verified(TOGETHER)) + 1e-9


def test_a_mission_of_the_roadmap_paper_is_planned_here_too() -> None:
    assert verified(SMALL.replace("solve with smt { nodes = 40 }\n", "")).certificate.passed


def test_what_is_not_found_is_undecided_and_says_where_the_best_fails() -> None:
    text = TOGETHER + "require never: always[0, 4 s] (not row or distance(drone[0], drone[1]) >= 2)\n"
    found = compiled(text, limit=6.0, schedules=1)
    assert isinstance(found.outcome, NotFound)
    assert found.outcome.reason in (Reason.TIME, Reason.SOLVER)
    assert "the best candidate violates" in found.outcome.statement
    assert "impossible" not in found.findings[-1].message


def test_without_the_package_of_algorithm_2_no_attempt_searches_and_a_note_says_so(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(transport, "find_spec", lambda name: None)
    text = TOGETHER + "require never: always[0, 4 s] (not row or distance(drone[0], drone[1]) >= 2)\n"
    settings = {"clot.schedules": "2", "clot.search_every": "2", "clot.attempts.polish": "2"}
    mission, kernel = checked(text, settings=settings)
    outcome = transport.BACKEND.plan(mission, kernel, Options(), Budget(time.monotonic() + 600))
    assert isinstance(outcome, NotFound)
    assert [each for each in outcome.report.notes if "Algorithm 2 needs `pip install 'missionc[clot]'`" in each]
    assert dict(outcome.report.seconds).keys().isdisjoint({"search"})


def test_the_best_candidate_is_told_requirement_by_requirement() -> None:
    text = TOGETHER + "require never: always[0, 4 s] (not row or distance(drone[0], drone[1]) >= 2)\n"
    found = compiled(text, schedules=1)
    assert isinstance(found.outcome, NotFound)
    best = found.outcome.best
    assert best is not None
    assert not best.is_plan
    assert [each.name for each in best.requirements] == ["visit", "link", "row", "never"]
    failing = [each for each in best.requirements if not each.satisfied]
    assert all(each.robustness <= 0 and each.step is not None for each in failing)
    assert all(f"`{each.name}`" in found.outcome.statement for each in failing)
    lines = compiled_lines(found, "", Seconds(1.0), verbose=True)
    assert lines[0] == "together: closest infeasible candidate"
    assert [line.split()[0] for line in lines[1:5]] == ["visit", "link", "row", "never"]
    document = compiled_document(found, "", [])
    assert document["outcome"] == "undecided"
    assert document["best_attempt"] == {
        "requirements": [
            {
                "name": each.name,
                "satisfied": each.satisfied,
                "robustness": each.robustness,
                "step": each.step,
                "agents": list(each.agents),
            }
            for each in best.requirements
        ],
        "faults": [
            {
                "what": each.what,
                "margin": each.margin,
                "unit": each.unit,
                "step": each.step,
                "agents": list(each.agents),
            }
            for each in best.worst_faults()
        ],
    }


def test_what_would_do_is_tried_for_the_best_candidate_and_nobody_is_blamed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(search_relaxations, "SEARCHED", 0.5)
    text = TOGETHER + "require never: always[0, 4 s] (not row or distance(drone[0], drone[1]) >= 2)\n"
    found = driver.compile(
        Source("a.mission", text), backend="clot", explain_limit=Seconds(8), settings={"clot.schedules": 1}
    )
    assert isinstance(found.outcome, NotFound)
    assert found.outcome.best is not None
    assert found.explained is not None
    assert found.explained.blame is Blame.UNKNOWN
    said = [relaxation.says for relaxation in found.explained.relaxations]
    assert set(said) & {"without `never`", "without `row`"}
    named = str(found.findings[-1].help).partition("apply the smallest change that works")[2]
    assert named.removeprefix(" without loosening safety") == f": {said[0]}"
    assert not any("impossible" in line for line in compiled_lines(found, "", Seconds(1.0), verbose=True))
    missed = found.explained.near_miss
    assert missed is not None
    assert not missed.attempt.is_plan
    assert dict(found.files).keys() >= {"near_miss.json", "near_miss.html"}
    document = compiled_document(found, "", [])
    assert [each["change"] for each in document["relaxations"]] == said  # type: ignore[attr-defined]
    assert document["near_miss"]["violates"]  # type: ignore[index]


def on_the_rock(mission: Mission) -> Trace:
    """All three of `TOGETHER` in one place, where nobody may be."""
    shape = 3, mission.steps + 1
    return Trace(mission.step, np.full((*shape, 2), (3.8, 2.8)), np.zeros((*shape, 2)), np.zeros(shape))


def test_a_candidate_that_breaks_much_is_drawn_where_no_motion_breaks_one_requirement_alone() -> None:
    checked = driver.check(Source("a.mission", TOGETHER), backend="clot")
    mission, kernel = checked.mission, checked.kernel
    assert mission is not None
    assert kernel is not None
    best = attempt(mission, kernel, on_the_rock(mission))
    missed = near_miss(checked, "clot", 0, [], best)
    assert missed is not None
    assert missed.attempt is best
    document = json.loads(dict(missed.files)["near_miss.json"])
    assert document["planned_for"] is None
    assert [each["name"] for each in document["violates"]] == [each.name for each in best.violated]
    assert {each["what"] for each in document["faults"]} == {"its start", "an obstacle", "separation"}
    assert f"and {len(best.shown) - 1} more".encode() in dict(missed.files)["near_miss.svg"]
    assert near_miss(checked, "clot", 0, []) is None


def test_a_search_leaves_time_to_explain_what_it_did_not_find(monkeypatch: pytest.MonkeyPatch) -> None:
    told: list[float] = []

    def hurried(
        self: transport.ClotBackend, mission: Mission, kernel: Kernel, options: Options, budget: Budget
    ) -> Turns:
        yield 0.0
        told.append(budget.deadline - time.monotonic())
        return NotFound(Reason.TIME, "the time limit was reached", Report())

    monkeypatch.setattr(transport.ClotBackend, "turns", hurried)
    for limit in (0.0, 10.0, 1000.0):
        driver.compile(
            Source("a.mission", TOGETHER), backend="clot", time_limit=Seconds(100), explain_limit=Seconds(limit)
        )
    whole, less, least = told
    assert 8 < whole - less < 12
    assert 23 < whole - least < 27


def test_what_else_a_candidate_breaks_is_told_once_for_each_kind() -> None:
    checked = driver.check(Source("a.mission", TOGETHER), backend="clot")
    mission, kernel = checked.mission, checked.kernel
    assert mission is not None
    assert kernel is not None
    best = attempt(mission, kernel, on_the_rock(mission))
    assert not best.is_plan
    assert best.wrong == len(best.faults) + sum(not each.satisfied for each in best.requirements)
    assert {fault.what for fault in best.worst_faults()} == {"its start", "an obstacle", "separation"}
    lines = attempt_lines("together", best, mission.step)
    assert [line for line in lines if line.startswith("  separation")] == [
        "  separation   violated  margin -0.200 m  at 0 s (drone[0], drone[1])"
    ]


def test_a_search_without_any_candidate_has_none_to_tell_of() -> None:
    found = compiled(TOGETHER, limit=0.0)
    assert isinstance(found.outcome, NotFound)
    assert found.outcome.best is None
    assert compiled_document(found, "", [])["best_attempt"] is None
    assert compiled_lines(found, "", Seconds(1.0), verbose=True) == []


def test_the_listener_hears_attempt_iteration_and_the_best_margin_so_far() -> None:
    heard: list[Progress] = []
    text = TOGETHER + "require never: always[0, 4 s] (not row or distance(drone[0], drone[1]) >= 2)\n"
    driver.compile(Source("a.mission", text), backend="clot", listen=heard.append, settings={"clot.schedules": 2})
    first = [each.iteration for each in heard if (each.stage, each.round) == ("polish", 1)]
    assert first == list(range(1, len(first) + 1))
    assert first
    later = [each.margin for each in heard if each.round > 1 and each.stage in ("sketch", "polish")]
    assert later
    assert all(margin is not None for margin in later)
    sketches = [each.margin for each in heard if each.stage == "sketch" and each.margin is not None]
    assert sketches == sorted(sketches), "the best so far never gets worse"


def test_no_time_is_an_answer_and_not_a_plan() -> None:
    found = compiled(TOGETHER, limit=0.0)
    assert isinstance(found.outcome, NotFound)
    assert found.outcome.reason is Reason.TIME


def test_the_backend_is_asked_and_not_believed() -> None:
    checked = driver.check(Source("a.mission", TOGETHER), backend="clot")
    from missionc.backends.api import Budget
    from missionc.backends.clot.backend import BACKEND

    assert checked.mission is not None
    assert checked.kernel is not None
    outcome = BACKEND.plan(checked.mission, checked.kernel, Options(), Budget(time.monotonic() + 60))
    assert isinstance(outcome, Planned)
