"""Resolution of graphs, resources and flags.

    says MC007 MC013 MC014 MC104 MC201 MC206 MC207 MC209 MC210 MC240 MC241

A graph has its agents and beacons, and the ranges of its links. A resource or flag has its agents, the region of each
change, and the change in a step.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import TypeAlias

from missionc import ir
from missionc.base.diagnostics import code
from missionc.base.diagnostics.model import Label
from missionc.base.source import Span
from missionc.base.units import UNITS, Dimension, Metres, Metric
from missionc.frontend.resolve.context import REPORTED, Context, Kind, Unresolved
from missionc.frontend.resolve.formula_findings import not_on_the_graph
from missionc.frontend.resolve.resolve_agents import resolve_set
from missionc.frontend.resolve.resolve_quantities import excerpt, resolved_number, shown
from missionc.frontend.resolve.resolve_quantities import whole as whole_number
from missionc.frontend.resolve.resolve_settings import missing, said_twice, unknown_word
from missionc.frontend.resolve.resolve_shapes import NOWHERE, too_many_parts
from missionc.frontend.syntax import ast
from missionc.ir.couplings import with_ranges
from missionc.ir.distances.convex_pieces import count_pieces

RATES = ("start", "capacity", "drain", "refill")
MARKS = ("set", "cleared")


def resolve_resource(context: Context, resource: ast.Resource) -> ir.Resource:
    name = resource.name.text
    given: dict[tuple[str, Dimension], ast.Rate] = {}
    values: dict[tuple[str, Dimension], float] = {}
    refills: list[ir.Refill] = []
    for rate in resource.rates:
        if rate.name.text not in RATES:
            unknown_word(context, rate.name, RATES, "`resource`", "setting")
            continue
        unit = _unit(context, rate)
        value = resolved_number(context, rate.value, Dimension.NUMBER, f"`{rate.name.text}` of `{name}`", least=0)
        if rate.name.text == "refill":
            region = None if rate.within is None else _region(context, rate.within)
            if unit is not None and region is not None:
                refills.append(ir.Refill(region, _per(rate, value)))
            continue
        key = rate.name.text, unit or Dimension.NUMBER
        if key in given:
            sum_of_both = "write the sum of both rates" if rate.name.text == "drain" else None
            said_twice(context, f"`{excerpt(given[key].span)}`", rate.span, given[key].span, help=sum_of_both)
        given.setdefault(key, rate)
        values.setdefault(key, _per(rate, value))
    start = values.get(("start", Dimension.NUMBER), REPORTED)
    if not any(rate.name.text == "start" for rate in resource.rates):
        missing(context, f"the start of `{name}`", resource.name.span, "add `start 100`")
    capacity = values.get(("capacity", Dimension.NUMBER), start)
    if start > capacity:
        context.report(
            code.VALUE_OUT_OF_RANGE,
            f"`{name}` starts at {shown(start)}; its capacity is {shown(capacity)}",
            given["start", Dimension.NUMBER].span,
            help=f"start at {shown(capacity)} or less",
        )
    return ir.Resource(
        name,
        resolve_set(context, resource.agents).agents,
        start,
        capacity,
        values.get(("drain", Dimension.TIME), 0.0),
        values.get(("drain", Dimension.LENGTH), 0.0),
        tuple(refills),
        resource.name.span,
    )


def resolve_flag(context: Context, flag: ast.Flag) -> ir.Flag:
    name = flag.name.text
    marks: dict[str, ast.Mark] = {}
    for mark in flag.marks:
        word = mark.name.text
        if word not in MARKS:
            unknown_word(context, mark.name, MARKS, "`flag`", "setting")
        elif word in marks:
            one, other = marks[word].within.text, mark.within.text
            either = f"declare `region either = {one} + {other}` and write `{word} in either`"
            union = None if one == other else either
            said_twice(context, f"`{word}`", mark.span, marks[word].span, help=union)
        else:
            marks[word] = mark
    if "set" not in marks and all(mark.name.text in MARKS for mark in flag.marks):
        missing(context, f"the `set` region of `{name}`", flag.name.span, "add `set in REGION`")
    regions = {word: _region(context, mark.within) for word, mark in marks.items()}
    nowhere = ir.Region(name, NOWHERE, flag.span)
    agents = resolve_set(context, flag.agents).agents
    return ir.Flag(name, agents, regions.get("set", nowhere), regions.get("cleared"), flag.name.span)


def _region(context: Context, name: ast.Name) -> ir.Region:
    found = context.find(name, Kind.REGION)
    nowhere = ir.Region(name.text, NOWHERE, name.span)
    return nowhere if isinstance(found, Unresolved) else context.regions.get(name.text, nowhere)


def _unit(context: Context, rate: ast.Rate) -> Dimension | None:
    """Dimension of a rate's denominator; None if there is none, or if it does not fit the word, which is reported."""
    unit = None if rate.unit is None else UNITS.get(rate.unit.text, (None,))[0]
    match rate.name.text, rate.unit is not None, rate.within is not None:
        case (("start" | "capacity"), False, False):
            return None
        case "drain", True, False if unit in (Dimension.TIME, Dimension.LENGTH):
            return unit
        case "refill", True, True if unit is Dimension.TIME:
            return unit
        case ("drain", True, False) | ("refill", True, True):
            assert rate.unit is not None
            wanted = "a time or a length, such as `s` or `m`" if rate.name.text == "drain" else "a time, such as `s`"
            context.report(
                code.WRONG_UNIT,
                f"`{rate.name.text}` is per {wanted}, not per `{rate.unit.text}`",
                rate.unit.span,
                help=f"write `{_form(rate)}`",
            )
        case _:
            context.report(
                code.UNKNOWN_SETTING,
                f"invalid form of `{rate.name.text}`",
                rate.span,
                help=f"write `{_form(rate)}`",
            )
    return None


