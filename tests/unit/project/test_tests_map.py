"""The map of the tests is complete: every folder, every module made for tests, every mark; and nothing else."""

from __future__ import annotations

import re
import tomllib

from tests.support.names_in_pages import ROOT, is_there, paths

TESTS = ROOT / "tests"
PAGE = (TESTS / "README.md").read_text(encoding="utf-8")


def column(table: str) -> list[str]:
    """The names in the first column of the table under such a head."""
    rows = PAGE.split(table, 1)[1].split("\n\n", 1)[0]
    return re.findall(r"^\| `([^`]+)` \|", rows, re.MULTILINE)


def test_every_folder_of_tests_is_on_the_map() -> None:
    folders = {f"tests/{path.relative_to(TESTS).parts[0]}/" for path in TESTS.glob("*/**/test_*.py")} | {
        "tests/golden/"
    }
    assert set(column("| folder | kind |")) == folders


def test_unit_tests_and_properties_stand_in_the_rooms_of_the_package() -> None:
    rooms = {path.parent.name for path in (ROOT / "missionc").glob("*/__init__.py")} | {"project"}
    for kind in ("unit", "properties"):
        assert {path.relative_to(TESTS / kind).parts[0] for path in (TESTS / kind).rglob("test_*.py")} <= rooms


def test_every_module_made_for_tests_is_on_the_map() -> None:
    assert set(column("| module | provides |")) == {path.stem for path in (TESTS / "support").glob("*.py")}


def test_every_mark_is_on_the_map() -> None:
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["pytest"]["ini_options"]
    assert column("| mark | the test |") == [mark.partition(":")[0] for mark in settings["markers"]]


def test_every_path_of_the_map_is_there() -> None:
    named = paths(PAGE)
    assert [path for path in named if "NAME" not in path and not is_there(path)] == []
    assert len(named) > 10
