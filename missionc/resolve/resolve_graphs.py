"""Resolution of graphs: the agents and beacons in each, and the range of its links.

says MC014 MC206 MC207 MC210
"""

from __future__ import annotations

from missionc import ir
from missionc.base.units import Dimension, Metres
from missionc.resolve.context import Context
from missionc.resolve.resolve_agents import resolve_set
from missionc.resolve.resolve_quantities import number, shown
from missionc.resolve.resolve_settings import missing
from missionc.resolve.resolve_shapes import too_many_parts
from missionc.syntax import ast
from missionc.world.convex_pieces import count_pieces


def resolve_graph(context: Context, graph: ast.Graph) -> ir.Graph:
    name = graph.name.text
    radius = Metres(number(context, graph.radius, Dimension.LENGTH, f"the radius of `{name}`", above=0))
    agents = context.everyone if graph.over is None else resolve_set(context, graph.over).agents
    if graph.kind == "proximity":
        return ir.Proximity(name, radius, agents, graph.name.span)
    if graph.kind == "sight":
        return ir.Sight(name, radius, _shapes_in_the_way(context, graph), agents, graph.name.span)
    if not context.beacons:
        missing(context, f"a beacon for `{name}`", graph.span, "declare one: `beacon mast = (1, 1)`")
    beacons = tuple(beacon.position for beacon in context.beacons.values())
    return ir.BeaconCover(name, radius, beacons, agents, graph.name.span)


def _shapes_in_the_way(context: Context, graph: ast.Graph) -> tuple[ir.Shape, ...]:
    """The shapes of the obstacles that stay as they are; of others ``check_graphs`` speaks."""
    shapes = tuple(each.shape for each in context.obstacles.values() if each.constant)
    count = sum(count_pieces(shape)[0] for shape in shapes)
    if count <= context.limits.shape_parts:
        return shapes
    what = f"the obstacles that `{graph.name.text}` looks past come to {shown(count)} convex pieces"
    too_many_parts(context, what, graph.span)
    return ()