def _per(rate: ast.Rate, value: float) -> float:
    """Value of a rate in SI units."""
    factor = 1.0 if rate.unit is None else UNITS.get(rate.unit.text, (None, math.nan))[1]
    return value / factor


def _form(rate: ast.Rate) -> str:
    written = excerpt(rate.value.span)
    match rate.name.text:
        case "drain":
            return f"drain {written} per s` or `drain {written} per m"
        case "refill":
            return f"refill {written} per s in REGION"
        case word:
            return f"{word} {written}"


Ends: TypeAlias = tuple[frozenset[int], frozenset[int]]
"""Agents at the two ends of links: senders and receivers."""

HEAVIEST = 100
"""Maximum weight of a link, because route search distinguishes every sum of weights."""


def resolve_graph(context: Context, graph: ast.Graph) -> ir.Graph:
    name = graph.name.text
    radius = Metres(0.0)
    if graph.radius is not None:
        radius = Metres(resolved_number(context, graph.radius, Dimension.LENGTH, f"the radius of `{name}`", above=0))
    whole = _of_one_range(context, graph, radius)
    if graph.ranges:
        whole = with_ranges(whole, radius, _ranges(context, graph, whole))
    return replace(whole, weights=_weights(context, graph, whole)) if graph.weights else whole


def _of_one_range(context: Context, graph: ast.Graph, radius: Metres) -> ir.Graph:
    name = graph.name.text
    agents = context.everyone if graph.over is None else resolve_set(context, graph.over).agents
    if graph.kind == "proximity":
        return ir.Proximity(name, radius, agents, graph.name.span)
    if graph.kind == "sight":
        return ir.Sight(name, radius, _shapes_in_the_way(context, graph), agents, graph.name.span)
    if not context.beacons:
        missing(context, f"a beacon for `{name}`", graph.span, "declare a beacon, for example `beacon mast = (1, 1)`")
    beacons = tuple(beacon.position for beacon in context.beacons.values())
    return ir.BeaconCover(name, radius, beacons, agents, graph.name.span)


def _ranges(context: Context, graph: ast.Graph, whole: ir.Graph) -> tuple[ir.PairRange, ...]:
    """Link ranges for pairs of agents."""
    ranges = []
    for pair, senders, receivers in _pairs(context, graph.ranges, whole, "range"):
        what = f"the range from `{excerpt(pair.senders.span)}` to `{excerpt(pair.receivers.span)}`"
        radius = Metres(resolved_number(context, pair.value, Dimension.LENGTH, what, above=0))
        ranges.append(ir.PairRange(senders, receivers, radius))
    return tuple(ranges)


