"""Everything in a folder is listed, and no link is followed."""

from __future__ import annotations

import os
import stat
from pathlib import Path

import pytest

from missionc.output.folder.ownership import contents


def test_files_links_special_files_and_empty_folders_are_listed_by_relative_names(tmp_path: Path) -> None:
    (tmp_path / "a" / "b").mkdir(parents=True)
    (tmp_path / "a" / "b" / "file.txt").write_text("dear")
    (tmp_path / "a" / "empty").mkdir()
    (tmp_path / "link").symlink_to("/")
    os.mkfifo(tmp_path / "a" / "pipe")
    found = contents(tmp_path)
    assert list(found) == ["a/b/file.txt", "a/empty", "a/pipe", "link"]
    kinds = {name: stat.S_IFMT(status.st_mode) for name, status in found.items()}
    assert kinds == {
        "a/b/file.txt": stat.S_IFREG,
        "a/empty": stat.S_IFDIR,
        "a/pipe": stat.S_IFIFO,
        "link": stat.S_IFLNK,
    }


def test_a_folder_that_holds_nothing_has_no_contents(tmp_path: Path) -> None:
    assert contents(tmp_path) == {}


def test_names_that_are_no_text_are_listed_too(tmp_path: Path) -> None:
    (tmp_path / os.fsdecode(b"\xff")).write_text("dear")
    assert [os.fsencode(name) for name in contents(tmp_path)] == [b"\xff"]


@pytest.mark.slow
def test_a_folder_in_a_thousand_folders_is_no_matter_of_recursion(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    for _ in range(1100):
        os.mkdir("d")
        os.chdir("d")
    found = contents(tmp_path)
    for _ in range(1100):
        os.chdir("..")
        os.rmdir("d")
    assert list(found) == ["/".join("d" * 1100)]


def test_a_folder_that_cannot_be_read_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(NotADirectoryError):
        contents(Path(__file__))
    with pytest.raises(FileNotFoundError):
        contents(tmp_path / "none")
