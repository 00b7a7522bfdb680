"""Turns of several engines: counted in work, ended by the first plan, and by no refusal of roadmaps."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pytest

from missionc.backends import load
from missionc.backends.api import (
    Attempt,
    Backend,
    Budget,
    Impossible,
    NotFound,
    Outcome,
    Planned,
    Progress,
    Reason,
    Report,
    Turns,
)
from missionc.backends.options import Options
from missionc.backends.portfolio.backend import ATTEMPTS, FIRST, TIMES, Engine, PortfolioBackend
from missionc.backends.run_account import polish_work, run_to_end
from missionc.backends.smt import backend as smt
from missionc.base.diagnostics.code import EXTRA_MISSING, NOT_ITS_FLAG, NOT_VERIFIED
from missionc.base.diagnostics.model import Diagnostic
from missionc.base.source import Source
from missionc.base.trace import Trace
from missionc.base.units import Seconds
from missionc.compiler.driver import compile
from missionc.compiler.front_end import check
from missionc.compiler.results import Verified
from missionc.ir import Mission
from missionc.ir.kernel.nodes import Kernel
from tests.support.small_missions import SMALL

STILL = np.zeros((2, 7, 2))
TRACE = Trace(Seconds(1.0), STILL, STILL, STILL[..., 0])
PLAN = Planned(TRACE, Report(work=3.0))
REFUSED = Impossible(("visit",), "on roadmaps of 110 nodes `visit` cannot be satisfied", Report())
NOTHING = NotFound(Reason.SOLVER, "40 attempts found none", Report())
LATE = NotFound(Reason.TIME, "the best candidate violates `visit`", Report())
SMALL_CHECKED = check(Source("small.mission", SMALL))

ROUND_A_DISC = """
mission three
time step 1 s, horizon 8 s
world (0, 0) to (10, 10)
region   goal = box (7, 7) to (9, 9)
obstacle o    = disc at (5, 5) radius 1 m
team r[3] { radius 0.2 m  dynamics single_integrator(speed <= 1.5 m/s)  start at (1, 1), (1, 3), (3, 1) }
separation 0.2 m
require go: every r: eventually[0, 8 s] goal
"""


@dataclass
class Scripted:
    """An engine that pauses after each piece of work, and then answers; it tells a log of what it does."""

    name: str
    pieces: Sequence[float]
    answer: Outcome | type[MemoryError]
    log: list[str]
    wait: Callable[[], None] = lambda: None
    refutes: bool = False
    repeats: bool = False
    ended: list[str] = field(default_factory=list)

    def missing(self, options: Options) -> Diagnostic | None:
        return None

    def turns(self, mission: Mission, kernel: Kernel, options: Options, budget: Budget) -> Turns:
        work = 0.0
        try:
            yield work
            for piece in self.pieces:
                self.wait()
                budget.on_progress(Progress("working"))
                self.log.append(self.name)
                work += piece
                yield work
            if not isinstance(self.answer, Planned | Impossible | NotFound):
                raise self.answer
            return self.answer
        finally:
            self.ended.append(self.name)

    def plan(self, mission: Mission, kernel: Kernel, options: Options, budget: Budget) -> Outcome:
        return run_to_end(self.turns(mission, kernel, options, budget), budget)


def asked(*engines: Scripted, budget: Budget | None = None) -> Outcome:
    assert SMALL_CHECKED.mission is not None
    assert SMALL_CHECKED.kernel is not None

    def loaded(engine: Scripted) -> Callable[[], Backend]:
        return lambda: engine

    portfolio = PortfolioBackend([Engine(each.name, loaded(each), each.repeats) for each in engines])
    return portfolio.plan(SMALL_CHECKED.mission, SMALL_CHECKED.kernel, Options(), budget or Budget(deadline=1e12))


def turns_of(wait: Callable[[], None] = lambda: None) -> list[str]:
    log: list[str] = []
    one = Scripted("one", [FIRST / 2] * 20, PLAN, log, wait)
    other = Scripted("other", [FIRST] * 20, NOTHING, log, wait)
    assert isinstance(asked(one, other), Planned)
    return log


def test_turns_grow_and_are_counted_in_work() -> None:
    assert turns_of()[:11] == ["one"] * 2 + ["other"] + ["one"] * 2 + ["other"] + ["one"] * 4 + ["other"]


def test_a_loaded_machine_has_the_same_turns() -> None:
    pauses = iter([0.02, 0.0, 0.005] * 100)
    assert turns_of(lambda: time.sleep(next(pauses))) == turns_of()


def test_the_first_plan_ends_the_others_and_says_whose_it_is() -> None:
    log: list[str] = []
    idle = Scripted("last", [FIRST], PLAN, log)
    slow = Scripted("slow", [FIRST] * 99, NOTHING, log)
    found = asked(slow, Scripted("quick", [0.5, 0.5], PLAN, log), idle)
    assert isinstance(found, Planned)
    assert found.report.engine == "quick"
    assert [(each.engine, each.turns, each.says) for each in found.report.tried] == [
        ("slow", 1, "no plan in 1 attempt"),
        ("quick", 1, "plan found"),
        ("last", 0, "not run"),
    ]
    assert slow.ended == ["slow"]
    assert idle.ended == []


def test_a_refusal_of_roadmaps_ends_nothing() -> None:
    log: list[str] = []
    found = asked(Scripted("smt", [0.1], REFUSED, log), Scripted("clot", [1.0] * 2, PLAN, log))
    assert isinstance(found, Planned)
    assert found.report.engine == "clot"


def test_a_refusal_is_the_answer_once_the_others_had_their_attempts() -> None:
    log: list[str] = []
    found = asked(Scripted("smt", [0.1], REFUSED, log), Scripted("clot", [FIRST * 99] * 99, PLAN, log))
    assert isinstance(found, Impossible)
    assert found.conflict == ("visit",)
    assert found.report.engine == "smt"
    assert found.statement == f"{REFUSED.statement}; clot found no plan in {ATTEMPTS} attempts"
    assert log.count("clot") == ATTEMPTS


def test_a_refusal_that_took_long_gives_the_others_as_much_again_and_more() -> None:
    log: list[str] = []
    refused = Impossible(("visit",), "", Report(work=20.0))
    found = asked(Scripted("smt", [20.0], refused, log), Scripted("clot", [1.0] * 99, PLAN, log))
    assert isinstance(found, Impossible)
    assert log.count("clot") == TIMES * 20.0


def test_one_that_repeats_another_has_one_turn_and_none_after_a_refusal() -> None:
    log: list[str] = []
    slow = Scripted("clot", [FIRST] * 9, NOTHING, log)
    found = asked(slow, Scripted("hybrid", [FIRST / 2] * 99, PLAN, log, repeats=True))
    assert isinstance(found, NotFound)
    assert log.count("hybrid") == 2
    log.clear()
    found = asked(
        Scripted("smt", [0.1], REFUSED, log),
        Scripted("clot", [FIRST * 99] * 99, PLAN, log),
        Scripted("hybrid", [0.1] * 99, PLAN, log, repeats=True),
    )
    assert isinstance(found, Impossible)
    assert found.statement == f"{REFUSED.statement}; clot found no plan in {ATTEMPTS} attempts"
    assert "hybrid" not in log


def test_a_refusal_is_no_answer_where_time_ended_the_others() -> None:
    log: list[str] = []
    found = asked(Scripted("smt", [0.1], REFUSED, log), Scripted("clot", [0.1], LATE, log))
    assert isinstance(found, NotFound)
    assert found.reason is Reason.TIME
    assert found.statement == f"smt: {REFUSED.statement}; clot: {LATE.statement}"


def test_the_nearest_candidate_is_that_of_the_portfolio() -> None:
    assert SMALL_CHECKED.mission is not None
    log: list[str] = []
    far, near = (Attempt((), (), TRACE) for _ in range(2))
    first = Scripted("first", [9.0] * 3, NotFound(Reason.SOLVER, "gave up", Report()), log)
    other = Scripted("other", [9.0] * 3, NotFound(Reason.SOLVER, "nearly", Report(), near), log)
    found = asked(first, other)
    assert isinstance(found, NotFound)
    assert found.best is near is not far
    assert found.report.engine == "other"
    assert found.statement == "first: gave up; other: nearly"


def test_memory_that_runs_out_ends_one_engine() -> None:
    log: list[str] = []
    found = asked(Scripted("smt", [1.0], MemoryError, log), Scripted("clot", [9.0], PLAN, log))
    assert isinstance(found, Planned)
    found = asked(Scripted("smt", [1.0], MemoryError, log), Scripted("clot", [9.0], NOTHING, log))
    assert isinstance(found, NotFound)
    assert found.reason is Reason.MEMORY


def test_a_try_ends_with_its_work() -> None:
    log: list[str] = []
    engines = Scripted("one", [1.0] * 99, PLAN, log), Scripted("other", [1.0] * 99, PLAN, log)
    found = asked(*engines, budget=Budget(deadline=1e12, work=2 * FIRST))
    assert isinstance(found, NotFound)
    assert log.count("one") == log.count("other") == FIRST
    assert all(engine.ended for engine in engines)


def test_the_one_that_is_left_goes_on_within_the_work_of_the_try() -> None:
    log: list[str] = []
    found = asked(
        Scripted("one", [1.0], NOTHING, log),
        Scripted("other", [1.0] * 999, PLAN, log),
        budget=Budget(deadline=1e12, work=50.0),
    )
    assert isinstance(found, NotFound)
    assert 45 <= log.count("other") <= 51


def test_progress_names_the_engine_at_work() -> None:
    heard: list[str] = []
    budget = Budget(deadline=1e12, on_progress=lambda progress: heard.append(progress.engine))
    asked(Scripted("smt", [FIRST], REFUSED, []), Scripted("clot", [1.0], PLAN, []), budget=budget)
    assert heard == ["smt", "clot"]


@pytest.mark.parametrize("options", [Options(preset="search"), Options(device="cuda")])
def test_only_some_options_need_a_package(options: Options, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(load, "find_spec", lambda name: None)
    every = load.load_engines(("smt", "clot", "hybrid"))
    assert isinstance(every, PortfolioBackend)
    assert [each.name for each in every.engines] == ["smt", "clot", "hybrid"]
    nobody = load.load_engines(("smt", "clot", "hybrid"), options)
    assert isinstance(nobody, Diagnostic)
    assert nobody.code is EXTRA_MISSING


def test_a_flag_leaves_those_that_hear_of_it() -> None:
    hear = load.load_engines(("smt", "clot", "hybrid"), Options(preset="search"))
    assert isinstance(hear, PortfolioBackend)
    assert [each.name for each in hear.engines] == ["clot", "hybrid"]
    assert load.load_engines(("smt", "clot", "hybrid"), checkpoint=True) is load.load("clot")
    nobody = load.load_engines(("smt",), Options(preset="search"))
    assert isinstance(nobody, Diagnostic)
    assert nobody.code is NOT_ITS_FLAG


def turned(backend: Backend, grant: float, settings: dict[str, str] | None = None) -> tuple[Outcome, int]:
    """The outcome of turns of so many units each, and how many there were."""
    source = Source("small.mission", f"{SMALL}\nminimize distance\n")
    checked = check(source, overrides=settings)
    assert checked.mission is not None
    assert checked.kernel is not None
    turns = backend.turns(checked.mission, checked.kernel, Options(), Budget(time.monotonic() + 60))
    granted, count = next(turns), 0
    while True:
        granted, count = granted + grant, count + 1
        try:
            turns.send(granted)
        except StopIteration as ended:
            return ended.value, count


def test_roadmaps_wait_for_the_work_that_their_clauses_take() -> None:
    backend = load.load("smt")
    assert not isinstance(backend, Diagnostic)
    whole, short = (turned(backend, grant, {"smt.turn_clauses": "50"}) for grant in (100.0, 0.002))
    assert (whole[1], short[1] > 3) == (1, True)
    assert isinstance(whole[0], Planned)
    assert isinstance(short[0], Planned)
    np.testing.assert_array_equal(whole[0].trace.position, short[0].trace.position)


def test_a_search_agrees_with_itself_whatever_its_turns() -> None:
    backend = load.load("clot")
    assert not isinstance(backend, Diagnostic)
    whole, short = (turned(backend, grant)[0] for grant in (100.0, 0.01))
    assert isinstance(whole, Planned)
    assert isinstance(short, Planned)
    np.testing.assert_array_equal(whole.trace.position, short.trace.position)


def test_a_step_of_a_polish_is_more_work_where_lines_of_sight_go_past_more_shapes() -> None:
    link = "graph eye = {} 8 m\nrequire seen: always[0, 8 s] connected(eye)\n"
    wall = "obstacle wall = box (8, 0) to (8.2, 1)\n"
    worlds = [link.format("proximity"), link.format("sight"), link.format("sight") + wall]
    missions = [check(Source("three.mission", ROUND_A_DISC + more)).mission for more in worlds]
    links, sight, more = (polish_work(mission, 60) for mission in missions if mission is not None)
    assert links < sight < more


def test_what_roadmaps_do_not_hold_is_planned_all_the_same() -> None:
    first, again = (
        compile(Source("three.mission", ROUND_A_DISC + "solve with auto { nodes = 30 }\n"), time_limit=Seconds(60))
        for _ in range(2)
    )
    assert isinstance(first.outcome, Verified)
    assert isinstance(again.outcome, Verified)
    assert first.outcome.plan.backend == "clot"
    assert first.outcome.files == again.outcome.files
    assert [each.says for each in first.outcome.report.tried][1:] == ["plan found", "not run"]


def test_a_plan_that_is_not_verified_ends_only_the_engine_that_found_it(monkeypatch: pytest.MonkeyPatch) -> None:
    turns = type(smt.BACKEND).turns

    def planned_badly(self: smt.SmtBackend, *arguments: Any) -> Turns:
        found = yield from turns(self, *arguments)
        assert isinstance(found, Planned)
        found.trace.position[0, 3] += 5.0
        return found

    monkeypatch.setattr(type(smt.BACKEND), "turns", planned_badly)
    source = Source("small.mission", SMALL.replace("solve with smt", "solve with auto"))
    found = compile(source, time_limit=Seconds(60))
    assert isinstance(found.outcome, Verified)
    assert found.outcome.plan.backend != "smt"
    assert found.outcome.report.tried[0].engine == "smt"
    assert found.outcome.report.tried[0].says == "a plan that fails verification"
    assert [each.says for each in found.outcome.report.tried].count("plan found") == 1
    alone = compile(source, backend="smt", time_limit=Seconds(60))
    assert [each.code for each in alone.findings] == [NOT_VERIFIED]
