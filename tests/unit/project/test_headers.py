"""The first lines of modules: each names a thing of the field, and no two are alike."""

import ast
from functools import cache
from pathlib import Path

import missionc

ROOT = Path(missionc.__file__).parent

QUESTIONS = {"What", "Whether", "Where", "Whom", "Whose", "Who", "How", "When", "Which", "Why", "As", "Of"}
"""Words with which no first line of a module begins: they say what is asked, not what is there."""

WIDTH = 120
"""Columns, with the quotes."""


@cache
def first_lines() -> dict[str, str]:
    """The first line of each module's docstring, by its path; empty where there is none."""
    return {
        str(path.relative_to(ROOT)): (ast.get_docstring(ast.parse(path.read_bytes())) or "").partition("\n")[0]
        for path in ROOT.rglob("*.py")
    }


def first_word(text: str) -> str:
    return text.split()[0].strip(",:`") if text.strip() else ""


def test_every_module_says_what_it_is() -> None:
    silent = [name for name, line in first_lines().items() if not line]
    assert first_lines()
    assert not silent


def test_no_module_begins_with_a_question() -> None:
    asking = {name: line for name, line in first_lines().items() if first_word(line) in QUESTIONS}
    assert not asking


def test_no_two_modules_begin_alike() -> None:
    by_line: dict[str, list[str]] = {}
    for name, line in first_lines().items():
        by_line.setdefault(line, []).append(name)
    assert [names for names in by_line.values() if len(names) > 1] == []


def test_first_lines_fit() -> None:
    wide = {name: line for name, line in first_lines().items() if len(line) + len('"""') > WIDTH}
    assert not wide


def test_no_docstring_begins_with_of() -> None:
    partial = [
        f"{path.relative_to(ROOT)}:{node.lineno}"
        for path in ROOT.rglob("*.py")
        for node in ast.walk(ast.parse(path.read_bytes()))
        if isinstance(node, ast.Expr)
        and isinstance(node.value, ast.Constant)
        and isinstance(node.value.value, str)
        and first_word(node.value.value) == "Of"
    ]
    assert not partial
