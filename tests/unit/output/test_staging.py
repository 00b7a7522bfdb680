"""Leftovers of a process that died are swept where they are the compiler's, and nobody's file goes with them."""

from __future__ import annotations

import json
import multiprocessing
import os
import signal
from pathlib import Path

import pytest

from missionc.output.folder.staging import staging, sweep
from missionc.output.folder.write_folder import write_folder
from tests.support.output_folders import content, unlisted, with_manifest, written

FILES = {"plan.json": b"{}\n", "crazyflie/drone0.csv": b"1,2\n"}
TOKEN = "0123456789abcdef"


def left(place: Path, **marked: object) -> Path:
    """A staging folder as a process that died has left it."""
    path = place.parent / f".missionc-{TOKEN}"
    path.mkdir()
    marker = {"schema": "missionc.staging/1", "token": TOKEN, "target": place.name, **marked}
    (path / "staging.json").write_text(json.dumps(marker))
    return path


def test_what_a_dead_process_left_is_swept(tmp_path: Path) -> None:
    path = left(tmp_path / "out")
    written(path / "new", FILES)
    sweep(tmp_path)
    assert list(tmp_path.iterdir()) == []


def test_a_folder_half_written_is_swept_with_the_file_that_was_being_written(tmp_path: Path) -> None:
    path = left(tmp_path / "out")
    written(path / "new", FILES)
    (path / "new" / "crazyflie" / "drone0.csv").write_text("1")
    (path / "new" / "plan.json").unlink()
    sweep(tmp_path)
    assert list(tmp_path.iterdir()) == []


def test_a_file_half_written_is_swept(tmp_path: Path) -> None:
    (left(tmp_path / "map.svg") / "new").write_text("<sv")
    sweep(tmp_path)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("begun", [False, True])
def test_a_staging_folder_whose_process_died_before_it_was_one_is_swept(begun: bool, tmp_path: Path) -> None:
    path = tmp_path / f".missionc-{TOKEN}"
    path.mkdir()
    if begun:
        (path / "staging.json").touch()
    sweep(tmp_path)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("opened", [False, True])
