"""Names of code that a page of the documentation mentions, and a test that they exist.

A page about the package in ``folder`` writes ``module.name`` for what one of its modules, in whichever of its rooms,
defines; ``smt.group.name`` for a setting of a backend; ``module.py`` for the file; and ``missionc/…`` for a path.
"""

from __future__ import annotations

import ast
import re
from pathlib import Path

from missionc.backends.setting import settings_of
from missionc.backends.settings import DEFAULTS

ROOT = Path(__file__).resolve().parents[2]
FILES = frozenset({"py", "md", "mission", "csv", "json", "html", "toml", "cnf", "drat"})
"""Suffixes of file names."""


def modules(folder: Path) -> dict[str, Path]:
    """Modules of a package and its subpackages, by name."""
    return {path.stem: path for path in folder.rglob("*.py") if path.stem != "__init__"}


def dotted(page: str) -> list[str]:
    """Dotted names in code on a page, ``module.name`` and ``module.Class.name``."""
    names = set(re.findall(r"`([a-z_]+(?:\.\w+)+)`", page))
    return sorted(name for name in names if name.rpartition(".")[2] not in FILES)


def module_files(page: str) -> list[str]:
    """Modules that a page names by their files: ``backend.py``."""
    return sorted(set(re.findall(r"`([a-z_]+\.py)`", page)))


def paths(page: str) -> list[str]:
    """Paths of the repository that a page names; ``*`` stands for any letters."""
    return sorted(set(re.findall(r"`((?:missionc|missions|bench|tests|docs)/[\w/.*]*)`", page)))


def is_defined(name: str, folder: Path) -> bool:
    """Return whether a name is a setting, or defined in a module of the package with all of its parts."""
    module, *words = name.split(".")
    if module in DEFAULTS:
        return ".".join(words) in {each.name for each in settings_of(DEFAULTS[module])}
    if module not in (known := modules(folder)):
        return False
    body = ast.parse(known[module].read_text(encoding="utf-8")).body
    for word in words:
        there = _definitions(body)
        if word not in there:
            return False
        body = there[word]
    return True


def is_there(path: str) -> bool:
    """Return whether the repository has such a path."""
    return any(ROOT.glob(path.rstrip("/")))


def _definitions(body: list[ast.stmt]) -> dict[str, list[ast.stmt]]:
    """Names that statements define, each with the statements in it."""
    found: dict[str, list[ast.stmt]] = {}
    for each in body:
        match each:
            case ast.ClassDef(name=name, body=inner) | ast.FunctionDef(name=name, body=inner):
                found[name] = inner
            case ast.Assign(targets=[ast.Name(id=name)]) | ast.AnnAssign(target=ast.Name(id=name)):
                found[name] = []
            case ast.Assign(targets=[ast.Tuple(elts=several)]):
                found |= {name.id: [] for name in several if isinstance(name, ast.Name)}
    return found
