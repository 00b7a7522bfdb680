"""Which files of the repository name a thing: as an identifier, as a module they import, or as a text of just that."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from functools import cache
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def modules_that_name(word: str, *folders: str) -> set[str]:
    """The Python files among these, or in these folders, in which it is an identifier, a module or a whole text."""
    return {
        path.relative_to(ROOT).as_posix()
        for folder in folders
        for path in ([ROOT / folder] if folder.endswith(".py") else sorted((ROOT / folder).rglob("*.py")))
        if word in words(path)
    }


@cache
def words(path: Path) -> frozenset[str]:
    """Every identifier, every part of an imported module's name, and every text of a file."""
    return frozenset(_words(ast.parse(path.read_text(encoding="utf-8"))))


def _words(tree: ast.Module) -> Iterator[str]:
    for node in ast.walk(tree):
        match node:
            case ast.Name(id=word) | ast.Attribute(attr=word) | ast.arg(arg=word):
                yield word
            case ast.ClassDef(name=word) | ast.FunctionDef(name=word) | ast.keyword(arg=str(word)):
                yield word
            case ast.alias(name=word):
                yield from word.split(".")
            case ast.ImportFrom(module=str(word)):
                yield from word.split(".")
            case ast.Constant(value=str(word)):
                yield word
            case _:
                pass
