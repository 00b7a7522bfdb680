"""Resolution of requirements and preferences with their labels, of the objective and of the ``solve`` settings.

says MC102 MC206 MC209 MC210
"""

from __future__ import annotations

import math
from dataclasses import replace

from missionc import ir
from missionc.backends.registry import AUTO, BACKENDS
from missionc.base.diagnostics import code
from missionc.base.diagnostics.model import Diagnostic, Label
from missionc.base.extensions import INSTALL
from missionc.base.source import Span
from missionc.base.units import Dimension
from missionc.frontend.resolve.context import Context
from missionc.frontend.resolve.resolve_formulas import resolve_goal
from missionc.frontend.resolve.resolve_lanes import resolve_lanes
from missionc.frontend.resolve.resolve_quantities import excerpt, resolved_number, whole
from missionc.frontend.resolve.resolve_settings import known_settings, relation, said_twice, unknown_word
from missionc.frontend.syntax import ast

OPTIONS = ("nodes", "neighbors")
"""Names of the ``solve with`` settings whose values are integers, at least 1."""

CONNECTIVITY = "connectivity"
"""Name of the ``solve with`` setting whose value is a word."""

ROADMAP = "roadmap"
"""Name of the ``solve with`` setting whose value is a file."""


def resolve_requirements(
    context: Context, program: ast.Program
) -> tuple[tuple[ir.Requirement, ...], tuple[ir.Preference, ...]]:
    """Requirements and preferences of a mission; without a label, the name is ``requirement 3`` by its position."""
    requirements: list[ir.Requirement] = []
    preferences: list[ir.Preference] = []
    labels: dict[str, ast.Name] = {}
    for item in program.declarations:
        match item:
            case ast.Require(label=label):
                name = _label(context, label, f"requirement {len(requirements) + 1}", labels)
                requirements.append(ir.Requirement(name, _formula(context, item), item.span))
            case ast.Prefer(label=label):
                name = _label(context, label, f"preference {len(preferences) + 1}", labels)
                weight = _weight(context, item, name)
                preferences.append(ir.Preference(name, _formula(context, item), weight, item.span))
            case _:
                pass
    return tuple(requirements), tuple(preferences)


def _label(context: Context, label: ast.Name | None, otherwise: str, labels: dict[str, ast.Name]) -> str:
    if label is None:
        return otherwise
    first = labels.setdefault(label.text, label)
    if first is not label:
        context.findings.append(_label_twice(label, first))
    return label.text


def _formula(context: Context, item: ast.Require | ast.Prefer) -> ir.Formula:
    """Formula of a requirement or preference.

    If the formula has no subject and the label names agents, a note on the finding explains how the label was read.
    """
    before = len(context.findings)
    formula = resolve_goal(context, item.body)
    if item.label is not None and item.label.text in context.sets:
        note = f"`{item.label.text}:` is the label here; write `LABEL: {item.label.text}: …` to name the agent"
        context.findings[before:] = [
            replace(finding, notes=(note,)) if finding.code is code.QUANTIFIER_MISSING else finding
            for finding in context.findings[before:]
        ]
    return formula


def _weight(context: Context, prefer: ast.Prefer, name: str) -> float:
    if prefer.weight is None:
        return 1.0
    return resolved_number(context, prefer.weight, Dimension.NUMBER, f"the weight of `{name}`", above=0)


def resolve_objective(context: Context, minimize: ast.Minimize | None) -> ir.Objective:
    if minimize is None:
        return ir.Objective.NONE
    word = "maximize" if isinstance(minimize, ast.Maximize) else "minimize"
    goals = {goal.value: goal for goal in ir.Objective if goal.word == word}
    if minimize.goal.text not in goals:
        unknown_word(context, minimize.goal, tuple(goals), f"`{word}`", "goal")
    return goals.get(minimize.goal.text, ir.Objective.NONE)


def resolve_solve(context: Context, solve: ast.Solve | None) -> ir.SolveWith:
    if solve is None:
        return ir.SolveWith()
    if solve.backend.text != AUTO and solve.backend.text not in BACKENDS:
        unknown_word(context, solve.backend, (AUTO, *BACKENDS), "`solve with`", "backend", INSTALL)
    settings = known_settings(context, solve.settings, (*OPTIONS, CONNECTIVITY, ROADMAP), "`solve with`")
    options = []
    connectivity = ir.Connectivity.BOTTLENECK
    for name, setting in settings.items():
        relation(context, setting, "=", "")
        if name == ROADMAP:
            _no_file(context, setting.span)
            continue
        if name == CONNECTIVITY:
            connectivity = _connectivity(context, setting)
            continue
        value = whole(context, setting.high, f"`{name}`", least=1)
        if not math.isnan(value):
            options.append((name, value))
    return ir.SolveWith(
        solve.backend.text, tuple(options), connectivity, solve.span, _roadmap(context, solve, settings)
    )


def _roadmap(context: Context, solve: ast.Solve, settings: dict[str, ast.Setting]) -> ir.Lanes | None:
    """User's own roadmap of a mission, if there is one; its nodes replace the number of nodes in the mission."""
    files: dict[str, ast.FileSetting] = {}
    for file in solve.files:
        if file.name.text != ROADMAP:
            unknown_word(context, file.name, (ROADMAP,), "`solve with`", "file")
        elif ROADMAP in files:
            said_twice(context, f"`{ROADMAP}`", file.span, files[ROADMAP].span)
        else:
            files[ROADMAP] = file
    if ROADMAP not in files:
        return None
    for name in OPTIONS:
        if name in settings:
            _nodes_of_both(context, name, settings[name].span, files[ROADMAP].span)
    return resolve_lanes(context, files[ROADMAP])


def _connectivity(context: Context, setting: ast.Setting) -> ir.Connectivity:
    words = {each.value: each for each in ir.Connectivity}
    value = setting.high
    if not isinstance(value, ast.Name):
        value = ast.Name(value.span, excerpt(value.span))
    if value.text not in words:
        unknown_word(context, value, tuple(words), "`connectivity`", "value")
    return words.get(value.text, ir.Connectivity.BOTTLENECK)


# ------------------------------------------------------------------ messages


def _label_twice(label: ast.Name, first: ast.Name) -> Diagnostic:
    return Diagnostic(
        code.NAME_TWICE,
        f"two requirements are labelled `{label.text}`",
        Label(label.span, "second label"),
        labels=(Label(first.span, "first label"),),
        help="rename one of the two labels",
    )


def _no_file(context: Context, span: Span) -> None:
    context.report(
        code.UNKNOWN_SETTING, f"`{ROADMAP}` needs a file name", span, help=f'write `{ROADMAP} = "lanes.graphml"`'
    )


def _nodes_of_both(context: Context, name: str, span: Span, file: Span) -> None:
    context.report(
        code.UNKNOWN_SETTING,
        f"`{name}` sets a sampled roadmap, but this mission has its own roadmap",
        span,
        labels=(Label(file, "roadmap of the mission"),),
        help=f"delete `{name}`",
    )