def _weights(context: Context, graph: ast.Graph, whole: ir.Graph) -> tuple[ir.Weight, ...]:
    """Weights that a graph declares for its links."""
    weights: dict[str, tuple[Span, ir.Weight]] = {}
    for weight in graph.weights:
        name = weight.name.text
        if name in weights:
            said_twice(context, f"the weight `{name}`", weight.name.span, weights[name][0])
            continue
        if name == Metric.HOPS.value:
            _named_like_hops(context, weight)
        others = _heavy(context, weight.value, f"`{name}`")
        pairs = [
            ir.PairWeight(
                senders,
                receivers,
                _heavy(
                    context,
                    pair.value,
                    f"`{name}` from `{excerpt(pair.senders.span)}` to `{excerpt(pair.receivers.span)}`",
                ),
            )
            for pair, senders, receivers in _pairs(context, weight.pairs, whole, "weight")
        ]
        weights[name] = weight.name.span, ir.Weight(name, others, tuple(pairs))
    return tuple(weight for _, weight in weights.values())


def _named_like_hops(context: Context, weight: ast.Weight) -> None:
    context.report(
        code.NAME_NOT_ALLOWED,
        "a weight cannot be named `hops`, which counts links",
        weight.name.span,
        help="choose another name, such as `cost`",
    )


def _heavy(context: Context, quantity: ast.Quantity, what: str) -> int:
    value = whole_number(context, quantity, what, least=1)
    if value > HEAVIEST:
        context.report(
            code.VALUE_OUT_OF_RANGE,
            f"{what} is {shown(value)}; it must be at most {HEAVIEST}",
            quantity.span,
            help="choose a larger unit for the weight",
        )
    return int(value) if 1 <= value <= HEAVIEST else 1


def _pairs(
    context: Context, pairs: tuple[ast.OfPair, ...], whole: ir.Graph, what: str
) -> Iterator[tuple[ast.OfPair, frozenset[int], frozenset[int]]]:
    """Yield the declared pairs with their senders and receivers, without pairs that repeat an earlier one, which is
    reported.
    """
    said: dict[ast.OfPair, tuple[frozenset[int], frozenset[int]]] = {}
    for pair in pairs:
        senders, receivers = (_ends(context, end, whole) for end in (pair.senders, pair.receivers))
        if not senders or not receivers:
            continue
        if senders == receivers and len(senders) == 1:
            _to_itself(context, pair, next(iter(senders)), what)
            continue
        of_both = ((before, _common(known, (senders, receivers))) for before, known in said.items())
        again = next(((before, ends) for before, ends in of_both if ends is not None), None)
        if again is None:
            said[pair] = senders, receivers
            yield pair, senders, receivers
        else:
            _said_before(context, pair, *again, what)


def _ends(context: Context, end: ast.Name | ast.Member, whole: ir.Graph) -> frozenset[int]:
    agents = frozenset(resolve_set(context, end).agents)
    strangers = sorted(agents.difference(whole.agents))
    if strangers and whole.agents:
        not_on_the_graph(context, end, whole, strangers)
        return frozenset()
    return agents


def _common(known: Ends, ends: Ends) -> tuple[int, int] | None:
    """Pair of agents (sender and receiver) to which both declarations apply; None if there is none."""
    first, second = (sorted(one & other) for one, other in zip(known, ends, strict=True))
    return next(((one, other) for one in first[:2] for other in second[:2] if one != other), None)


def _said_before(context: Context, pair: ast.OfPair, before: ast.OfPair, ends: tuple[int, int], what: str) -> None:
    one, other = (context.agents[agent].name for agent in ends)
    context.report(
        code.RANGE_SAID_TWICE,
        f"the {what} from `{one}` to `{other}` is given twice",
        pair.span,
        labels=(Label(before.span, "first given here"),),
        help="delete one of the two",
    )


def _to_itself(context: Context, pair: ast.OfPair, agent: int, what: str) -> None:
    name = context.agents[agent].name
    context.report(
        code.RANGE_TO_ITSELF,
        f"a {what} from `{name}` to itself has no effect",
        pair.span,
        notes=("no agent is linked to itself",),
        help=f"delete the {what}",
    )


def _shapes_in_the_way(context: Context, graph: ast.Graph) -> tuple[ir.Shape, ...]:
    """Shapes of the static obstacles, which block lines of sight; ``check_graphs`` reports the moving ones."""
    shapes = tuple(each.shape for each in context.obstacles.values() if each.constant)
    count = sum(count_pieces(shape)[0] for shape in shapes)
    if count <= context.limits.shape_parts:
        return shapes
    what = f"the obstacles of the graph `{graph.name.text}` have {shown(count)} convex pieces"
    too_many_parts(context, what, graph.span)
    return ()
