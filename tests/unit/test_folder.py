"""The output folder appears whole or not at all."""

from __future__ import annotations

import errno
import os
import subprocess
import sys
from pathlib import Path

import pytest

from missionc.diagnostics.code import CANNOT_WRITE, OUTPUT_EXISTS
from missionc.emit import folder
from missionc.emit.folder import refuse, sweep, write_file, write_folder

FILES = (("plan.json", b"{}\n"), ("crazyflie/drone0.csv", b"1,2\n"), ("manifest.json", b"{}\n"))


def content(target: Path) -> dict[str, bytes]:
    return {path.relative_to(target).as_posix(): path.read_bytes() for path in target.rglob("*") if path.is_file()}


def dead_process() -> int:
    child = subprocess.Popen([sys.executable, "-c", ""])
    child.wait()
    return child.pid


def test_a_folder_holds_every_file_and_nothing_lies_beside_it(tmp_path: Path) -> None:
    target = tmp_path / "build" / "wildfire"
    assert write_folder(target, FILES, force=False) is None
    assert content(target) == dict(FILES)
    assert [path.name for path in target.parent.iterdir()] == ["wildfire"]


def test_a_folder_that_exists_is_left_as_it_is(tmp_path: Path) -> None:
    target = tmp_path / "out"
    write_folder(target, [("plan.json", b"old")], force=False)
    refused = write_folder(target, FILES, force=False)
    assert refused is not None
    assert refused.code is OUTPUT_EXISTS
    assert "--force" in refused.help
    assert content(target) == {"plan.json": b"old"}


def test_a_nearest_miss_alone_gives_way_without_force(tmp_path: Path) -> None:
    target = tmp_path / "out"
    write_folder(target, [("near_miss.json", b"old"), ("near_miss.html", b"old")], force=False)
    assert write_folder(target, FILES, force=False) is None
    assert content(target) == dict(FILES)
    proof = tmp_path / "proof"
    write_folder(proof, [("near_miss.json", b"old"), ("wildfire.drat", b"old")], force=False)
    assert write_folder(proof, FILES, force=False) is not None


def test_force_replaces_the_whole_folder(tmp_path: Path) -> None:
    target = tmp_path / "out"
    write_folder(target, [("plan.json", b"old"), ("certificate.json", b"old")], force=False)
    assert write_folder(target, FILES, force=True) is None
    assert content(target) == dict(FILES)
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


def test_force_does_not_replace_what_the_compiler_did_not_write(tmp_path: Path) -> None:
    home = tmp_path / "home"
    home.mkdir()
    (home / "thesis.tex").write_text("dear")
    refused = write_folder(home, FILES, force=True)
    assert refused is not None
    assert refused.code is OUTPUT_EXISTS
    assert "`thesis.tex`" in refused.message
    assert content(home) == {"thesis.tex": b"dear"}
    file = tmp_path / "file"
    file.write_text("dear")
    assert write_folder(file, FILES, force=True) is not None
    assert file.read_text() == "dear"


def test_force_does_not_follow_a_link(tmp_path: Path) -> None:
    real = tmp_path / "real"
    write_folder(real, FILES, force=False)
    link = tmp_path / "link"
    link.symlink_to(real)
    assert write_folder(link, [("plan.json", b"new")], force=True) is not None
    assert content(real) == dict(FILES)


def test_a_full_disk_leaves_nothing_behind(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(descriptor: int) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    failed = write_folder(tmp_path / "out", FILES, force=False)
    assert failed is not None
    assert failed.code is CANNOT_WRITE
    assert failed.notes == ("No space left on device",)
    assert list(tmp_path.iterdir()) == []


def test_a_full_disk_leaves_the_old_folder_as_it_was(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    target = tmp_path / "out"
    write_folder(target, [("plan.json", b"old")], force=False)
    rename = Path.rename

    def failing(self: Path, other: Path) -> Path:
        if other == target and ".old" not in self.name:
            raise OSError(errno.ENOSPC, "No space left on device")
        return rename(self, other)

    monkeypatch.setattr(Path, "rename", failing)
    failed = write_folder(target, FILES, force=True)
    assert failed is not None
    assert content(target) == {"plan.json": b"old"}
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


def test_an_interruption_leaves_nothing_behind(tmp_path: Path) -> None:
    def interrupted() -> object:
        yield FILES[0]
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write_folder(tmp_path / "out", interrupted(), force=False)  # type: ignore[arg-type]
    assert list(tmp_path.iterdir()) == []


def test_a_place_that_is_no_folder_is_refused_before_any_work(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("dear")
    refused = refuse(tmp_path / "file" / "out", force=False)
    assert refused is not None
    assert refused.code is CANNOT_WRITE
    assert refuse(tmp_path / "new" / "out", force=False) is None


@pytest.mark.skipif(os.geteuid() == 0, reason="nothing is forbidden to the superuser")
def test_a_folder_one_may_not_write_to_is_refused(tmp_path: Path) -> None:
    tmp_path.chmod(0o500)
    try:
        refused = refuse(tmp_path / "out", force=False)
    finally:
        tmp_path.chmod(0o700)
    assert refused is not None
    assert refused.code is CANNOT_WRITE


def test_what_a_dead_process_left_is_swept_and_what_a_living_one_stages_is_not(tmp_path: Path) -> None:
    dead = tmp_path / f".out.missionc-{dead_process()}-0123abcd"
    alive = tmp_path / f".out.missionc-{os.getpid()}-0123abcd"
    other = tmp_path / ".out.missionc-notes"
    for path in (dead, alive, other):
        path.mkdir()
    sweep(tmp_path)
    assert not dead.exists()
    assert alive.exists()
    assert other.exists()


def test_a_folder_that_a_dead_process_moved_aside_comes_back(tmp_path: Path) -> None:
    aside = tmp_path / f".out.missionc-{dead_process()}-0123abcd.old"
    aside.mkdir()
    (aside / "plan.json").write_text("old")
    sweep(tmp_path)
    assert content(tmp_path / "out") == {"plan.json": b"old"}


def test_a_folder_that_came_back_is_not_replaced_without_force(tmp_path: Path) -> None:
    (tmp_path / f".out.missionc-{dead_process()}-0123abcd.old").mkdir()
    refused = write_folder(tmp_path / "out", FILES, force=False)
    assert refused is not None
    assert refused.code is OUTPUT_EXISTS
    assert content(tmp_path / "out") == {}


def test_a_folder_moved_aside_whose_place_is_taken_again_is_swept(tmp_path: Path) -> None:
    write_folder(tmp_path / "out", FILES, force=False)
    (tmp_path / f".out.missionc-{dead_process()}-0123abcd.old").mkdir()
    assert write_folder(tmp_path / "out", FILES, force=True) is None
    assert [path.name for path in tmp_path.iterdir()] == ["out"]
    assert content(tmp_path / "out") == dict(FILES)


def test_a_single_file_is_replaced_as_a_whole(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    target = tmp_path / "map.svg"
    assert write_file(target, b"old") is None
    assert write_file(target, b"new") is None
    assert target.read_bytes() == b"new"

    def full(descriptor: int) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(folder.os, "fsync", full)
    failed = write_file(target, b"newer")
    assert failed is not None
    assert target.read_bytes() == b"new"
    assert [path.name for path in tmp_path.iterdir()] == ["map.svg"]
    missing = write_file(tmp_path / "nowhere" / "map.svg", b"new")
    assert missing is not None
