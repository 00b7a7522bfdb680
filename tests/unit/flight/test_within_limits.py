"""The limits of time and memory hold for every stage of a compilation, and not for its search alone."""

from __future__ import annotations

import json
import signal
import sys
import threading
import time
from collections.abc import Callable
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import NoReturn

import numpy as np
import pytest

from missionc.backends.api import Budget, CutShort, NotFound, Outcome, Planned, Reason
from missionc.backends.options import Options
from missionc.backends.smt.backend import BACKEND
from missionc.base import memory
from missionc.base.deadline import OutOfTime, interrupted_at, last_call
from missionc.base.source import Source
from missionc.base.units import Seconds
from missionc.compiler import certify_plan, driver, front_end, plan_with_margin
from missionc.compiler.results import Compiled, Verified
from missionc.compiler.run_limited import Ended, within
from missionc.ir import Mission
from missionc.ir.kernel.nodes import Kernel
from tests.support.one_turn import OneTurn
from tests.support.small_missions import SMALL

SHORT = Seconds(0.5)
FAR = 3600.0
linux = pytest.mark.skipif(sys.platform != "linux", reason="only Linux limits the memory of a process")


def endless(*_: object, **__: object) -> NoReturn:
    """Work that looks at no clock."""
    while True:
        sum(range(1000))


def greedy(*_: object, **__: object) -> NoReturn:
    """Work that takes all memory there is."""
    held = []
    while True:
        held.append(np.ones(1 << 22))


def compiled(limit: Seconds = SHORT, memory_limit: int = 1 << 30) -> Compiled:
    return driver.compile(Source("a.mission", SMALL), backend="smt", time_limit=limit, memory_limit=memory_limit)


def test_work_that_looks_at_no_clock_is_interrupted() -> None:
    assert within(time.monotonic() + 0.05, endless) == Ended(Reason.TIME)


def test_work_that_is_done_in_time_is_not() -> None:
    assert within(time.monotonic() + FAR, lambda: 7) == 7
    assert signal.getitimer(signal.ITIMER_REAL)[0] < FAR / 2, "nothing is left to go off"


def test_the_earlier_of_two_limits_comes_first_and_the_later_one_still_holds() -> None:
    begin = time.monotonic()

    def work() -> NoReturn:
        assert within(begin + 0.05, endless) == Ended(Reason.TIME)
        with interrupted_at(begin + FAR):
            endless()

    with pytest.raises(OutOfTime), interrupted_at(begin + 0.1):
        work()


def test_an_interruption_that_a_destructor_swallows_comes_again(monkeypatch: pytest.MonkeyPatch) -> None:
    class Deaf:
        def __del__(self) -> None:
            endless()

    monkeypatch.setattr("missionc.base.deadline.AGAIN", 0.05)
    monkeypatch.setattr(sys, "unraisablehook", lambda _: None)

    def work() -> NoReturn:
        deaf = Deaf()
        del deaf
        endless()

    assert within(time.monotonic() + 0.05, work) == Ended(Reason.TIME)


def comparing() -> NoReturn:
    """Work for which numpy calls Python, and makes a ``TypeError`` of whatever is raised there."""
    rows = np.zeros(2, dtype=[(f"f{number}", float) for number in range(1000)])
    while True:
        bool(np.all(rows[1:] != rows[:-1]))


def translating() -> NoReturn:
    """Work that always makes an error of its own of what interrupts it."""
    try:
        endless()
    except BaseException as error:
        raise TypeError("cannot compare") from error


@pytest.mark.parametrize("work", [comparing, translating])
def test_an_interruption_that_a_library_makes_an_error_of_its_own_of_is_still_one(work: Callable[[], NoReturn]) -> None:
    for _ in range(5):
        assert within(time.monotonic() + 0.02, work) == Ended(Reason.TIME)


def test_an_error_before_the_interruption_is_an_error() -> None:
    def work() -> NoReturn:
        raise TypeError("cannot compare")

    with pytest.raises(TypeError, match="cannot compare"):
        within(time.monotonic() + FAR, work)


def test_in_another_thread_nothing_is_interrupted() -> None:
    found: list[object] = []
    thread = threading.Thread(target=lambda: found.append(within(time.monotonic() - 1, lambda: sum(range(10_000)))))
    thread.start()
    thread.join()
    assert found == [sum(range(10_000))]


