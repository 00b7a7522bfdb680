"""The output folder appears whole or not at all, and nobody else's file goes with the one that it replaces."""

from __future__ import annotations

import errno
import os
import stat
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from missionc.base.diagnostics.code import CANNOT_WRITE, OUTPUT_EXISTS
from missionc.base.diagnostics.model import Diagnostic
from missionc.output.folder import write_folder as folder_module
from missionc.output.folder.file_names import EXPORT, NEAR_MISS, PROOF
from missionc.output.folder.ownership import ownership
from missionc.output.folder.ownership import remove as remove_folder
from missionc.output.folder.write_folder import refuse, write_folder
from tests.support.output_folders import content, unlisted, with_manifest, written

FILES = {"plan.json": b"{}\n", "crazyflie/drone0.csv": b"1,2\n", "mission/a.mission": b"mission a\n"}
NEW = {"plan.json": b"new"}


def replaced(target: Path, force: bool = True) -> str:
    """The code that refuses to replace the folder; empty where it is replaced."""
    refused = write_folder(target, with_manifest(NEW), force)
    return refused.code.name if refused else ""


def test_a_folder_holds_every_file_and_nothing_lies_beside_it(tmp_path: Path) -> None:
    target = tmp_path / "build" / "wildfire"
    assert write_folder(target, with_manifest(FILES), force=False) is None
    assert unlisted(target) == FILES
    assert [path.name for path in target.parent.iterdir()] == ["wildfire"]


def test_a_folder_that_exists_is_left_as_it_is(tmp_path: Path) -> None:
    target = written(tmp_path / "out", FILES)
    refused = write_folder(target, with_manifest(NEW), force=False)
    assert refused is not None
    assert refused.code is OUTPUT_EXISTS
    assert "--force" in refused.help
    assert unlisted(target) == FILES


def test_force_replaces_the_whole_folder(tmp_path: Path) -> None:
    target = written(tmp_path / "out", FILES)
    assert replaced(target) == ""
    assert unlisted(target) == NEW
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


@pytest.mark.parametrize(
    "name",
    [
        "report.html",
        "plan.json",
        "mission/thesis.txt",
        "export/customers.csv",
        "px4/firmware.c",
        "near_miss.json",
        "near_miss.svg",
        "impossible.drat",
        "thesis.tex",
        ".DS_Store",
        "crazyflie/drone0.csv",
    ],
)
@pytest.mark.parametrize("force", [False, True])
def test_a_folder_without_a_manifest_is_nobody_elses_to_replace_whatever_its_files_are_called(
    tmp_path: Path, name: str, force: bool
) -> None:
    path = tmp_path / "home" / name
    path.parent.mkdir(parents=True)
    path.write_text("dear")
    refused = write_folder(tmp_path / "home", with_manifest(NEW), force)
    assert refused is not None
    assert refused.code is OUTPUT_EXISTS
    assert f"`{name.split('/')[0]}`" in refused.notes[0]
    assert "--force" not in refused.help
    assert content(tmp_path / "home") == {name: b"dear"}
    assert [path.name for path in tmp_path.iterdir()] == ["home"]


def nested(target: Path) -> None:
    written(target / "again", FILES)


