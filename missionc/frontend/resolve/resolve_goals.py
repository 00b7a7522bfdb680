"""Resolution of requirements and preferences with their labels, of the objective and of the ``solve`` settings.

says MC102 MC206 MC209 MC210

Resolution of the user's own roadmap: nodes and edges of a GraphML file in metres and seconds.

says MC031 MC032
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

from missionc import ir
from missionc.backends.registry import AUTO, BACKENDS
from missionc.base.diagnostics import code
from missionc.base.diagnostics.model import Diagnostic, Label
from missionc.base.diagnostics.suggest import suggestion
from missionc.base.extensions import INSTALL
from missionc.base.source import Span
from missionc.base.units import Dimension, Seconds, plain_number
from missionc.frontend.resolve.context import REPORTED, Context
from missionc.frontend.resolve.resolve_formulas import resolve_goal
from missionc.frontend.resolve.resolve_quantities import excerpt, resolved_number, whole
from missionc.frontend.resolve.resolve_settings import known_settings, relation, said_twice, unknown_word
from missionc.frontend.syntax import ast

if TYPE_CHECKING:
    from missionc.frontend.syntax.graphml import Data, Graphml


OF_A_NODE, OF_AN_EDGE = ("x", "y", "z"), ("speed", "duration")
READ = {"node": OF_A_NODE, "edge": OF_AN_EDGE, "all": (*OF_A_NODE, *OF_AN_EDGE)}
GIVEN_OUT = {"node": ("labels", "starts"), "edge": ("steps", "length"), "all": ()}
"""Attributes that ``missionc.roadmap_graphs`` writes and that the reader ignores, by the kind of element."""


def resolve_lanes(context: Context, setting: ast.FileSetting) -> ir.Lanes | None:
    """Roadmap of the setting ``roadmap = "PATH"``, or None if it is invalid, which is reported."""
    if setting.source is None:
        return None
    from missionc.frontend.syntax.graphml import read_graphml  # few missions have one

    graph = read_graphml(setting.source)
    if isinstance(graph, Diagnostic):
        context.findings.append(graph)
        return None
    before = len(context.findings)
    _attributes_known(context, graph)
    nodes = _nodes(context, graph)
    lanes = _lanes(context, graph, {node.name: number for number, node in enumerate(nodes)})
    if not nodes:
        _wrong(context, Span(setting.source, 0, 0), "no nodes")
    return ir.Lanes(setting.path, nodes, lanes, setting.span) if len(context.findings) == before else None


def _attributes_known(context: Context, graph: Graphml) -> None:
    for (owner, name), span in graph.keys.items():
        if name in READ[owner] or name in GIVEN_OUT[owner]:
            continue
        takes = f"delete the attribute `{name[:40]}`"
        context.report(
            code.LANE_ATTRIBUTE,
            f"unknown attribute `{name[:40]}` of {'an edge' if owner == 'edge' else 'a node'}",
            span,
            help=suggestion(name, READ[owner], takes),
        )


def _nodes(context: Context, graph: Graphml) -> tuple[ir.LaneNode, ...]:
    axes = OF_A_NODE[: context.dimension]
    first: dict[str, Span] = {}
    nodes = []
    for node in graph.nodes:
        if node.name in first:
            _wrong(context, node.span, f"duplicate node `{node.name[:40]}`", first[node.name])
            continue
        first[node.name] = node.span
        if len(node.name) > context.limits.name_length:
            _wrong(context, node.span, f"the name of a node is longer than {context.limits.name_length} characters")
        missing = [axis for axis in axes if axis not in node.data]
        if missing:
            _attribute(
                context, node.span, f"node `{node.name[:40]}` has no `{missing[0]}`", "add its coordinates, in metres"
            )
        place = tuple(_number(context, node.data, axis, -math.inf) for axis in axes if axis in node.data)
        nodes.append(ir.LaneNode(node.name, place, node.span))
    return tuple(nodes)


def _lanes(context: Context, graph: Graphml, numbers: dict[str, int]) -> tuple[ir.Lane, ...]:
    lanes: dict[tuple[int, int], ir.Lane] = {}
    for edge in graph.edges:
        unknown = [end for end in (edge.source, edge.target) if end not in numbers]
        if unknown:
            _wrong(context, edge.span, f"unknown node `{unknown[0][:40]}`")
            continue
        if edge.source == edge.target:
            _wrong(context, edge.span, f"the edge of `{edge.source[:40]}` leads to itself")
            continue
        speed = _number(context, edge.data, "speed", 0.0) if "speed" in edge.data else math.inf
        duration = _number(context, edge.data, "duration", 0.0) if "duration" in edge.data else 0.0
        ends = numbers[edge.source], numbers[edge.target]
        for pair in (ends,) if edge.one_way else (ends, ends[::-1]):
            if pair in lanes:
                says = f"duplicate edge from `{edge.source[:40]}` to `{edge.target[:40]}`"
                _wrong(context, edge.span, says, lanes[pair].span)
                break
            lanes[pair] = ir.Lane(*pair, speed, Seconds(duration), edge.span)
    return tuple(lanes[pair] for pair in sorted(lanes))


def _number(context: Context, data: Data, name: str, above: float) -> float:
    """Value of a numeric attribute; NaN if it is invalid, which is reported."""
    text, span = data[name]
    value = plain_number(text)
    if abs(value) <= context.limits.magnitude and value > above:
        return value
    wanted = "a number above 0" if above == 0 else "a number"
    _attribute(context, span, f"`{name}` is `{text[:40]}`; expected {wanted}", f"write {wanted} in metres and seconds")
    return REPORTED


# ------------------------------------------------------------------ messages


def _attribute(context: Context, span: Span, message: str, way_out: str) -> None:
    context.report(code.LANE_ATTRIBUTE, message, span, help=way_out)


def _wrong(context: Context, span: Span, reason: str, first: Span | None = None) -> None:
    labels = () if first is None else (Label(first, "first declared here"),)
    message = f"`{span.source.name}` is not a roadmap: {reason}"
    context.report(code.NOT_GRAPHML, message, span, labels=labels, help="correct the file")


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