def test_a_staging_folder_that_is_swept_before_it_is_one_is_made_again(
    opened: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    open_, swept = os.open, []

    def slow(path: Path, flags: int, mode: int = 0o777) -> int:
        if Path(path).name != "staging.json" or swept:
            return open_(path, flags, mode)
        swept.append(path)
        if not opened:
            sweep(tmp_path)
        handle = open_(path, flags, mode)
        sweep(tmp_path)
        return handle

    monkeypatch.setattr(os, "open", slow)
    with staging(tmp_path / "out") as staged:
        staged.new.write_text("whole")
        sweep(tmp_path)
        assert staged.new.read_text() == "whole"
    assert len(swept) == 1
    assert list(tmp_path.iterdir()) == []


def test_what_somebody_put_among_the_leftovers_stays(tmp_path: Path) -> None:
    path = left(tmp_path / "out")
    written(path / "new", FILES)
    (path / "new" / "thesis.tex").write_text("dear")
    (path / "mine").write_text("dear")
    sweep(tmp_path)
    assert unlisted(path) == {
        "new/thesis.tex": b"dear",
        "mine": b"dear",
        "staging.json": (path / "staging.json").read_bytes(),
    }


def test_what_a_living_process_stages_is_not_swept(tmp_path: Path) -> None:
    with staging(tmp_path / "out") as staged:
        staged.new.write_text("half")
        sweep(tmp_path)
        assert staged.new.read_text() == "half"
    assert list(tmp_path.iterdir()) == []


def test_a_signal_while_a_staging_folder_is_cleared_leaves_nothing_of_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    rmdir, came = Path.rmdir, []

    def interrupted(path: Path) -> None:
        if not came:
            came.append(path)
            raise KeyboardInterrupt
        rmdir(path)

    monkeypatch.setattr(Path, "rmdir", interrupted)
    with pytest.raises(KeyboardInterrupt), staging(tmp_path / "out") as staged:
        staged.new.write_text("half")
    assert len(came) == 1
    assert list(tmp_path.iterdir()) == []


def test_a_folder_that_a_dead_process_moved_aside_comes_back_with_all_that_is_in_it(tmp_path: Path) -> None:
    path = left(tmp_path / "out")
    written(path / "old", FILES)
    (path / "old" / "thesis.tex").write_text("dear")
    sweep(tmp_path)
    assert unlisted(tmp_path / "out") == {**FILES, "thesis.tex": b"dear"}
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


def test_a_folder_that_came_back_is_not_replaced_without_force(tmp_path: Path) -> None:
    written(left(tmp_path / "out") / "old", FILES)
    refused = write_folder(tmp_path / "out", with_manifest({"plan.json": b"new"}), force=False)
    assert refused is not None
    assert unlisted(tmp_path / "out") == FILES


def test_a_folder_moved_aside_whose_place_is_taken_again_is_swept(tmp_path: Path) -> None:
    written(tmp_path / "out", FILES)
    written(left(tmp_path / "out") / "old", FILES)
    sweep(tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


def test_one_that_is_not_the_compilers_any_more_is_kept_where_it_can_be_seen(tmp_path: Path) -> None:
    written(tmp_path / "out", FILES)
    path = left(tmp_path / "out")
    written(path / "old", FILES)
    (path / "old" / "plan.json").write_text("edited")
    sweep(tmp_path)
    (kept,) = tmp_path.glob("out.kept-*")
    assert unlisted(kept) == {**FILES, "plan.json": b"edited"}
    assert len(list(tmp_path.iterdir())) == 2


@pytest.mark.parametrize(
    "name",
    [".missionc-notes", ".out.missionc-4711-0123abcd", ".out.missionc-4711-0123abcd.old", f".missionc-{TOKEN}"],
)
def test_a_name_alone_is_no_reason_to_sweep(tmp_path: Path, name: str) -> None:
    (tmp_path / name / "new").mkdir(parents=True)
    (tmp_path / name / "new" / "thesis.tex").write_text("dear")
    (tmp_path / f"{name}f").write_text("dear")
    before = content(tmp_path)
    sweep(tmp_path)
    assert content(tmp_path) == before


@pytest.mark.parametrize(
    "marked", [{"schema": "mine"}, {"token": "f" * 16}, {"target": "../home"}, {"target": ".."}, {"target": ""}]
)
def test_a_marker_of_another_kind_or_for_another_place_is_none(tmp_path: Path, marked: dict[str, object]) -> None:
    inner = tmp_path / "inner"
    inner.mkdir()
    path = left(inner / "out", **marked)
    (path / "new").write_text("dear")
    (path / "old").mkdir()
    before = content(tmp_path)
    sweep(inner)
    assert content(tmp_path) == before


def test_a_link_to_a_staging_folder_is_not_followed(tmp_path: Path) -> None:
    (tmp_path / "far").mkdir()
    (tmp_path / "near").mkdir()
    path = left(tmp_path / "far" / "out")
    (path / "new").write_text("dear")
    (tmp_path / "near" / path.name).symlink_to(path)
    sweep(tmp_path / "near")
    assert (path / "new").read_text() == "dear"


def stage_and_die(target: Path) -> None:
    with staging(target) as staged:
        staged.new.write_text("half")
        os.kill(os.getpid(), signal.SIGKILL)


def test_a_process_that_is_killed_leaves_what_the_next_one_sweeps(tmp_path: Path) -> None:
    child = multiprocessing.get_context("fork").Process(target=stage_and_die, args=(tmp_path / "out",))
    child.start()
    child.join()
    assert child.exitcode == -signal.SIGKILL
    (path,) = tmp_path.iterdir()
    assert (path / "new").read_text() == "half"
    sweep(tmp_path)
    assert list(tmp_path.iterdir()) == []