STRANGE: dict[str, tuple[Callable[[Path], object], str]] = {
    "a file that is not listed": (
        lambda out: (out / "notes.txt").write_text("dear"),
        "`notes.txt`, not listed in its `manifest.json`",
    ),
    "one deep inside": (
        lambda out: (out / "crazyflie" / "mine.csv").write_text("dear"),
        "`crazyflie/mine.csv`, not listed in its `manifest.json`",
    ),
    "a listed file, edited": (
        lambda out: (out / "mission/a.mission").write_text("dear"),
        "`mission/a.mission`, changed",
    ),
    "a symbolic link": (lambda out: (out / "link").symlink_to("/etc"), "`link`, a symbolic link"),
    "a link in place of a listed file": (
        lambda out: (out / "plan.json").rename(out.parent / "moved") and (out / "plan.json").symlink_to("../moved"),
        "`plan.json`, a symbolic link",
    ),
    "a pipe": (lambda out: os.mkfifo(out / "pipe"), "`pipe`, not a regular file"),
    "an empty folder": (lambda out: (out / "thesis").mkdir(), "`thesis`, an empty folder"),
    "a folder in place of a listed file": (
        lambda out: ((out / "plan.json").unlink(), (out / "plan.json").mkdir()),
        "`plan.json`, an empty folder",
    ),
    "another compilation": (nested, "`again/crazyflie/drone0.csv`, not listed in its `manifest.json`"),
    "another manifest": (
        lambda out: (out / "manifest.json").write_text('{"schema": "mine", "files": {}}'),
        "`crazyflie`",
    ),
    "a manifest that cannot be read": (lambda out: (out / "manifest.json").write_bytes(b"[" * 100_000), "`crazyflie`"),
    "a link for a manifest": (
        lambda out: (
            (out / "manifest.json").rename(out.parent / "moved") and (out / "manifest.json").symlink_to("../moved")
        ),
        "`manifest.json`, a symbolic link",
    ),
}


@pytest.mark.parametrize("what", STRANGE)
def test_force_touches_nothing_in_a_folder_that_holds_what_the_compiler_did_not_write(
    tmp_path: Path, what: str
) -> None:
    target = written(tmp_path / "out", FILES)
    put, named = STRANGE[what]
    put(target)
    before = sorted((str(path), path.lstat().st_mode, path.lstat().st_ino) for path in tmp_path.rglob("*"))
    refused = write_folder(target, with_manifest(NEW), force=True)
    assert refused is not None
    assert refused.code is OUTPUT_EXISTS
    assert refused.notes[0].startswith(named)
    assert sorted((str(path), path.lstat().st_mode, path.lstat().st_ino) for path in tmp_path.rglob("*")) == before


def test_the_first_few_strange_files_are_named_and_the_others_counted(tmp_path: Path) -> None:
    target = written(tmp_path / "out", FILES)
    for number in range(12):
        (target / f"note-{number:02}").touch()
    refused = refuse(target, force=True)
    assert refused is not None
    assert [note.split(",")[0] for note in refused.notes[:6]] == [*(f"`note-{n:02}`" for n in range(5)), "and 7 more"]


def test_a_folder_that_lacks_listed_files_is_still_the_compilers(tmp_path: Path) -> None:
    target = written(tmp_path / "out", FILES)
    (target / "plan.json").unlink()
    (target / "crazyflie" / "drone0.csv").unlink()
    assert replaced(target) == ""
    assert unlisted(target) == NEW


def test_a_manifest_that_lists_files_elsewhere_reaches_none_of_them(tmp_path: Path) -> None:
    (tmp_path / "thesis.tex").write_bytes(b"dear")
    target = written(tmp_path / "out", FILES)
    forged = {**FILES, "../thesis.tex": b"dear", str(tmp_path / "thesis.tex"): b"dear"}
    (target / "manifest.json").write_bytes(dict(with_manifest(forged))["manifest.json"])
    assert replaced(target) == ""
    assert (tmp_path / "thesis.tex").read_bytes() == b"dear"


def test_a_nearest_miss_gives_way_without_force_and_nothing_else_does(tmp_path: Path) -> None:
    assert replaced(written(tmp_path / "miss", {"near_miss.json": b"old"}, NEAR_MISS), force=False) == ""
    for holds in (PROOF, EXPORT):
        target = written(tmp_path / holds, {"near_miss.json": b"old", "impossible.drat": b"old"}, holds)
        assert replaced(target, force=False) == "MC701"
        assert replaced(target, force=True) == ""


def test_a_nearest_miss_beside_which_somebody_has_put_a_file_does_not_give_way(tmp_path: Path) -> None:
    target = written(tmp_path / "miss", {"near_miss.json": b"old"}, NEAR_MISS)
    (target / "notes.txt").write_text("dear")
    assert replaced(target, force=False) == "MC701"
    assert replaced(target, force=True) == "MC701"
    assert (target / "notes.txt").read_text() == "dear"


