"""The command: what it changes, what it only shows, and what it leaves alone."""

from __future__ import annotations

import io
from pathlib import Path

import pytest

from missionc.cli import main
from tests.small import SMALL

UGLY = SMALL.replace("world (0, 0)", "world( 0,0 )") + "# last\n"


@pytest.fixture
def mission(tmp_path: Path) -> Path:
    path = tmp_path / "a.mission"
    path.write_text(UGLY, encoding="utf-8")
    return path


def test_a_file_is_put_in_the_one_layout(mission: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["fmt", str(mission)]) == 0
    assert capsys.readouterr().out == f"{mission}: changed\n"
    assert "world (0, 0) to (4, 4)\n" in mission.read_text()
    assert mission.read_text().endswith("# last\n")
    assert main(["fmt", str(mission)]) == 0
    assert capsys.readouterr().out == ""


def test_check_changes_nothing_and_says_so(mission: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["fmt", "--check", str(mission)]) == 1
    assert capsys.readouterr().out == f"{mission}: would change\n"
    assert mission.read_text() == UGLY


def test_diff_shows_and_changes_nothing(mission: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["fmt", "--diff", str(mission)]) == 0
    out = capsys.readouterr().out.splitlines()
    assert "-world( 0,0 ) to (4, 4)" in out
    assert "+world (0, 0) to (4, 4)" in out
    assert mission.read_text() == UGLY


def test_a_mission_with_errors_is_left_alone(mission: Path, capsys: pytest.CaptureFixture[str]) -> None:
    mission.write_text(UGLY + "require (\n")
    assert main(["fmt", str(mission)]) == 1
    assert "MC001" in capsys.readouterr().err
    assert mission.read_text() == UGLY + "require (\n"


def test_standard_input_goes_to_standard_output(
    mission: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sys.stdin", io.StringIO(UGLY))
    assert main(["fmt", "-"]) == 0
    out = capsys.readouterr().out
    assert main(["fmt", str(mission)]) == 0
    assert out == mission.read_text()
