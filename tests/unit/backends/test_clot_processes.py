"""Work in several processes: the same bytes as in one, and whatever ends a child or its parent ends well."""

from __future__ import annotations

import math
import multiprocessing
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from functools import cache
from itertools import count
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

pytest.importorskip("torch")

from missionc.backends import load
from missionc.backends.api import Attempt, CutShort, NotFound, Progress, Reason, Report, ignore
from missionc.backends.clot import backend as clot
from missionc.backends.clot.backend import TransportRun
from missionc.backends.clot.run import parallel_attempts
from missionc.backends.clot.run.child_processes import Say, children
from missionc.backends.clot.run.run_state import Nearest, Reached
from missionc.backends.options import Options
from missionc.backends.smt.backend import SmtBackend
from missionc.base.continuous_time import ContinuousTime
from missionc.base.diagnostics.code import INTERNAL, NOT_ITS_FLAG, OUT_OF_MEMORY
from missionc.base.diagnostics.model import Diagnostic
from missionc.base.signals import stoppable
from missionc.base.source import Source
from missionc.base.units import Seconds
from missionc.cli import app
from missionc.compiler import driver
from missionc.compiler.results import Compiled, Verified
from tests.unit.backends.test_resume import NEVER, PAIR, files, words
from tests.unit.base.test_signals import alive
from tests.unit.base.test_signals import children as started_by
from tests.unit.cli.test_cut_short import MIXED, ROW

pytestmark = pytest.mark.usefixtures("coarse_covers")

ROOT = Path(__file__).resolve().parents[3]
GAP = """\
mission gap
time step 0.4 s, horizon 10 s
world (0, 0) to (10, 6)
region base = box (0.5, 2) to (2.5, 4)
region goal = box (7, 2) to (9.5, 4)
obstacle low  = box (4.5, 0) to (5.5, 2.7)
obstacle high = box (4.5, 3.3) to (5.5, 6)
team drone[4] { radius 0.15 m  dynamics single_integrator(speed <= 3 m/s)  start in base }
graph radio = proximity 1.5 m
require visit: eventually[0, 10 s] every drone: goal
require link:  always[0, 10 s] connected(radio)
formation row = line of drone spacing 0.6 m tolerance 0.1 m
require row:   eventually[0, 10 s] row
"""
"""The first schedule leads to no plan."""
ONCE = ContinuousTime.AT_STEPS
"""For missions whose plans do not hold between the steps: they are planned once, and not again for that."""


SEARCH_EVERY = 4
SEARCHED = {"clot.search_every": SEARCH_EVERY}
"""Settings by which the fourth attempt is a search."""


def compiled(
    text: str,
    processes: int,
    *,
    backend: str = "clot",
    preset: str = "sketch",
    samples: int | None = None,
    seed: int = 0,
    settings: dict[str, int] | None = None,
    listen: Callable[[Progress], None] = ignore,
    keep: Callable[[bytes], object] | None = None,
    resume: bytes | None = None,
    throughout: ContinuousTime = ContinuousTime.WANTED,
) -> Compiled:
    return driver.compile(
        Source("a.mission", text),
        settings=settings,
        backend=backend,
        seed=seed,
        options=Options(preset=preset, samples=samples, processes=processes),
        listen=listen,
        keep=keep,
        resume=resume,
        continuous_time=throughout,
        time_limit=Seconds(200.0),
    )


@cache
def gap_by_two() -> tuple[Compiled, tuple[Progress, ...]]:
    """The mission `GAP` compiled in two processes, and what was heard of it."""
    heard: list[Progress] = []
    return compiled(GAP, 2, listen=heard.append), tuple(heard)


@pytest.fixture
def no_early_plan(monkeypatch: pytest.MonkeyPatch) -> None:
    """No attempt finds a plan before the first that searches from the best schedule so far, which is the fourth."""
    judged = TransportRun.judged

    def strict(run, polished, made, begun):  # type: ignore[no-untyped-def]
        if run.account.sizes["attempts"] >= SEARCH_EVERY:
            return judged(run, polished, made, begun)
        come_to = clot.attempt(run.mission, run.kernel, made)
        came_of = (None, None) if begun is None else (begun.number, begun.motion)
        run.consider(Nearest(polished.control, float(run.account.sizes["attempts"] % 3), *came_of), come_to)
        return None

    monkeypatch.setattr(TransportRun, "judged", strict)


# --------------------------------------------------------------- the same bytes


@pytest.mark.parametrize(
    ("text", "options"),
    [(PAIR, {"preset": "search", "samples": 16}), (GAP, {}), (MIXED, {"backend": "hybrid", "throughout": ONCE})],
    ids=["pieces of a search", "attempts", "hybrid"],
)
def test_the_number_of_processes_changes_no_byte(text: str, options: dict[str, Any]) -> None:
    one, two, three = (compiled(text, processes, **options) for processes in (1, 2, 3))
    assert files(one) == files(two) == files(three)


def test_the_first_plan_of_this_mission_is_not_the_first_attempt() -> None:
    outcome = gap_by_two()[0].outcome
    assert isinstance(outcome, Verified)
    assert dict(outcome.report.sizes)["attempts"] == 2


