"""Every code is defined, explained, emitted and pinned by a test; nothing else is emitted."""

from __future__ import annotations

import ast
import re
from functools import cache
from pathlib import Path

import pytest

from missionc.diagnostics import code as codes
from missionc.diagnostics.code import CODES, RETIRED, Code
from missionc.diagnostics.code_page import explain

ROOT = Path(__file__).resolve().parents[2]
PAGES = {path.stem for path in (ROOT / "docs" / "errors").glob("*.md")}
CONSTANTS = {name: value for name, value in vars(codes).items() if isinstance(value, Code)}


@cache
def words_of_the_package() -> set[str]:
    """Every name read anywhere in the package but where codes are defined."""
    found: set[str] = set()
    for path in (ROOT / "missionc").rglob("*.py"):
        if path.name != "code.py":
            for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
                match node:
                    case ast.Name(id=word) | ast.Attribute(attr=word):
                        found.add(word)
    return found


@cache
def all_tests() -> str:
    """All tests as one text, but for this file."""
    return "\n".join(
        path.read_text(encoding="utf-8")
        for pattern in ("*.py", "golden/*.md")
        for path in (ROOT / "tests").rglob(pattern)
        if path.name != "test_codes.py"
    )


def test_a_code_has_one_name_and_one_number() -> None:
    assert len({value.name for value in CONSTANTS.values()}) == len(CONSTANTS) == len(CODES)
    assert all(re.fullmatch(r"MC[0-79]\d\d", name) for name in CODES)


def test_a_number_that_was_given_up_is_not_given_again() -> None:
    assert RETIRED.isdisjoint(CODES)


@pytest.mark.parametrize("constant", sorted(CONSTANTS))
def test_a_code_is_emitted_somewhere(constant: str) -> None:
    assert constant in words_of_the_package()


@pytest.mark.parametrize("name", sorted(CODES))
def test_a_code_is_explained(name: str) -> None:
    assert explain(CODES[name]).startswith(f"# {name}: {CODES[name].title}\n")


@pytest.mark.parametrize("name", sorted(CODES))
def test_a_code_is_pinned_by_a_test(name: str) -> None:
    """By its number or its constant; its own page does not count: that shows only that it can be earned."""
    constant = next(key for key, value in CONSTANTS.items() if value.name == name)
    assert re.search(rf"\b({name}|{constant})\b", all_tests())


def test_every_page_explains_a_code() -> None:
    assert set(CODES) >= PAGES


def test_nobody_makes_a_code_elsewhere() -> None:
    for path in (ROOT / "missionc").rglob("*.py"):
        if path.name != "code.py":
            assert not re.search(r"\bCode\(", path.read_text(encoding="utf-8")), path
