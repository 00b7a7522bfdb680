"""Resolution of comparisons, route bounds and headings.

    says MC101 MC104 MC201 MC204 MC205 MC208 MC209 MC210 MC303

The two sides of a comparison become one linear expression over states and distances. A route bound is in hops, metres
or a weight of links, and has the graph of the route. A heading is an angle to either side of a direction or of a
beacon.
"""

from __future__ import annotations

import math
from fractions import Fraction

from missionc import ir
from missionc.base.diagnostics import code
from missionc.base.diagnostics.model import Fix, Label
from missionc.base.source import Span
from missionc.base.units import Dimension, Metres, Metric
from missionc.frontend.resolve.context import (
    AGENTS,
    PLAIN,
    REPORTED,
    UNRESOLVED,
    Amount,
    Context,
    Declared,
    Kind,
    Typed,
    Unresolved,
    some_of,
)
from missionc.frontend.resolve.resolve_agents import resolve_set
from missionc.frontend.resolve.resolve_quantities import (
    MINUS,
    NO_AMOUNT,
    POWERS,
    added,
    evaluate,
    excerpt,
    is_reported,
    resolved_number,
    scaled,
    shown,
    swapped,
    whole,
    with_unit_of,
)
from missionc.frontend.resolve.resolve_shapes import counted_points
from missionc.frontend.syntax import ast
from missionc.ir import About


def resolve_length(context: Context, length: ast.Length) -> ir.Length:
    """Bounds of a route's length; 0 and infinite if omitted."""
    low = length.low
    if low is not None and length.high is not None and length.metric is Metric.METRES:
        low = with_unit_of(low, length.high, Dimension.LENGTH)
    graph = _graph(context, length)
    weight = None if length.unit is None else _weight(context, length.unit, graph)
    lowest = 0.0 if low is None else _bound(context, length, low)
    highest = math.inf if length.high is None else _bound(context, length, length.high)
    if lowest > highest:
        most, least = (_with_unit(length, bound) for bound in (highest, lowest))
        context.report(
            code.BOUNDS_REVERSED,
            f"bounds reversed: {least} is greater than {most}",
            length.span,
            help="write the smaller bound first",
            fix=_swapped(length),
        )
    return ir.Length(graph, length.metric, lowest, highest, length.span, weight)


def _with_unit(length: ast.Length, bound: float) -> str:
    if length.metric is Metric.HOPS:
        return f"{shown(bound)} {'hop' if bound == 1 else 'hops'}"
    return f"{shown(bound)} m" if length.unit is None else f"{length.unit.text} {shown(bound)}"


def _weight(context: Context, unit: ast.Name, graph: ir.Graph) -> ir.Weight:
    """Link weight of a graph by name; a weight of 1 for every link if the name is unknown, which is reported."""
    named = {weight.name: weight for weight in graph.weights}
    if unit.text not in named and graph.name:
        has = f"its weights are {some_of(list(named))}" if named else "it has no weights"
        context.report_unknown(
            code.UNKNOWN_NAME,
            f"graph `{graph.name}` has no weight `{unit.text}`; {has}",
            unit.span,
            unit.text,
            ["hops", "distance", *named],
            f"declare the weight: `graph {graph.name} = … weight {unit.text} 1`",
            (Label(graph.span, "declared here"),),
        )
    return named.get(unit.text, ir.Weight(unit.text, 1, ()))


def _swapped(length: ast.Length) -> Fix | None:
    """Fix that exchanges the bounds of a length, or None if only one is written."""
    if length.low is None or length.high is None:
        return None
    return swapped(length.low, length.high, "..", lends=length.metric is Metric.METRES)


def _bound(context: Context, length: ast.Length, bound: ast.Quantity) -> float:
    if length.metric is Metric.HOPS:
        return whole(context, bound, "the number of hops")
    if length.unit is not None:
        return whole(context, bound, f"the bound of `{length.unit.text}`")
    return resolved_number(context, bound, Dimension.LENGTH, "the length of a route", least=0)


def _graph(context: Context, length: ast.Length) -> ir.Graph:
    """Graph that a route's bounds name, or the only graph of the mission."""
    if length.graph is not None:
        declared = context.find(length.graph, Kind.GRAPH)
        stand_in = no_graph(length.graph.span)
        return stand_in if isinstance(declared, Unresolved) else context.graphs.get(length.graph.text, stand_in)
    if len(context.graphs) != 1:
        _which_graph(context, length)
        return no_graph(length.span)
    return next(iter(context.graphs.values()))


def no_graph(span: Span) -> ir.Graph:
    """Replacement for a graph that is invalid and has been reported."""
    return ir.Proximity("", Metres(REPORTED), (), span)


