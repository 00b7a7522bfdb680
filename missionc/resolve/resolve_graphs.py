"""Resolution of graphs: the agents and beacons in each, and the ranges of its links.

says MC014 MC104 MC206 MC207 MC210 MC240 MC241
"""

from __future__ import annotations

from missionc import ir
from missionc.base.units import Dimension, Metres
from missionc.diagnostics import code
from missionc.diagnostics.model import Label
from missionc.ir.pair_ranges import with_ranges
from missionc.resolve.context import Context
from missionc.resolve.formula_findings import not_on_the_graph
from missionc.resolve.resolve_agents import resolve_set
from missionc.resolve.resolve_quantities import excerpt, number, shown
from missionc.resolve.resolve_settings import missing
from missionc.resolve.resolve_shapes import too_many_parts
from missionc.syntax import ast
from missionc.world.convex_pieces import count_pieces


def resolve_graph(context: Context, graph: ast.Graph) -> ir.Graph:
    name = graph.name.text
    radius = Metres(0.0)
    if graph.radius is not None:
        radius = Metres(number(context, graph.radius, Dimension.LENGTH, f"the radius of `{name}`", above=0))
    whole = _of_one_range(context, graph, radius)
    return with_ranges(whole, radius, _ranges(context, graph, whole)) if graph.ranges else whole


def _of_one_range(context: Context, graph: ast.Graph, radius: Metres) -> ir.Graph:
    name = graph.name.text
    agents = context.everyone if graph.over is None else resolve_set(context, graph.over).agents
    if graph.kind == "proximity":
        return ir.Proximity(name, radius, agents, graph.name.span)
    if graph.kind == "sight":
        return ir.Sight(name, radius, _shapes_in_the_way(context, graph), agents, graph.name.span)
    if not context.beacons:
        missing(context, f"a beacon for `{name}`", graph.span, "declare one: `beacon mast = (1, 1)`")
    beacons = tuple(beacon.position for beacon in context.beacons.values())
    return ir.BeaconCover(name, radius, beacons, agents, graph.name.span)


def _ranges(context: Context, graph: ast.Graph, whole: ir.Graph) -> tuple[ir.PairRange, ...]:
    """The ranges of pairs; what is said of a pair before is not said again."""
    said: dict[ast.PairRange, ir.PairRange] = {}
    for pair in graph.ranges:
        senders, receivers = (_ends(context, end, whole) for end in (pair.senders, pair.receivers))
        what = f"the range from `{excerpt(pair.senders.span)}` to `{excerpt(pair.receivers.span)}`"
        radius = Metres(number(context, pair.radius, Dimension.LENGTH, what, above=0))
        if not senders or not receivers:
            continue
        if senders == receivers and len(senders) == 1:
            _to_itself(context, pair, next(iter(senders)))
            continue
        of_both = ((before, _common(known, senders, receivers)) for before, known in said.items())
        again = next(((before, ends) for before, ends in of_both if ends is not None), None)
        if again is None:
            said[pair] = ir.PairRange(senders, receivers, radius)
        else:
            _said_before(context, pair, *again)
    return tuple(said.values())


def _ends(context: Context, end: ast.Name | ast.Member, whole: ir.Graph) -> frozenset[int]:
    agents = frozenset(resolve_set(context, end).agents)
    strangers = sorted(agents.difference(whole.agents))
    if strangers and whole.agents:
        not_on_the_graph(context, end, whole, strangers)
        return frozenset()
    return agents


def _common(known: ir.PairRange, senders: frozenset[int], receivers: frozenset[int]) -> tuple[int, int] | None:
    """Two agents, from and to, of whom both speak."""
    first, second = sorted(known.senders & senders), sorted(known.receivers & receivers)
    return next(((one, other) for one in first[:2] for other in second[:2] if one != other), None)


def _said_before(context: Context, pair: ast.PairRange, before: ast.PairRange, ends: tuple[int, int]) -> None:
    one, other = (context.agents[agent].name for agent in ends)
    context.report(
        code.RANGE_SAID_TWICE,
        f"the range from `{one}` to `{other}` is said twice",
        pair.span,
        labels=(Label(before.span, "here first"),),
        help="leave one of the two out, or name fewer agents in it",
    )


def _to_itself(context: Context, pair: ast.PairRange, agent: int) -> None:
    name = context.agents[agent].name
    context.report(
        code.RANGE_TO_ITSELF,
        f"a range from `{name}` to itself is of no use",
        pair.span,
        notes=("no agent is linked to itself",),
        help="name another agent, or leave the range out",
    )


def _shapes_in_the_way(context: Context, graph: ast.Graph) -> tuple[ir.Shape, ...]:
    """The shapes of the obstacles that stay as they are; of others ``check_graphs`` speaks."""
    shapes = tuple(each.shape for each in context.obstacles.values() if each.constant)
    count = sum(count_pieces(shape)[0] for shape in shapes)
    if count <= context.limits.shape_parts:
        return shapes
    what = f"the obstacles that `{graph.name.text}` looks past come to {shown(count)} convex pieces"
    too_many_parts(context, what, graph.span)
    return ()
