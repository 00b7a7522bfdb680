"""One file is replaced as a whole, and stays what it was but for its content."""

from __future__ import annotations

import errno
import os
import stat
from pathlib import Path

import pytest

from missionc.base.diagnostics.code import CANNOT_WRITE
from missionc.output.folder import write_folder as file_module
from missionc.output.folder.write_folder import refuse_file, write_file


def full(descriptor: int) -> None:
    raise OSError(errno.ENOSPC, "No space left on device")


def test_a_single_file_is_replaced_as_a_whole(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    target = tmp_path / "map.svg"
    assert write_file(target, b"old") is None
    assert write_file(target, b"new") is None
    assert write_file(tmp_path / "far" / "off" / "map.svg", b"new") is None
    assert target.read_bytes() == (tmp_path / "far" / "off" / "map.svg").read_bytes() == b"new"
    monkeypatch.setattr(os, "fsync", full)
    assert write_file(target, b"newer") is not None
    assert target.read_bytes() == b"new"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["far", "map.svg"]


@pytest.mark.parametrize("mode", [0o600, 0o640, 0o755])
def test_the_mode_of_a_file_is_kept(tmp_path: Path, mode: int) -> None:
    target = tmp_path / "map.svg"
    target.write_text("old")
    target.chmod(mode)
    assert write_file(target, b"new") is None
    assert stat.S_IMODE(target.stat().st_mode) == mode
    assert target.read_bytes() == b"new"


@pytest.mark.skipif(os.geteuid() != 0, reason="only the superuser gives files away")
def test_the_owner_of_a_file_is_kept(tmp_path: Path) -> None:
    target = tmp_path / "map.svg"
    target.write_text("old")
    os.chown(target, 1234, 5678)
    assert write_file(target, b"new") is None
    assert (target.stat().st_uid, target.stat().st_gid) == (1234, 5678)


def test_a_file_whose_owner_cannot_be_kept_is_written_in_place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    target = tmp_path / "map.svg"
    target.write_text("old")
    before = target.stat().st_ino
    monkeypatch.setattr(file_module, "keep_rights", lambda new, old: False)
    assert write_file(target, b"new") is None
    assert (target.stat().st_ino, target.read_bytes()) == (before, b"new")
    assert [path.name for path in tmp_path.iterdir()] == ["map.svg"]


def test_a_link_stays_and_the_file_behind_it_is_written(tmp_path: Path) -> None:
    (tmp_path / "far").mkdir()
    real, link = tmp_path / "far" / "real.svg", tmp_path / "link.svg"
    real.write_text("old")
    link.symlink_to(real)
    assert refuse_file(link) is None
    assert write_file(link, b"new") is None
    assert link.is_symlink()
    assert real.read_bytes() == b"new"
    assert sorted(path.name for path in tmp_path.rglob("*")) == ["far", "link.svg", "real.svg"]


@pytest.mark.parametrize("new", [b"new", b"", b"longer than what was there"])
def test_hard_links_stay_one_file(tmp_path: Path, new: bytes) -> None:
    one, two = tmp_path / "one.svg", tmp_path / "two.svg"
    one.write_text("what was there")
    two.hardlink_to(one)
    assert write_file(one, new) is None
    assert one.samefile(two)
    assert two.read_bytes() == new
    assert sorted(path.name for path in tmp_path.iterdir()) == ["one.svg", "two.svg"]


def test_a_disk_that_is_full_in_the_middle_of_a_linked_file_brings_its_content_back(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    one, two = tmp_path / "one.svg", tmp_path / "two.svg"
    one.write_text("what was there")
    two.hardlink_to(one)
    failures = iter([False, False, True, False])

    def sometimes(descriptor: int) -> None:
        if next(failures):
            full(descriptor)

    monkeypatch.setattr(os, "fsync", sometimes)
    assert write_file(one, b"new") is not None
    assert two.read_text() == "what was there"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["one.svg", "two.svg"]


def test_what_a_linked_file_held_is_kept_and_named_where_it_cannot_be_brought_back(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    one, two = tmp_path / "one.svg", tmp_path / "two.svg"
    one.write_text("what was there")
    two.hardlink_to(one)
    failures = iter([False, False, True, True])

    def sometimes(descriptor: int) -> None:
        if next(failures):
            full(descriptor)

    monkeypatch.setattr(os, "fsync", sometimes)
    said = write_file(one, b"new")
    assert said is not None
    (copy,) = tmp_path.glob("one.svg.before-*")
    assert f"`{copy}`" in said.notes[0]
    assert copy.read_text() == "what was there"


@pytest.mark.parametrize("name", ["a" * 256, "é" * 128, "a/" * 2500 + "b", "a\0b", "\ud800"])
def test_a_name_that_no_file_can_have_is_refused(tmp_path: Path, name: str) -> None:
    for wrong in (refuse_file(tmp_path / name), write_file(tmp_path / name, b"new")):
        assert wrong is not None
        assert wrong.code is CANNOT_WRITE
        wrong.message.encode()
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("name", ["a" * 255, "é" * 127, os.fsdecode(b"\xff"), "a\nb"])
def test_a_file_may_have_any_name_that_the_file_system_allows(tmp_path: Path, name: str) -> None:
    target = tmp_path / name
    assert refuse_file(target) is None
    for number in (b"1", b"2"):
        assert write_file(target, number) is None
        assert target.read_bytes() == number
    (tmp_path / "other").hardlink_to(target)
    assert write_file(target, b"3") is None
    assert sorted(os.listdir(tmp_path)) == sorted([name, "other"])


@pytest.mark.parametrize("make", [os.mkfifo, os.mkdir, lambda path: os.symlink("none", path)])
def test_what_is_no_regular_file_is_refused(tmp_path: Path, make: object) -> None:
    target = tmp_path / "map.svg"
    make(target)  # type: ignore[operator]
    if target.is_symlink():
        assert write_file(target, b"new") is None, "a link to a file that is yet to be"
        assert (tmp_path / "none").read_bytes() == b"new"
        return
    for wrong in (refuse_file(target), write_file(target, b"new")):
        assert wrong is not None
        assert wrong.code is CANNOT_WRITE


@pytest.mark.skipif(os.geteuid() == 0, reason="nothing is forbidden to the superuser")
def test_a_file_that_may_not_be_written_to_is_not_replaced(tmp_path: Path) -> None:
    target = tmp_path / "map.svg"
    target.write_text("old")
    target.chmod(0o400)
    assert refuse_file(target) is not None
    assert write_file(target, b"new") is not None
    assert target.read_text() == "old"