def _which_graph(context: Context, length: ast.Length) -> None:
    names = list(context.graphs)
    end = length.span.end - 1  # before the bracket
    labels = tuple(Label(graph.span) for graph in list(context.graphs.values())[:3])
    context.report(
        code.GRAPH_MISSING,
        f"missing graph: the mission has {len(names) or 'no'} graphs",
        length.span,
        labels=labels,
        help=f"add `on` and one of the graphs {some_of(names)}"
        if names
        else "declare a graph: `graph radio = proximity 1 m`",
        fix=Fix(Span(length.span.source, end, end), f" on {names[0]}") if names else None,
    )


def resolve_facing(context: Context, facing: ast.Facing) -> Typed:
    """Resolved formula for ``heading within 10 deg of 90 deg``.

    Always true if a part of it is invalid, which is reported.
    """
    within, towards = _within(context, facing.within), _towards(context, facing.towards)
    if math.isnan(within) or (isinstance(towards, float) and math.isnan(towards)):
        return Typed(ir.Truth(True, facing.span), About.EITHER, facing.span)
    return Typed(ir.Holds(ir.Facing(towards, within), facing.span), About.AGENT, facing.span)


def _within(context: Context, angle: ast.Quantity) -> float:
    value = resolved_number(context, angle, Dimension.ANGLE, "the angle to either side", above=0)
    if value < math.pi or math.isnan(value):
        return value
    context.report(
        code.VALUE_OUT_OF_RANGE,
        f"the angle to either side is {shown(math.degrees(value))} deg; it must be less than 180 deg",
        angle.span,
        help="write a smaller angle, with its unit",
    )
    return REPORTED


def _towards(context: Context, towards: ast.Quantity) -> float | ir.Beacon:
    if not isinstance(towards, ast.Name):
        return resolved_number(context, towards, Dimension.ANGLE, "the direction")
    declared = context.names.declared.get(towards.text)
    if declared is not None and declared.kind is Kind.REGION:
        _no_place(context, towards, declared)
        return REPORTED
    found = context.find(towards, Kind.PARAM, Kind.BEACON, needed="an angle or a beacon")
    if isinstance(found, Unresolved):
        return REPORTED
    if found.kind is Kind.PARAM:
        return resolved_number(context, towards, Dimension.ANGLE, "the direction")
    return context.beacons.get(towards.text, REPORTED)


# ------------------------------------------------------------------ messages


def _no_place(context: Context, name: ast.Name, declared: Declared) -> None:
    region = context.regions.get(name.text)
    where = _middle(region.shape) if region is not None else None
    place = "(X, Y)" if where is None else f"({', '.join(map(shown, where))})"
    context.report(
        code.WRONG_KIND,
        f"expected an angle or a beacon, found a region `{name.text}`",
        name.span,
        labels=(Label(declared.span, "declared here"),),
        help=f"declare a beacon, for example `beacon {name.text}_middle = {place}`",
    )


def _middle(shape: ir.Shape) -> ir.Vector | None:
    match shape:
        case ir.Box(low, high):
            return tuple((begin + end) / 2 for begin, end in zip(low, high, strict=True))
        case ir.Disc(centre, _, None):
            return centre
        case _:
            return None


AXES = {"x": 0, "y": 1, "z": 2}
NOTHING = Fraction(0)


def resolve_comparison(context: Context, comparison: ast.Compare) -> Typed:
    """Resolved comparison: ``left >= right`` as ``left - right >= 0``, and ``left <= right`` as ``right - left
    >= 0``.
    """
    left = evaluate(context, comparison.left, state_of)
    right = evaluate(context, comparison.right, state_of)
    amount = added(context, comparison, left, scaled(right, MINUS))
    if comparison.operator in ("<", "<="):
        amount = scaled(amount, MINUS)
    stand_in = Typed(ir.Truth(True, comparison.span), About.EITHER, comparison.span)
    if is_reported(amount):
        return stand_in
    if not amount.terms:
        _nothing_changes(context, comparison)
        return stand_in
    features = [feature for _, feature in amount.terms]
    between = [feature for feature in features if isinstance(feature, ir.DistanceBetween)]
    if between and len(between) < len(features):
        _mixed(context, comparison)
        return stand_in
    about = About.TEAM if between else About.AGENT
    predicate = ir.Compare(amount.terms, amount.constant + 0.0, comparison.operator in ("<", ">"))
    return Typed(ir.Holds(predicate, comparison.span), about, comparison.span)


