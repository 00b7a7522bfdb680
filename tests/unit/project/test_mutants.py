"""The list of mutants that survive names what is there."""

from __future__ import annotations

import re
import tomllib
from importlib import import_module
from pathlib import Path

ROOT = Path(__file__).resolve().parents[3]
NAMED = re.findall(r"`(missionc(?:\.\w+)+)`", (ROOT / "tests" / "mutants.md").read_text(encoding="utf-8"))


def test_every_function_of_the_list_is_there() -> None:
    assert len(NAMED) > 10
    for name in NAMED:
        module, _, own = name.rpartition(".")
        assert hasattr(import_module(module), own), name


def test_every_test_that_mutants_meet_is_there() -> None:
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["mutmut"]
    files = [each for each in settings["pytest_add_cli_args_test_selection"] if each.startswith("tests/")]
    assert len(files) > 50
    assert [each for each in files if not (ROOT / each).is_file()] == []
