"""Resolution of graphs: the agents and beacons in each, and the range of its links.

says MC014 MC206 MC210
"""

from __future__ import annotations

from missionc import ir
from missionc.base.units import Dimension, Metres
from missionc.resolve.context import Context
from missionc.resolve.resolve_agents import resolve_set
from missionc.resolve.resolve_quantities import number
from missionc.resolve.resolve_settings import missing
from missionc.syntax import ast


def resolve_graph(context: Context, graph: ast.Graph) -> ir.Graph:
    name = graph.name.text
    radius = Metres(number(context, graph.radius, Dimension.LENGTH, f"the radius of `{name}`", above=0))
    agents = context.everyone if graph.over is None else resolve_set(context, graph.over).agents
    if graph.kind != "beacons":
        return ir.Proximity(name, radius, agents, graph.name.span)
    if not context.beacons:
        missing(context, f"a beacon for `{name}`", graph.span, "declare one: `beacon mast = (1, 1)`")
    beacons = tuple(beacon.position for beacon in context.beacons.values())
    return ir.BeaconCover(name, radius, beacons, agents, graph.name.span)
