"""Code lenses: actions above a mission's name, and the robustness in the last plan above each requirement.

The last plan is in the ``build`` folder next to the mission. Its robustness is valid only for the text that it was
compiled from.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Iterator
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path, PurePosixPath

from lsprotocol import types

from missionc.base.diagnostics.model import Diagnostic
from missionc.base.strict_json import NotJsonError, parse_record
from missionc.frontend.syntax import ast
from missionc.frontend.syntax.read_file import read_bytes, strange
from missionc.output.folder.file_names import MANIFEST, MANIFEST_SCHEMA
from missionc.output.folder.manifest import sha256
from missionc.tools.language_server.open_text import LIMITS, OpenText

PLAN = "plan.json"
MOST_BYTES = 1 << 24
"""Maximum size of a plan's JSON file that is read, bytes."""
MOST_INPUTS = 100
"""Maximum number of a plan's input files that are compared; with more, the plan counts as changed."""


@dataclass(frozen=True, slots=True)
class LastPlan:
    """Last written plan of a mission.

    Args:
        robustness: robustness by requirement.
        changed: whether a file of the mission has changed since.
    """

    robustness: dict[str, float]
    changed: bool


def last_plan(text: OpenText, mission: str, folders: Iterable[Path]) -> LastPlan | None:
    """Plan in ``build/MISSION`` of the first of some folders that has one; None if no folder has a readable one.

    Args:
        text: current text of the mission.
        mission: name of the mission.
        folders: possible working directories of the compiler.
    """
    for folder in folders:
        written = folder / "build" / mission
        manifest = _json(written / MANIFEST)
        if manifest.get("schema") != MANIFEST_SCHEMA or manifest.get("mission") != mission:
            continue
        robustness = _recorded_robustness(written / PLAN)
        if robustness:
            return LastPlan(robustness, _changed(text, manifest.get("inputs")))
    return None


def _changed(text: OpenText, inputs: object) -> bool:
    """Return whether an input file of a plan has changed: this text, or another one on disk.

    Args:
        text: current text of the mission.
        inputs: digests by file name, from the manifest.
    """
    if not isinstance(inputs, dict) or not 0 < len(inputs) <= MOST_INPUTS:
        return True
    path = Path(text.source.name)
    for name, digest in inputs.items():
        if name == path.name:
            content: bytes | Diagnostic = text.source.text.removeprefix("\ufeff").encode("utf-8", "replace")
        elif strange(name) or ".." in PurePosixPath(name).parts:
            return True
        else:
            content = read_bytes(path.parent / name, name, LIMITS.map_bytes)
        if isinstance(content, Diagnostic) or sha256(content.removeprefix(b"\xef\xbb\xbf")) != digest:
            return True
    return path.name not in inputs


def _recorded_robustness(plan: Path) -> dict[str, float]:
    judged = _json(plan).get("requirements")
    entries = [entry for entry in judged if isinstance(entry, dict)] if isinstance(judged, list) else []
    return {
        entry["name"]: float(entry["robustness"])
        for entry in entries
        if isinstance(entry.get("name"), str) and isinstance(entry.get("robustness"), int | float)
    }


def _json(path: Path) -> dict[str, object]:
    """Contents of a JSON file; empty if it is missing, unreadable or too large."""
    try:
        status = path.stat()
    except OSError:
        return {}
    return _read(path, status.st_mtime_ns, status.st_size)


@lru_cache(maxsize=16)
def _read(path: Path, changed: int, size: int) -> dict[str, object]:
    content = read_bytes(path, path.name, MOST_BYTES)
    if isinstance(content, Diagnostic):
        return {}
    try:
        return parse_record(content)
    except NotJsonError:
        return {}


COMMANDS = {"missionc.compile": "compile", "missionc.showReport": "report", "missionc.showMap": "map"}
"""Titles of the lenses by command; a client offers those that it supports."""


def lenses(text: OpenText, commands: Collection[str], folders: Iterable[Path]) -> list[types.CodeLens]:
    """Code lenses of a text.

    Args:
        text: open text; robustness is shown only after its check.
        commands: commands that the client supports.
        folders: possible working directories of the compiler.
    """
    own = [each for each in text.outline.declarations if each.span.source.name == text.source.name]
    named = next((each for each in own if isinstance(each, ast.MissionName)), None)
    if named is None:
        return []
    offered = [(title, name) for name, title in COMMANDS.items() if name in commands]
    found = [_lens(text, named, types.Command(title, name, arguments=[text.uri])) for title, name in offered]
    plan = last_plan(text, named.name.text, folders)
    return [*found, *_robustness(text, plan, own)] if plan else found


def _robustness(text: OpenText, plan: LastPlan, own: list[ast.Declaration]) -> Iterator[types.CodeLens]:
    since = ", mission changed since" if plan.changed else ""
    for declaration in own:
        if isinstance(declaration, ast.Require):
            known = [plan.robustness[name] for name in _names(text, declaration) if name in plan.robustness]
            if known:
                least = min(known)
                figure = f"{least:.3f}" if math.isfinite(least) else "unbounded"
                words = f"{'smallest ' * (len(known) > 1)}robustness {figure} (last plan{since})"
                yield _lens(text, declaration, types.Command(words, ""))


def _names(text: OpenText, require: ast.Require) -> list[str]:
    """Names of a requirement in the compiled mission: one, or one for each member of a family.

    Args:
        text: checked text.
        require: declaration, possibly without a label.
    """
    goals = text.mission.requirements if text.mission else ()
    body = require.body.span
    here = [goal.name for goal in goals if goal.formula.span.text == body.text]
    if require.label is None:
        return [goal.name for goal in goals if goal.formula.span == body]
    return [name for name in here if name.partition("[")[0] == require.label.text]


def _lens(text: OpenText, declaration: ast.Declaration, command: types.Command) -> types.CodeLens:
    start = text.places.position(declaration.span.start)
    return types.CodeLens(types.Range(start, start), command)
