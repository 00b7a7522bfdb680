"""Standard output and standard error that take nothing: the exit status says so, and nothing else does."""

from __future__ import annotations

import io
import os
import subprocess
import sys
from pathlib import Path

import pytest

from missionc.cli.app import main
from missionc.cli.streams import HUNG_UP, NOT_SAID
from tests.support.small_missions import SMALL, WRONG

ROOT = Path(__file__).resolve().parents[3]
SAYING = [
    "check small.mission",
    "check wrong.mission --format json",
    "explain small.mission",
    "vehicles",
    "--help",
    "init",
]


class Full(io.TextIOWrapper):
    """A stream that fails as one on a full disk does, or as a pipe that nobody reads from."""

    def __init__(self, number: int) -> None:
        super().__init__(io.BytesIO(), "utf-8")
        self._number = number

    def flush(self) -> None:
        if self._number:
            raise OSError(self._number, os.strerror(self._number))


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "small.mission").write_text(SMALL)
    (tmp_path / "wrong.mission").write_text(WRONG)
    return tmp_path


@pytest.mark.parametrize("words", SAYING)
@pytest.mark.parametrize(("stream", "status"), [(28, NOT_SAID), (32, HUNG_UP), (0, NOT_SAID)])
def test_what_cannot_be_said_ends_in_a_status_of_its_own(
    words: str, stream: int, status: int, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    gone = Full(stream) if stream else None
    monkeypatch.setattr(sys, "stdout", gone)
    assert main(words.split()) == status
    assert sys.stdout is gone
    monkeypatch.undo()


@pytest.mark.parametrize("words", ["check wrong.mission", "check", "nonsense", "check nowhere"])
def test_findings_and_usage_that_cannot_be_said_do_so_too(
    words: str, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "stderr", Full(28))
    status = main(words.split())
    monkeypatch.undo()
    assert status == NOT_SAID


@pytest.mark.parametrize(("redirected", "status"), [(">/dev/full", 74), (">&-", 74), ("| true", 141)])
def test_a_process_says_nothing_more_of_it(redirected: str, status: int, folder: Path) -> None:
    command = f"{sys.executable} -m missionc check small.mission --format json {redirected}; exit ${{PIPESTATUS[0]}}"
    run = subprocess.run(
        ["bash", "-c", command], env={**os.environ, "PYTHONPATH": str(ROOT)}, capture_output=True, text=True
    )
    assert (run.returncode, run.stdout, run.stderr) == (status, "", "")


def test_no_file_takes_the_number_of_a_stream_that_is_closed(folder: Path) -> None:
    code = "from missionc.cli.streams import hold_numbers; hold_numbers(); print(open('small.mission').fileno())"
    run = subprocess.run(
        ["bash", "-c", f'{sys.executable} -c "{code}" <&- 2>&-'],
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
    )
    assert int(run.stdout) > 2