@pytest.mark.usefixtures("no_early_plan")
def test_a_search_begins_from_the_best_of_the_attempts_made_at_once() -> None:
    one, two, three = (compiled(PAIR, processes, settings=SEARCHED) for processes in (1, 2, 3))
    assert files(one) == files(two) == files(three)
    assert isinstance(two.outcome, Verified)
    assert dict(two.outcome.report.sizes)["attempts"] == SEARCH_EVERY


@pytest.mark.usefixtures("no_early_plan")
@pytest.mark.parametrize(("before", "after"), [(2, 1), (1, 2)])
def test_a_run_may_be_taken_up_with_another_number_of_processes(before: int, after: int) -> None:
    kept: list[bytes] = []
    whole = compiled(PAIR, before, settings=SEARCHED, keep=kept.append)
    assert {words(each)["number"] for each in kept} == set(range(SEARCH_EVERY))
    for moment in (kept[1], kept[-2], kept[-1]):
        assert files(compiled(PAIR, after, settings=SEARCHED, resume=moment)) == files(whole)


@pytest.mark.usefixtures("no_early_plan")
def test_attempts_that_began_before_z3_refused_are_made_again_without_it(monkeypatch: pytest.MonkeyPatch) -> None:
    plan = SmtBackend.plan

    def refuse_the_second(backend, mission, kernel, options, budget):  # type: ignore[no-untyped-def]
        if budget.seed == 1:
            return NotFound(Reason.SOLVER, "it has had enough", Report())
        return plan(backend, mission, kernel, options, budget)

    monkeypatch.setattr(SmtBackend, "plan", refuse_the_second)
    alone = MIXED.replace("minimize distance\n", "")  # no other options are planned beside
    one, two, three = (compiled(alone, processes, backend="hybrid", throughout=ONCE) for processes in (1, 2, 3))
    assert files(one) == files(two) == files(three)
    for found in (one, two, three):
        assert isinstance(found.outcome, Verified)
        assert sum("it has had enough" in note for note in found.outcome.report.notes) == 1


def test_what_goes_on_in_children_is_heard_of() -> None:
    _, heard = gap_by_two()
    assert {(each.stage, each.round) for each in heard} >= {("polish", 1), ("polish", 2), ("improve", 2)}


# --------------------------------------------------------------- what a child does


def test_answers_come_with_the_place_of_their_piece() -> None:
    with children(2, lambda number, say: (os.getpid(), number * number), ignore) as workers:
        for pieces in (range(5), range(3)):
            found = dict(workers.answers(pieces))
            assert {place: square for place, (_, square) in found.items()} == {place: place**2 for place in pieces}
            assert os.getpid() not in {process for process, _ in found.values()}


def test_no_piece_is_drawn_before_a_child_is_idle() -> None:
    drawn: list[int] = []

    def pieces() -> Iterator[int]:
        for number in count():
            drawn.append(number)
            yield number

    with children(2, lambda number, say: number, ignore) as workers:
        next(workers.answers(pieces()))
    assert drawn == [0, 1]


def run_out_of_memory(number: int, say: Say) -> None:
    raise MemoryError


def be_killed(number: int, say: Say) -> None:
    os.kill(os.getpid(), signal.SIGKILL)


def fail(number: int, say: Say) -> None:
    raise ValueError(f"no {number}")


def leave(number: int, say: Say) -> None:
    os._exit(3)


@pytest.mark.parametrize("work", [run_out_of_memory, be_killed])
def test_a_child_without_memory_is_a_lack_of_memory(work: Callable[[int, Say], None]) -> None:
    with children(2, work, ignore) as workers, pytest.raises(MemoryError):
        dict(workers.answers(range(2)))


@pytest.mark.parametrize(
    ("work", "says"),
    [(fail, r"ValueError at test_clot_processes.py:\d+ in a child process: no 0"), (leave, "ended with status 3")],
)
def test_a_child_that_fails_says_how(work: Callable[[int, Say], None], says: str) -> None:
    with children(1, work, ignore) as workers, pytest.raises(RuntimeError, match=says):
        dict(workers.answers(range(1)))


def test_no_child_is_left_behind() -> None:
    with children(2, lambda number, say: os.getpid(), ignore) as workers:
        found = [process for _, process in workers.answers(range(2))]
        assert all(map(alive, found))
    assert not any(map(alive, found))


# ------------------------------------------------------------------- its ends


