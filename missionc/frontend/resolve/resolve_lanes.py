"""Resolution of the user's own roadmap: nodes and edges of a GraphML file in metres and seconds.

says MC031 MC032
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from missionc import ir
from missionc.base.diagnostics import code
from missionc.base.diagnostics.model import Diagnostic, Label
from missionc.base.diagnostics.suggest import suggestion
from missionc.base.plain_number import plain_number
from missionc.base.source import Span
from missionc.base.units import Seconds
from missionc.frontend.resolve.context import REPORTED, Context
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
