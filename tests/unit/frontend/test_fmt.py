"""The command: what it changes, what it only shows, and what it leaves alone."""

from __future__ import annotations

import errno
import io
import os
import stat
from pathlib import Path

import pytest

from missionc.base.source import Source
from missionc.cli.app import main
from missionc.cli.commands import fmt
from tests.support.small_missions import SMALL

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


@pytest.mark.parametrize("mode", [0o600, 0o640, 0o755])
def test_the_mode_of_a_file_is_kept(mission: Path, mode: int) -> None:
    mission.chmod(mode)
    assert main(["fmt", str(mission)]) == 0
    assert stat.S_IMODE(mission.stat().st_mode) == mode


def test_a_file_is_formatted_through_a_link_which_stays_one(mission: Path, tmp_path: Path) -> None:
    (tmp_path / "link.mission").symlink_to(mission)
    assert main(["fmt", str(tmp_path / "link.mission")]) == 0
    assert (tmp_path / "link.mission").is_symlink()
    assert "world (0, 0) to (4, 4)\n" in mission.read_text()


def test_a_file_with_two_names_keeps_both(mission: Path, tmp_path: Path) -> None:
    (tmp_path / "b.mission").hardlink_to(mission)
    assert main(["fmt", str(mission)]) == 0
    assert "world (0, 0) to (4, 4)\n" in (tmp_path / "b.mission").read_text()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.mission", "b.mission"]


@pytest.mark.parametrize("linked", [False, True])
def test_a_full_disk_leaves_the_mission_as_it_was(
    mission: Path, tmp_path: Path, linked: bool, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*arguments: int) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    if linked:
        (tmp_path / "b.mission").hardlink_to(mission)
    monkeypatch.setattr(os, "fsync", full)
    assert main(["fmt", str(mission)]) == 1
    said = capsys.readouterr()
    assert "MC702" in said.err
    assert "changed" not in said.out
    assert mission.read_text() == UGLY
    assert len(list(tmp_path.iterdir())) == 1 + linked


def test_what_is_saved_while_a_file_is_formatted_is_not_overwritten(
    mission: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def slow(source: Source, program: object, limits: object) -> str:
        mission.write_text(UGLY + "# saved meanwhile\n")
        return source.text + "\n"

    monkeypatch.setattr(fmt, "format_mission", slow)
    assert main(["fmt", str(mission)]) == 1
    assert "MC009" in capsys.readouterr().err
    assert mission.read_text().endswith("# saved meanwhile\n")


@pytest.mark.parametrize(
    ("content", "code"),
    [(b"#" * 70_000, "MC004"), (b"mission a\0", "MC002"), (b"# \xff\n", "MC002"), (b"", "MC003")],
)
def test_standard_input_is_read_as_carefully_as_a_file(
    content: bytes, code: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sys.stdin", io.TextIOWrapper(io.BytesIO(content)))
    assert main(["fmt", "-"]) == 1
    said = capsys.readouterr()
    assert said.out == ""
    assert f"error[{code}]" in said.err


def test_no_more_of_standard_input_is_read_than_may_be(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    endless = io.BytesIO(b"#" * 1_000_000)
    monkeypatch.setattr("sys.stdin", io.TextIOWrapper(endless))
    assert main(["fmt", "-", "--limit", "file_bytes=1000"]) == 1
    assert "`<stdin>` has 1001 bytes or more; the limit is 1000" in capsys.readouterr().err


@pytest.mark.parametrize("closed", [None, io.TextIOWrapper(io.BytesIO())])
def test_closed_standard_input_is_said_to_be(
    closed: io.TextIOWrapper | None, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    if closed:
        closed.close()
    monkeypatch.setattr("sys.stdin", closed)
    assert main(["fmt", "-"]) == 1
    assert "cannot read `<stdin>`: standard input is closed" in capsys.readouterr().err


def test_standard_input_goes_to_standard_output(
    mission: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sys.stdin", io.TextIOWrapper(io.BytesIO(UGLY.encode())))
    assert main(["fmt", "-"]) == 0
    out = capsys.readouterr().out
    assert main(["fmt", str(mission)]) == 0
    assert out == mission.read_text()
