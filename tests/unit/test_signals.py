"""Ctrl-C and SIGTERM: the right status, nothing half-written, nobody left behind."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from missionc.signals import Stopped, stoppable
from tests.processes import HARD, alive, children

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture
def busy(tmp_path: Path) -> Iterator[subprocess.Popen[str]]:
    """A compilation whose solver is at work in a child process."""
    (tmp_path / "hard.mission").write_text(HARD)
    process = subprocess.Popen(
        [sys.executable, "-m", "missionc", "compile", "hard.mission", "-o", "out/hard"],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    while process.poll() is None and not children(process.pid):
        time.sleep(0.05)
    yield process
    process.kill()
    process.wait()


@pytest.mark.skipif(not Path("/proc/self/task").exists(), reason="children are looked up in /proc")
@pytest.mark.parametrize(("number", "status"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_a_signal_ends_the_solver_too_and_leaves_nothing(
    busy: subprocess.Popen[str], tmp_path: Path, number: signal.Signals, status: int
) -> None:
    started = children(busy.pid)
    assert started, "the solver runs in no child process"
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


def test_what_mends_errors_does_not_catch_a_signal() -> None:
    assert not issubclass(Stopped, Exception)