@pytest.mark.parametrize(
    ("module", "name", "stage"),
    [
        (driver, "check", "while checking the mission"),
        (plan_with_margin, "tightened", "while encoding the mission"),
        (driver, "certify_plan", ""),
    ],
    ids=["check", "search", "bring home"],
)
@pytest.mark.parametrize(
    ("work", "reason"),
    [(endless, Reason.TIME), pytest.param(greedy, Reason.MEMORY, marks=linux)],
    ids=["time", "memory"],
)
def test_a_limit_that_comes_in_any_stage_is_undecided_and_what_took_the_memory_is_named(
    module: object,
    name: str,
    stage: str,
    work: Callable[..., NoReturn],
    reason: Reason,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(plan_with_margin, "tracking_margin", lambda _: 0.1)
    monkeypatch.setattr(module, name, work)
    result = compiled(SHORT if reason is Reason.TIME else Seconds(60.0))
    assert isinstance(result.outcome, NotFound)
    assert result.outcome.reason is reason
    assert [each.code.name for each in result.findings] == ["MC602" if reason is Reason.TIME else "MC603"]
    assert reason is Reason.TIME or stage in result.outcome.statement
    assert not result.files


def test_a_plan_that_cannot_be_written_in_time_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(driver, "certify_plan", endless)
    result = compiled(Seconds(3.0))
    assert isinstance(result.outcome, NotFound)
    assert "a plan was found" in result.outcome.statement


@pytest.mark.parametrize(
    ("work", "reason"),
    [(endless, CutShort.TIME), pytest.param(greedy, CutShort.MEMORY, marks=linux)],
    ids=["time", "memory"],
)
def test_a_search_that_is_interrupted_gives_the_last_plan_it_had(
    work: Callable[..., NoReturn], reason: CutShort, monkeypatch: pytest.MonkeyPatch
) -> None:
    plan = BACKEND.plan

    class Dawdling(OneTurn):
        name, refutes = "smt", True

        def plan(self, mission: Mission, kernel: Kernel, options: Options, budget: Budget) -> Outcome:
            found = plan(mission, kernel, options, replace(budget, deadline=time.monotonic() + FAR))
            assert isinstance(found, Planned)
            budget.on_incumbent(found)
            work()

    monkeypatch.setattr(driver, "load_backend", lambda *_: Dawdling())
    limit = 2.0 if reason is CutShort.TIME else FAR
    monkeypatch.setattr(driver, "within", lambda _, work: within(time.monotonic() + limit, work))
    outcome = compiled(Seconds(60.0)).outcome
    assert isinstance(outcome, Verified)
    assert outcome.report.cut_short is reason
    assert f"the search stopped early ({reason.value})" in " ".join(outcome.report.notes)
    assert json.loads(dict(outcome.files)["manifest.json"])["cut_short"] == reason.value


def test_a_backend_that_hears_of_the_memory_itself_keeps_its_last_plan_too(monkeypatch: pytest.MonkeyPatch) -> None:
    plan = BACKEND.plan

    class Sated(OneTurn):
        name, refutes = "smt", True

        def plan(self, mission: Mission, kernel: Kernel, options: Options, budget: Budget) -> Outcome:
            found = plan(mission, kernel, options, budget)
            assert isinstance(found, Planned)
            budget.on_incumbent(found)
            return NotFound(Reason.MEMORY, "there is no room for a better one", found.report)

    monkeypatch.setattr(driver, "load_backend", lambda *_: Sated())
    outcome = compiled(Seconds(60.0)).outcome
    assert isinstance(outcome, Verified)
    assert outcome.report.cut_short is CutShort.MEMORY


def test_time_is_kept_back_for_what_comes_after_a_search() -> None:
    assert (
        certify_plan.reserved_time(2, 10, 100.0)
        < certify_plan.reserved_time(20, 10, 100.0)
        < certify_plan.reserved_time(20, 100, 100.0)
    )
    assert certify_plan.reserved_time(10_000, 10_000, 8.0) == 2.0
    assert certify_plan.reserved_time(2, 10, -1.0) == 0.0


def test_a_search_that_is_late_has_a_moment_to_end_by_itself() -> None:
    now = time.monotonic()
    assert 0 < last_call(now + 10) - (now + 10) < 1 + 0.05 * 10


@linux
def test_a_size_that_there_is_no_room_for_is_refused_before_it_is_taken() -> None:
    with memory.limited(1 << 28):
        memory.reserve(1 << 20, "a few numbers")
        with pytest.raises(MemoryError, match=r"^the stars of the sky need about 1 GB; \S+ MB are available$"):
            memory.reserve(1 << 30, "the stars of the sky")
    memory.reserve(1 << 50, "where nothing is limited they")


@linux
def test_as_many_copies_of_a_process_are_made_as_there_is_room_for() -> None:
    own = memory.held()
    assert memory.copies(256) == 256, "without a limit"
    with memory.limited(1 << 30):
        assert memory.copies(1) == 1
        assert 1 <= memory.copies(10**9) <= (memory.ROOM + (2 << 30)) // own + 1


@linux
def test_too_many_steps_for_a_roadmap_are_refused_by_size() -> None:
    checked = front_end.check(Source("a.mission", SMALL), backend="smt")
    assert checked.mission is not None
    assert checked.kernel is not None
    long = replace(checked.mission, steps=2_000_000)
    with memory.limited(1 << 28):
        outcome = BACKEND.plan(long, checked.kernel, Options(), Budget(time.monotonic() + 60))
    assert isinstance(outcome, NotFound)
    assert outcome.reason is Reason.MEMORY
    assert outcome.statement.startswith("2000000 steps among ")


def test_an_import_is_not_interrupted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "slow_to_load.py").write_text("import time\nwhile time.monotonic() < END:\n    pass\nLOADED = True\n")
    begin = time.monotonic()
    monkeypatch.setattr("builtins.END", begin + 0.3, raising=False)
    monkeypatch.syspath_prepend(str(tmp_path))
    loaded: list[bool] = []

    def work() -> NoReturn:
        loaded.append(import_module("slow_to_load").LOADED)
        endless()

    assert within(begin + 0.05, work) == Ended(Reason.TIME)
    assert loaded == [True]
