"""Code lenses: above a mission's name what can be done with it, above each requirement how robust the last plan is."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Iterator
from pathlib import Path

from lsprotocol import types

from missionc.lsp.last_plan import LastPlan, last_plan
from missionc.lsp.open_text import OpenText
from missionc.syntax import ast

COMMANDS = {"missionc.compile": "compile", "missionc.showReport": "report", "missionc.showMap": "map"}
"""The commands that a client may know, by what they are called above the text."""


def lenses(text: OpenText, commands: Collection[str], folders: Iterable[Path]) -> list[types.CodeLens]:
    """The lenses of a text.

    Args:
        text: once it is checked, if it is to say how robust its requirements are.
        commands: those that the client says it has; no other is offered.
        folders: where the compiler may have been called.
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
    since = ", changed since" if plan.changed else ""
    for declaration in own:
        if isinstance(declaration, ast.Require):
            known = [plan.robustness[name] for name in _names(text, declaration) if name in plan.robustness]
            if known:
                least = min(known)
                figure = f"{least:.3f}" if math.isfinite(least) else "unbounded"
                words = f"robustness {figure}{' at least' if len(known) > 1 else ''} (last plan{since})"
                yield _lens(text, declaration, types.Command(words, ""))


def _names(text: OpenText, require: ast.Require) -> list[str]:
    """What a requirement is called: each member of a family, by the compiler where it has no label."""
    goals = text.mission.requirements if text.mission else ()
    body = require.body.span
    here = [goal.name for goal in goals if goal.formula.span.text == body.text]
    if require.label is None:
        return [goal.name for goal in goals if goal.formula.span == body]
    return [name for name in here if name.partition("[")[0] == require.label.text]


def _lens(text: OpenText, declaration: ast.Declaration, command: types.Command) -> types.CodeLens:
    start = text.places.position(declaration.span.start)
    return types.CodeLens(types.Range(start, start), command)
