"""Ctrl-C, SIGTERM and SIGHUP: the right status, nothing half-written, nobody left behind."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from missionc.base.deadline import OutOfTime
from missionc.base.signals import Stopped, stoppable
from tests.support.busy_processes import HARD, alive, children

ROOT = Path(__file__).resolve().parents[3]


@pytest.fixture
def busy(tmp_path: Path) -> Iterator[subprocess.Popen[str]]:
    """A compilation whose solver is at work, in a child of the process that does the work."""
    (tmp_path / "hard.mission").write_text(HARD)
    process = subprocess.Popen(
        [sys.executable, "-m", "missionc", "compile", "hard.mission", "-o", "out/hard"],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    while process.poll() is None and len(children(process.pid)) < 2:
        time.sleep(0.05)
    yield process
    process.kill()
    process.wait()


@pytest.mark.skipif(not Path("/proc/self/task").exists(), reason="children are looked up in /proc")
@pytest.mark.parametrize(("number", "status"), [(signal.SIGINT, 130), (signal.SIGTERM, 143), (signal.SIGHUP, 129)])
def test_a_signal_ends_the_solver_too_and_leaves_nothing(
    busy: subprocess.Popen[str], tmp_path: Path, number: signal.Signals, status: int
) -> None:
    started = children(busy.pid)
    assert len(started) >= 2, "the solver runs in no child process"
    busy.send_signal(number)
    out, err = busy.communicate(timeout=30)
    assert busy.returncode == status
    assert out == ""
    assert "Traceback" not in err
    assert [process for process in started if alive(process)] == []
    assert [path.name for path in tmp_path.rglob("*")] == ["hard.mission"]


def test_the_first_signal_is_an_exception_with_the_exit_status() -> None:
    before = signal.getsignal(signal.SIGTERM)
    with pytest.raises(Stopped) as stopped, stoppable():
        signal.raise_signal(signal.SIGTERM)
    assert stopped.value.status == 143
    assert signal.getsignal(signal.SIGTERM) is before


@pytest.mark.parametrize("interruption", [Stopped(signal.SIGTERM), OutOfTime()])
def test_an_interruption_that_a_destructor_swallows_is_not_reported(
    interruption: BaseException, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Deaf:
        def __init__(self, error: BaseException) -> None:
            self.error = error

        def __del__(self) -> None:
            raise self.error

    reported: list[object] = []
    monkeypatch.setattr(sys, "unraisablehook", lambda unraisable: reported.append(unraisable.exc_type))
    with stoppable():
        Deaf(interruption)
        Deaf(ValueError())
    assert reported == [ValueError]


def test_what_mends_errors_does_not_catch_a_signal() -> None:
    assert not issubclass(Stopped, Exception)


def ran(code: str) -> subprocess.CompletedProcess[str]:
    """A program of its own, that has a few seconds to end by itself."""
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    return subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, timeout=60)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_signal_that_code_swallows_ends_the_process_all_the_same(number: signal.Signals) -> None:
    ended = ran(f"""
import signal, time
from missionc.base.deadline import OutOfTime
from missionc.base.signals import stoppable
class Swallows:
    def __del__(self):
        signal.raise_signal({number.value})
with stoppable():
    Swallows()
    time.sleep(40)
""")
    assert (ended.returncode, ended.stdout, ended.stderr) == (128 + number, "", "")


def test_a_signal_ends_the_process_in_the_middle_of_work_that_no_handler_interrupts() -> None:
    ended = ran("""
import os, signal, threading, zlib
from missionc.base.deadline import OutOfTime
from missionc.base.signals import stoppable
large = bytes(1 << 30)
with stoppable():
    threading.Timer(0.2, os.kill, (os.getpid(), signal.SIGTERM)).start()
    zlib.compress(large, 9)
    zlib.compress(large, 9)
    print("too late")
""")
    assert (ended.returncode, ended.stdout) == (143, "")


def test_who_is_started_to_outlive_its_terminal_does() -> None:
    ended = ran("""
import signal
from missionc.base.deadline import OutOfTime
from missionc.base.signals import stoppable
signal.signal(signal.SIGHUP, signal.SIG_IGN)
with stoppable():
    signal.raise_signal(signal.SIGHUP)
    print("goes on")
""")
    assert (ended.returncode, ended.stdout) == (0, "goes on\n")


@pytest.mark.parametrize("moment", [0.0, 0.15, 0.3, 0.6])
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP])
def test_a_signal_at_the_very_beginning_ends_the_process_in_silence(
    number: signal.Signals, moment: float, tmp_path: Path
) -> None:
    (tmp_path / "hard.mission").write_text(HARD)
    process = subprocess.Popen(
        [sys.executable, "-m", "missionc", "compile", "hard.mission"],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    time.sleep(moment)
    process.send_signal(number)
    assert process.communicate(timeout=60) == ("", "")
    # A shell shows both as 128 and the number.
    assert process.returncode in (-number, 128 + number)