def test_an_empty_folder_is_replaced_by_force_only(tmp_path: Path) -> None:
    (tmp_path / "out").mkdir()
    assert replaced(tmp_path / "out", force=False) == "MC701"
    assert replaced(tmp_path / "out", force=True) == ""
    assert unlisted(tmp_path / "out") == NEW


def test_force_does_not_replace_a_file_and_does_not_follow_a_link(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("dear")
    assert replaced(tmp_path / "file") == "MC701"
    assert (tmp_path / "file").read_text() == "dear"
    real = written(tmp_path / "real", FILES)
    (tmp_path / "link").symlink_to(real)
    (tmp_path / "nowhere").symlink_to("none")
    assert replaced(tmp_path / "link") == "MC701"
    assert replaced(tmp_path / "nowhere") == "MC701"
    assert unlisted(real) == FILES


def test_the_mode_of_a_folder_is_kept(tmp_path: Path) -> None:
    target = written(tmp_path / "out", FILES)
    for mode in (0o2710, 0o700):
        target.chmod(mode)
        assert replaced(target) == ""
        assert stat.S_IMODE(target.stat().st_mode) == mode


@pytest.mark.parametrize("inner", [".", "crazyflie"])
def test_a_folder_made_read_only_is_replaced_whole_or_kept_whole_and_nothing_is_left_hidden(
    tmp_path: Path, inner: str
) -> None:
    target = written(tmp_path / "out", FILES)
    (target / inner).chmod(0o500)
    refused = write_folder(target, with_manifest(NEW), force=True)
    (target / inner if (target / inner).exists() else target).chmod(0o700)
    assert unlisted(target) in (FILES, NEW)
    assert (unlisted(target) == NEW) or refused is not None
    assert [path.name for path in tmp_path.iterdir() if path.name.startswith(".")] == []


def test_what_comes_into_a_folder_after_it_was_judged_brings_the_folder_back(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    target = written(tmp_path / "out", FILES)
    rename = Path.rename

    def slow(self: Path, other: Path) -> Path:
        if self == target:
            (target / "thesis.tex").write_text("dear")
        return rename(self, other)

    monkeypatch.setattr(Path, "rename", slow)
    assert replaced(target) == "MC701"
    assert unlisted(target) == {**FILES, "thesis.tex": b"dear"}
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


def test_what_comes_into_a_folder_while_it_is_removed_is_kept_beside_the_new_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    target = written(tmp_path / "out", FILES)

    def slow(old: Path, ours: object) -> bool:
        (old / "crazyflie" / "thesis.tex").write_text("dear")
        (old / "plan.json").write_text("edited")
        return remove_folder(old, ours)  # type: ignore[arg-type]

    monkeypatch.setattr(folder_module, "remove", slow)
    said = write_folder(target, with_manifest(NEW), force=True)
    assert said is not None
    (kept,) = tmp_path.glob("out.kept-*")
    assert f"`{kept}`" in said.notes[0]
    assert unlisted(kept) == {"crazyflie/thesis.tex": b"dear", "plan.json": b"edited"}
    assert unlisted(target) == NEW
    assert len(list(tmp_path.iterdir())) == 2


def test_a_full_disk_leaves_nothing_behind(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(descriptor: int) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    failed = write_folder(tmp_path / "out", with_manifest(FILES), force=False)
    assert failed is not None
    assert failed.code is CANNOT_WRITE
    assert failed.notes == ("No space left on device",)
    assert list(tmp_path.iterdir()) == []


def test_a_full_disk_leaves_the_old_folder_as_it_was(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    target = written(tmp_path / "out", FILES)
    rename = Path.rename

    def failing(self: Path, other: Path) -> Path:
        if other == target and self.name == "new":
            raise OSError(errno.ENOSPC, "No space left on device")
        return rename(self, other)

    monkeypatch.setattr(Path, "rename", failing)
    assert replaced(target) == "MC702"
    assert unlisted(target) == FILES
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


def test_an_interruption_leaves_the_old_folder_and_nothing_else(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    target = written(tmp_path / "out", FILES)
    create = folder_module.create

    def interrupted(path: Path, held: bytes) -> None:
        if path.name == "plan.json":
            raise KeyboardInterrupt
        create(path, held)

    monkeypatch.setattr(folder_module, "create", interrupted)
    with pytest.raises(KeyboardInterrupt):
        write_folder(target, with_manifest(FILES), force=True)
    assert unlisted(target) == FILES
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


@pytest.mark.parametrize("moment", ["set aside", "in its place", "removed"])
def test_an_interruption_at_any_moment_leaves_one_folder_whole_and_nothing_beside_it(
    moment: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    target = written(tmp_path / "out", FILES)
    rename, unlink, came = Path.rename, os.unlink, []

    def interrupt(now: str) -> None:
        if now == moment and not came:
            came.append(now)
            raise KeyboardInterrupt

    def renamed(path: Path, other: Path) -> Path:
        moved = rename(path, other)
        interrupt("set aside" if path == target else "in its place" if other == target else "")
        return moved

    def unlinked(path: Path, **named: int) -> None:
        unlink(path, **named)
        interrupt("removed")

    monkeypatch.setattr(Path, "rename", renamed)
    monkeypatch.setattr(os, "unlink", unlinked)
    with pytest.raises(KeyboardInterrupt):
        write_folder(target, with_manifest(NEW), force=True)
    assert unlisted(target) == (FILES if moment == "set aside" else NEW)
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


def test_many_that_replace_one_folder_at_once_all_succeed_and_leave_the_folder_of_one(tmp_path: Path) -> None:
    target = written(tmp_path / "out", FILES)
    contents = [{"plan.json": str(number).encode(), "a/b.csv": b"1"} for number in range(8)]

    def write(own: Mapping[str, bytes]) -> list[Diagnostic | None]:
        return [write_folder(target, with_manifest(own), force=True) for _ in range(5)]

    with ThreadPoolExecutor(len(contents)) as pool:
        outcomes = list(pool.map(write, contents))
    assert outcomes == [[None] * 5] * len(contents)
    assert unlisted(target) in contents
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


def test_a_place_that_is_no_folder_is_refused_before_any_work(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("dear")
    refused = refuse(tmp_path / "file" / "out", force=False)
    assert refused is not None
    assert refused.code is CANNOT_WRITE
    assert refuse(tmp_path / "new" / "out", force=False) is None


@pytest.mark.parametrize("name", ["a" * 256, "é" * 128, "new/" + "a" * 300, "a/" * 2500 + "b", "a\0b", "\ud800"])
def test_a_name_that_no_folder_can_have_is_refused_before_any_work(tmp_path: Path, name: str) -> None:
    refused = refuse(tmp_path / name, force=False)
    assert refused is not None
    assert refused.code is CANNOT_WRITE
    assert len(refused.message) < 250
    refused.message.encode()
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("name", ["a" * 255, "é" * 127, os.fsdecode(b"\xff"), "-", "a\nb"])
def test_a_folder_may_have_any_name_that_the_file_system_allows(tmp_path: Path, name: str) -> None:
    target = written(tmp_path / name, FILES)
    assert replaced(target) == ""
    assert unlisted(target) == NEW
    assert os.listdir(tmp_path) == [name]


@pytest.mark.skipif(os.geteuid() == 0, reason="nothing is forbidden to the superuser")
def test_a_folder_one_may_not_write_to_is_refused(tmp_path: Path) -> None:
    tmp_path.chmod(0o500)
    try:
        refused = refuse(tmp_path / "out", force=False)
    finally:
        tmp_path.chmod(0o700)
    assert refused is not None
    assert refused.code is CANNOT_WRITE


def test_a_home_folder_is_not_looked_through_for_long(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Without a manifest nothing below the first level is read."""
    (tmp_path / "deep" / "down").mkdir(parents=True)
    monkeypatch.setattr("missionc.output.folder.ownership.entries", None)
    assert "deep" in str(ownership(tmp_path))