def test_a_killed_child_leaves_the_mission_undecided(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(TransportRun, "attempt", lambda run, number: os.kill(os.getpid(), signal.SIGKILL))
    found = compiled(ROW, 2)
    assert isinstance(found.outcome, NotFound)
    assert found.outcome.reason is Reason.MEMORY
    assert found.findings[-1].code is OUT_OF_MEMORY


def test_a_defect_in_a_child_is_a_coded_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(TransportRun, "attempt", lambda run, number: number // 0)
    (tmp_path / "row.mission").write_text(ROW)
    assert (
        app.main(["compile", str(tmp_path / "row.mission"), "--backend", "clot", "--processes", "2"])
        == app.Status.DEFECT
    )
    said = capsys.readouterr().err
    assert INTERNAL.name in said
    assert "ZeroDivisionError" in said
    assert "Traceback" not in said


@pytest.fixture
def slow_first(monkeypatch: pytest.MonkeyPatch) -> None:
    """The first attempt takes all the time there is."""
    attempt = TransportRun.attempt

    def slow(run: TransportRun, number: int) -> Reached | None:
        while number == 0 and run.in_time():
            time.sleep(0.05)
        return attempt(run, number)

    monkeypatch.setattr(TransportRun, "attempt", slow)


@pytest.fixture
def end_time(monkeypatch: pytest.MonkeyPatch) -> Callable[[], None]:
    """Puts the clock past every deadline, in the children too, when it is called."""
    ended = multiprocessing.get_context("fork").Event()
    clock = SimpleNamespace(monotonic=lambda: math.inf if ended.is_set() else time.monotonic())
    monkeypatch.setattr(clot, "time", clock)
    return ended.set


@pytest.mark.usefixtures("slow_first")
def test_when_time_is_up_the_plan_of_a_later_attempt_is_the_best_so_far(
    end_time: Callable[[], None], monkeypatch: pytest.MonkeyPatch
) -> None:
    hold = parallel_attempts.defer_stop

    def hold_until_the_end() -> None:
        hold()
        end_time()

    monkeypatch.setattr(parallel_attempts, "defer_stop", hold_until_the_end)
    outcome = compiled(PAIR, 2, settings=SEARCHED).outcome
    assert isinstance(outcome, Verified)
    assert outcome.report.cut_short is CutShort.TIME


@pytest.mark.usefixtures("slow_first")
def test_a_signal_ends_the_wait_for_an_earlier_attempt(monkeypatch: pytest.MonkeyPatch) -> None:
    hold = parallel_attempts.defer_stop

    def hold_and_interrupt() -> None:
        hold()
        signal.raise_signal(signal.SIGINT)

    monkeypatch.setattr(parallel_attempts, "defer_stop", hold_and_interrupt)
    with stoppable():
        outcome = compiled(PAIR, 2, settings=SEARCHED).outcome
    assert isinstance(outcome, Verified)
    assert outcome.report.cut_short is CutShort.SIGNAL


def test_without_a_plan_the_time_limit_gives_the_best_candidate(
    end_time: Callable[[], None], monkeypatch: pytest.MonkeyPatch
) -> None:
    consider = TransportRun.consider

    def consider_the_last(run: TransportRun, nearest: Nearest, come_to: Attempt) -> None:
        consider(run, nearest, come_to)
        end_time()

    monkeypatch.setattr(TransportRun, "consider", consider_the_last)
    outcome = compiled(NEVER, 2).outcome
    assert isinstance(outcome, NotFound)
    assert outcome.reason is Reason.TIME
    assert outcome.best is not None


@pytest.fixture(params=["sketch", pytest.param("search", marks=pytest.mark.slow)])
def busy(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[subprocess.Popen[str]]:
    """A compilation: the process that does the work has two children."""
    (tmp_path / "never.mission").write_text(NEVER)
    command = ["compile", "never.mission", "-o", "out", "--backend", "clot", "--processes", "2"]
    process = subprocess.Popen(
        [sys.executable, "-m", "missionc", *command, "--preset", request.param],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    while process.poll() is None and len(started_by(process.pid)) < 3:
        time.sleep(0.05)
    yield process
    process.kill()
    process.wait()


def gone(processes: list[int]) -> bool:
    """Whether all of them are, soon."""
    for _ in range(100):
        if not any(map(alive, processes)):
            return True
        time.sleep(0.1)
    return False


in_proc = pytest.mark.skipif(not Path("/proc/self/task").exists(), reason="children are looked up in /proc")


@in_proc
@pytest.mark.parametrize(("number", "status"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_a_signal_ends_the_children_too(busy: subprocess.Popen[str], number: signal.Signals, status: int) -> None:
    started = started_by(busy.pid)
    assert len(started) == 3
    for process in (busy.pid, *(started if number is signal.SIGINT else ())):  # a terminal sends Ctrl-C to all
        os.kill(process, number)
    out, err = busy.communicate(timeout=30)
    assert (busy.returncode, out, err) == (status, "", "")
    assert gone(started)


@in_proc
def test_children_do_not_outlive_a_parent_that_is_killed(busy: subprocess.Popen[str]) -> None:
    started = started_by(busy.pid)
    busy.kill()
    out, err = busy.communicate(timeout=30)
    assert (out, err) == ("", "")
    assert gone(started)


# ---------------------------------------------------------------- where it is of no use


def test_the_flag_is_refused_where_the_mission_goes_to_the_other_backend() -> None:
    finding = load.load("smt", Options(processes=2))
    assert isinstance(finding, Diagnostic)
    assert finding.code is NOT_ITS_FLAG
    assert finding.message.startswith("`--processes 2` is for")
