"""A search cut short by the time limit or a signal while it has a plan: that plan is verified and written."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

pytest.importorskip("torch")

from missionc.backends.api import CutShort, NotFound, Progress, Reason
from missionc.base.signals import Stopped, defer_stop, stop_requested, stoppable
from missionc.base.source import Source
from missionc.base.units import Seconds
from missionc.cli import app, compile_request
from missionc.compiler import driver
from missionc.compiler.results import Compiled, Verified
from tests.support.small_missions import SMALL

ROOT = Path(__file__).resolve().parents[3]
ROW = """\
mission row
time step 0.4 s, horizon 4 s
world (0, 0) to (8, 6)
region base = box (0.5, 0.5) to (2.5, 2.5)
region goal = box (5, 3) to (7.5, 5.5)
team drone[2] { radius 0.1 m  dynamics single_integrator(speed <= 3 m/s)  start in base }
formation row = line of drone spacing 0.6 m tolerance 0.1 m
require visit: eventually[0, 4 s] every drone: goal
require row:   eventually[1.2 s, 2.8 s] row
prefer back:   eventually[3.2 s, 4 s] some drone: distance(goal) >= 0.3
minimize distance
"""
MIXED = ROW.replace("formation row", "graph radio = proximity 2 m\nformation row") + (
    "require near: every drone: always[0, 4 s] (goal implies somewhere[hops 0..1 on radio] (base or goal))\n"
)
COUNTED = SMALL + "minimize distance\n"
BACKENDS = [("clot", ROW, "improve"), ("hybrid", MIXED, "improve"), ("smt", COUNTED, "improve")]
LIMIT = 3600.0
"""Seconds: far more than any of these needs, so that their share in which a search has to end by itself is long too."""

Listener = Callable[[Progress], None]


def compiled(backend: str, text: str, listen: Listener, limit: float = LIMIT) -> Compiled:
    return driver.compile(Source("a.mission", text), backend=backend, time_limit=Seconds(limit), listen=listen)


def at(stage: str, then: Callable[[], None]) -> Listener:
    """Does something when a stage is heard of for the first time."""
    heard: list[str] = []

    def listen(progress: Progress) -> None:
        if progress.stage == stage and not heard:
            heard.append(stage)
            then()

    return listen


def time_is_up(monkeypatch: pytest.MonkeyPatch) -> None:
    """From here on the search is late, and what comes after it is not."""
    now = time.monotonic
    monkeypatch.setattr(time, "monotonic", lambda: now() + LIMIT - 0.05)


def interrupted() -> None:
    signal.raise_signal(signal.SIGINT)


@pytest.mark.parametrize(("backend", "text", "stage"), BACKENDS, ids=[name for name, _, _ in BACKENDS])
def test_ctrl_c_while_a_plan_is_made_better_gives_that_plan(backend: str, text: str, stage: str) -> None:
    with stoppable():
        outcome = compiled(backend, text, at(stage, interrupted)).outcome
        assert stop_requested()
    assert isinstance(outcome, Verified)
    assert outcome.certificate.passed
    assert outcome.report.cut_short is CutShort.SIGNAL
    assert json.loads(dict(outcome.files)["manifest.json"])["cut_short"] == "interruption"


@pytest.mark.parametrize(("backend", "text", "stage"), BACKENDS, ids=[name for name, _, _ in BACKENDS])
def test_the_time_limit_while_a_plan_is_made_better_gives_that_plan(
    backend: str, text: str, stage: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    outcome = compiled(backend, text, at(stage, lambda: time_is_up(monkeypatch))).outcome
    assert isinstance(outcome, Verified)
    assert outcome.report.cut_short is CutShort.TIME
    assert any("stopped early (time limit)" in note for note in outcome.report.notes)


def test_a_search_that_is_done_was_not_cut_short() -> None:
    outcome = compiled("clot", ROW, lambda _: None).outcome
    assert isinstance(outcome, Verified)
    assert outcome.report.cut_short is None
    assert json.loads(dict(outcome.files)["manifest.json"])["cut_short"] is None


@pytest.mark.parametrize(("backend", "text"), [("clot", ROW), ("hybrid", MIXED)])
def test_a_signal_before_there_is_a_plan_ends_the_run(backend: str, text: str) -> None:
    with pytest.raises(Stopped), stoppable():
        compiled(backend, text, at("sketch" if backend == "clot" else "discrete", interrupted))


def test_a_signal_that_a_library_makes_an_error_of_its_own_of_is_no_defect(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    def translating(*_: object, **__: object) -> None:
        try:
            interrupted()
        except BaseException as error:
            raise TypeError("cannot compare") from error

    monkeypatch.setattr("missionc.cli.commands.check.check", translating)
    (tmp_path / "row.mission").write_text(ROW)
    with pytest.raises(Stopped), stoppable():
        app.main(["check", str(tmp_path / "row.mission")])


def test_a_signal_while_a_plan_is_verified_does_not_lose_it() -> None:
    with stoppable():
        outcome = compiled("clot", ROW, at("verify", interrupted)).outcome
    assert isinstance(outcome, Verified)
    assert outcome.report.cut_short is None, "the search was over"


def test_the_time_limit_without_a_plan_is_no_plan() -> None:
    outcome = compiled("clot", ROW, lambda _: None, 0.0).outcome
    assert isinstance(outcome, NotFound)
    assert outcome.reason is Reason.TIME
    assert outcome.report.cut_short is None


def test_the_command_writes_the_plan_and_says_that_it_was_cut_short(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    @contextmanager
    def listening(*_: object) -> Iterator[Listener]:
        yield at("improve", interrupted)

    monkeypatch.setattr(compile_request, "shown", listening)
    monkeypatch.chdir(tmp_path)
    Path("row.mission").write_text(ROW)
    with stoppable():
        status = app.main(["compile", "row.mission", "--backend", "clot", "-o", "out", "--format", "json"])
    said = json.loads(capsys.readouterr().out)
    assert status == 0
    assert said["outcome"] == "planned"
    assert said["cut_short"] == "interruption"
    assert any("stopped early" in note for note in said["notes"])
    assert json.loads(Path("out/manifest.json").read_text())["cut_short"] == "interruption"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["out", "row.mission"]


def test_a_second_signal_ends_the_process_at_once() -> None:
    code = """\
import signal
from missionc.base.signals import defer_stop, stop_requested, stoppable
with stoppable():
    defer_stop()
    signal.raise_signal(signal.SIGINT)
    print(stop_requested(), flush=True)
    signal.raise_signal(signal.SIGINT)
    print("still here")
"""
    ended = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, timeout=60)
    assert (ended.returncode, ended.stdout) == (130, "True\n")


def test_a_signal_is_forgotten_at_the_end() -> None:
    with stoppable():
        defer_stop()
        interrupted()
        assert stop_requested()
    assert not stop_requested()
