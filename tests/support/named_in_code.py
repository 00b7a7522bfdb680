"""Files of the repository that name a thing: as an identifier, an imported module, or a whole text."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from functools import cache
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def modules_that_name(word: str, *folders: str) -> set[str]:
    """Python files among these, or in these folders, with the word as identifier, module or whole text."""
    return {
        path.relative_to(ROOT).as_posix()
        for folder in folders
        for path in ([ROOT / folder] if folder.endswith(".py") else sorted((ROOT / folder).rglob("*.py")))
        if word in words(path)
    }


@cache
def words(path: Path) -> frozenset[str]:
    """All identifiers, parts of imported module names, and texts of a file."""
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
