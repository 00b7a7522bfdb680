"""Files are read with care, and every refusal has its code."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from missionc.base.diagnostics.model import Diagnostic
from missionc.base.limits import Limits
from missionc.base.source import Source, Span
from missionc.frontend.syntax import read_file
from missionc.frontend.syntax.read_file import loader, read_source


def refusal(found: Source | Diagnostic) -> str:
    assert isinstance(found, Diagnostic)
    return found.code.name


def read(path: Path) -> Source | Diagnostic:
    return read_source(path, path.name, Limits())


def include(main: Path, written: str) -> Source | Diagnostic:
    """What the mission at a path gets for ``include "written"``."""
    span = Span(Source("main.mission", f'include "{written}"'), 8, 10 + len(written))
    return loader(main, "main.mission", Limits())(written, span)


def test_a_byte_order_mark_is_no_part_of_the_text(tmp_path: Path) -> None:
    path = tmp_path / "a.mission"
    path.write_bytes(b"\xef\xbb\xbfmission a\n")
    found = read(path)
    assert isinstance(found, Source)
    assert found.text == "mission a\n"


@pytest.mark.parametrize("content", [b"mission a\0", b"\x7fELF\x00\xff", b"mission \xff", b"\xff\xfem\x00"])
def test_what_is_not_utf8_text_is_refused(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "a.mission"
    path.write_bytes(content)
    assert refusal(read(path)) == "MC002"


def test_the_line_of_the_first_foreign_byte_is_named(tmp_path: Path) -> None:
    path = tmp_path / "a.mission"
    path.write_bytes(b"mission a\n\xff")
    found = read(path)
    assert isinstance(found, Diagnostic)
    assert "byte 11, on line 2, is not UTF-8" in found.message


def test_a_file_over_the_limit_is_refused_and_the_flag_named(tmp_path: Path) -> None:
    path = tmp_path / "a.mission"
    path.write_bytes(b" " * 11)
    found = read_source(path, "a.mission", Limits(file_bytes=10))
    assert isinstance(found, Diagnostic)
    assert found.code.name == "MC004"
    assert "--limit file_bytes=11" in found.help


def test_folders_devices_and_pipes_are_not_read(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    assert refusal(read(tmp_path)) == "MC002"
    assert refusal(read(tmp_path / "pipe")) == "MC002"
    assert refusal(read(Path(os.devnull))) == "MC002"
    assert refusal(read(tmp_path / "absent")) == "MC002"


def test_a_file_that_grows_while_it_is_read_is_not_believed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "a.mission"
    path.write_text("mission a\n")
    before = read_file._read

    def read_and_grow(handle: int, limit: int) -> bytes:
        content = before(handle, limit)
        with path.open("a") as file:
            file.write("world (0, 0) to (1, 1)\n")
        return content

    monkeypatch.setattr(read_file, "_read", read_and_grow)
    assert refusal(read(path)) == "MC009"


def test_an_include_is_relative_to_the_file_that_includes_it(tmp_path: Path) -> None:
    (tmp_path / "sites" / "near").mkdir(parents=True)
    (tmp_path / "sites" / "a.mission").write_text("# a")
    (tmp_path / "sites" / "near" / "b.mission").write_text("# b")
    main = tmp_path / "main.mission"
    main.write_text("")
    load = loader(main, str(main), Limits())
    first = load("sites/a.mission", Span(Source(str(main), ""), 0, 0))
    assert isinstance(first, Source)
    second = load("near/b.mission", Span(first, 0, 0))
    assert isinstance(second, Source)
    assert second.text == "# b"
    assert second.name == str(tmp_path / "sites" / "near" / "b.mission")


def test_a_file_has_one_name_however_it_is_reached(tmp_path: Path) -> None:
    main = tmp_path / "main.mission"
    main.write_text("")
    (tmp_path / "sites").mkdir()
    (tmp_path / "alias.mission").symlink_to(main)
    for written in ("main.mission", "sites/../main.mission", "alias.mission"):
        found = include(main, written)
        assert isinstance(found, Source)
        assert found.name == "main.mission"


def test_a_link_is_a_source_that_includes_what_it_leads_to(tmp_path: Path) -> None:
    (tmp_path / "far" / "parts").mkdir(parents=True)
    (tmp_path / "far" / "parts" / "real.mission").write_text("# real")
    (tmp_path / "near").symlink_to("far/parts")
    main = tmp_path / "main.mission"
    main.write_text("")
    load = loader(main, "main.mission", Limits())
    here = Span(Source("main.mission", ""), 0, 0)
    link = load("near/real.mission", here)
    assert isinstance(link, Source)
    assert (link.name, link.text) == ("near/real.mission", 'include "../far/parts/real.mission"\n')
    real = load("../far/parts/real.mission", Span(link, 0, 0))
    assert isinstance(real, Source)
    assert (real.name, real.text) == ("far/parts/real.mission", "# real")
    again = load("near/real.mission", here)
    assert isinstance(again, Source)
    assert again.name == real.name, "so that it is seen to be included twice"


@pytest.mark.parametrize("written", ["/etc/passwd", "../outside.mission", "link.mission", "linked/outside.mission", ""])
def test_an_include_stays_in_the_folder_of_the_mission(tmp_path: Path, written: str) -> None:
    home = tmp_path / "home"
    home.mkdir()
    (tmp_path / "outside.mission").write_text("# out")
    (home / "link.mission").symlink_to(tmp_path / "outside.mission")
    (home / "linked").symlink_to(tmp_path)
    main = home / "main.mission"
    main.write_text("")
    assert refusal(include(main, written)) == "MC010"


def test_an_include_of_nothing_points_at_the_include(tmp_path: Path) -> None:
    main = tmp_path / "main.mission"
    main.write_text("")
    (tmp_path / "loop.mission").symlink_to(tmp_path / "loop.mission")
    for written in ("absent.mission", "loop.mission", "x" * 5000):
        found = include(main, written)
        assert isinstance(found, Diagnostic)
        assert found.code.name == "MC002"
        assert found.primary is not None
