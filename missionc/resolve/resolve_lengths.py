"""Resolution of route bounds: hops, metres or a weight of links, and the graph that the route runs on.

says MC101 MC201 MC208 MC209 MC210 MC303
"""

from __future__ import annotations

import math

from missionc import ir
from missionc.base.source import Span
from missionc.base.units import Dimension, Metres
from missionc.diagnostics import code
from missionc.diagnostics.model import Fix, Label
from missionc.diagnostics.suggest import nearest
from missionc.resolve.context import REPORTED, Context
from missionc.resolve.names import Kind, Unresolved, some_of
from missionc.resolve.resolve_quantities import number, shown, swapped, whole, with_unit_of
from missionc.syntax import ast


def resolve_length(context: Context, length: ast.Length) -> ir.Length:
    """The bounds; the lower one is 0 and the upper one infinite where they are left out."""
    low = length.low
    if low is not None and length.high is not None and length.metric is ast.Metric.METRES:
        low = with_unit_of(low, length.high, Dimension.LENGTH)
    graph = _graph(context, length)
    weight = None if length.unit is None else _weight(context, length.unit, graph)
    lowest = 0.0 if low is None else _bound(context, length, low)
    highest = math.inf if length.high is None else _bound(context, length, length.high)
    if lowest > highest:
        most, least = (_with_unit(length, bound) for bound in (highest, lowest))
        context.report(
            code.BOUNDS_REVERSED,
            f"bounds run backwards: {most} comes after {least}",
            length.span,
            help="write the smaller bound first",
            fix=_swapped(length),
        )
    return ir.Length(graph, length.metric, lowest, highest, length.span, weight)


def _with_unit(length: ast.Length, bound: float) -> str:
    if length.metric is ast.Metric.HOPS:
        return f"{shown(bound)} {'hop' if bound == 1 else 'hops'}"
    return f"{shown(bound)} m" if length.unit is None else f"{length.unit.text} {shown(bound)}"


def _weight(context: Context, unit: ast.Name, graph: ir.Graph) -> ir.Weight:
    """The weight of that name; one that weighs every link 1 once it is reported that there is none."""
    named = {weight.name: weight for weight in graph.weights}
    if unit.text not in named and graph.name:
        near = nearest(unit.text, ["hops", "distance", *named])
        has = f"its links have {some_of(list(named))}" if named else "its links have none"
        context.report(
            code.UNKNOWN_NAME,
            f"no weight of graph `{graph.name}` is called `{unit.text}`; {has}",
            unit.span,
            labels=(Label(graph.span, "declared here"),),
            help=f"did you mean `{near}`?"
            if isinstance(near, str)
            else f"a length is in `hops`, in `distance`, or in a weight: `graph {graph.name} = … weight {unit.text} 1`",
            fix=Fix(unit.span, near) if isinstance(near, str) else None,
        )
    return named.get(unit.text, ir.Weight(unit.text, 1, ()))


def _swapped(length: ast.Length) -> Fix | None:
    """None where only one bound is written."""
    if length.low is None or length.high is None:
        return None
    return swapped(length.low, length.high, "..", lends=length.metric is ast.Metric.METRES)


def _bound(context: Context, length: ast.Length, bound: ast.Quantity) -> float:
    if length.metric is ast.Metric.HOPS:
        return whole(context, bound, "the number of hops")
    if length.unit is not None:
        return whole(context, bound, f"the bound of `{length.unit.text}`")
    return number(context, bound, Dimension.LENGTH, "the length of a route", least=0)


def _graph(context: Context, length: ast.Length) -> ir.Graph:
    """The graph named, or the only one there is."""
    if length.graph is not None:
        declared = context.find(length.graph, Kind.GRAPH)
        stand_in = no_graph(length.graph.span)
        return stand_in if isinstance(declared, Unresolved) else context.graphs.get(length.graph.text, stand_in)
    if len(context.graphs) != 1:
        _which_graph(context, length)
        return no_graph(length.span)
    return next(iter(context.graphs.values()))


def no_graph(span: Span) -> ir.Graph:
    """In place of a graph that has been reported."""
    return ir.Proximity("", Metres(REPORTED), (), span)


def _which_graph(context: Context, length: ast.Length) -> None:
    names = list(context.graphs)
    end = length.span.end - 1  # before the bracket
    labels = tuple(Label(graph.span) for graph in list(context.graphs.values())[:3])
    context.report(
        code.GRAPH_MISSING,
        f"the mission has {len(names) or 'no'} graphs; this does not say which is meant",
        length.span,
        labels=labels,
        help=f"add `on NAME`: {some_of(names)}" if names else "declare one: `graph radio = proximity 1 m`",
        fix=Fix(Span(length.span.source, end, end), f" on {names[0]}") if names else None,
    )