def state_of(context: Context, state: ast.Name | ast.Distance) -> Amount:
    """Amount for a state word or a distance, with its unit."""
    match state:
        case ast.Distance():
            return _distance(context, state)
        case ast.Name(text="speed"):
            return Amount(NOTHING, POWERS[Dimension.SPEED], ((1.0, ir.Speed()),))
        case ast.Name(text="altitude"):
            return Amount(NOTHING, POWERS[Dimension.LENGTH], ((1.0, ir.Altitude()),))
        case ast.Name(text=text) if text in context.resources:
            return Amount(NOTHING, PLAIN, ((1.0, ir.Level(context.resources[text])),))
        case ast.Name(text=text) if context.dimension == 2 and AXES[text] == 2:
            context.report(
                code.WRONG_DIMENSION,
                f"unexpected `{text}`: the world has {counted_points(2)}",
                state.span,
                help="write `altitude` in place of `{text}`",
                fix=Fix(state.span, "altitude"),
            )
            return NO_AMOUNT
        case ast.Name(text=text):
            return Amount(NOTHING, POWERS[Dimension.LENGTH], ((1.0, ir.Coordinate(AXES[text])),))


def _distance(context: Context, distance: ast.Distance) -> Amount:
    feature: ir.Feature | Unresolved
    match distance.ends:
        case (end,):
            feature = _distance_to(context, end)
        case (first, second):
            feature = _distance_between(context, distance, first, second)
        case ends:
            context.report(
                code.WRONG_KIND,
                f"`distance` takes one or two arguments; found {len(ends)}",
                distance.span,
                help="write, for example, `distance(base)` or `distance(drone[0], drone[1])`",
            )
            return NO_AMOUNT
    return (
        NO_AMOUNT if isinstance(feature, Unresolved) else Amount(NOTHING, POWERS[Dimension.LENGTH], ((1.0, feature),))
    )


def _distance_to(context: Context, end: ast.Name | ast.Member) -> ir.DistanceTo | Unresolved:
    if isinstance(end, ast.Name):
        place = context.regions.get(end.text) or context.beacons.get(end.text)
        if place is not None:
            return ir.DistanceTo(place)
    agent = compared_agent(context, end, "a region, a beacon or one agent", Kind.REGION, Kind.BEACON)
    return agent if isinstance(agent, Unresolved) else ir.DistanceTo(agent)


def _distance_between(
    context: Context, distance: ast.Distance, first: ast.Name | ast.Member, second: ast.Name | ast.Member
) -> ir.DistanceBetween | Unresolved:
    one = compared_agent(context, first, "one agent")
    if isinstance(one, Unresolved):
        return UNRESOLVED
    other = compared_agent(context, second, "one agent")
    if isinstance(other, Unresolved):
        return UNRESOLVED
    if one == other:
        context.report(
            code.VALUE_OUT_OF_RANGE,
            "the distance of an agent to itself is always 0",
            distance.span,
            help="name two different agents",
        )
        return UNRESOLVED
    return ir.DistanceBetween(min(one, other), max(one, other))


def compared_agent(context: Context, reference: ast.Name | ast.Member, needed: str, *also: Kind) -> int | Unresolved:
    """Index of the single agent that a reference names, or ``UNRESOLVED`` if it is invalid, which is reported."""
    name = reference if isinstance(reference, ast.Name) else reference.team
    declared = context.find(name, *AGENTS, *also, needed=needed)
    if isinstance(declared, Unresolved):
        return UNRESOLVED
    several = isinstance(reference, ast.Member) and reference.high is not None
    if several or (isinstance(reference, ast.Name) and declared.kind is not Kind.AGENT):
        _several(context, reference, declared, needed)
        return UNRESOLVED
    agents = resolve_set(context, reference).agents
    return agents[0] if agents else UNRESOLVED


# ------------------------------------------------------------------ messages


def _nothing_changes(context: Context, comparison: ast.Compare) -> None:
    context.report(
        code.WRONG_KIND,
        f"the comparison `{excerpt(comparison.span)}` is constant in time",
        comparison.span,
        help="compare a state such as `x`, or a `distance(…)`",
    )


def _mixed(context: Context, comparison: ast.Compare) -> None:
    context.report(
        code.QUANTIFIER_TOO_MANY,
        f"`{excerpt(comparison.span)}` mixes the state of one agent with the distance of two named agents",
        comparison.span,
        help="split the comparison into two",
    )


def _several(context: Context, reference: ast.Name | ast.Member, declared: Declared, needed: str) -> None:
    kind = declared.kind.value if isinstance(reference, ast.Name) else "several agents"
    team = declared.declaration.name.text if declared.kind is Kind.TEAM else "drone"
    context.report(
        code.WRONG_KIND,
        f"expected {needed}, found {kind} `{excerpt(reference.span)}`",
        reference.span,
        labels=(Label(declared.span, "declared here"),),
        help=f"name one agent, for example `{team}[0]`",
    )
