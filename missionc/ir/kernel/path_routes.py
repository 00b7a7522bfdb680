"""Bounds on shortest paths expressed by routes: some route is short enough, and none is too short."""

from __future__ import annotations

import math

from missionc.ir import Graph
from missionc.ir.kernel.nodes import All, Any, EveryRoute, Is, Node, Not, Route


def as_routes(graph: Graph, agent: int, low: float, high: float, holds: bool) -> Node:
    """Formula that the shortest path to an agent has a length of ``low`` to ``high`` metres, or if not ``holds``, any
    other length."""
    near = way_to(graph, agent, high, holds)
    if low <= 0:
        return near
    far = way_to(graph, agent, math.nextafter(low, 0.0), not holds)
    return All((near, far)) if holds else Any((near, far))


def way_to(graph: Graph, agent: int, most: float, holds: bool) -> Node:
    """Formula that some path of at most ``most`` metres leads to the agent, or if not ``holds``, that no such path
    exists."""
    there = Is(frozenset((agent,)))
    return Route(graph, All(()), there, 0.0, most) if holds else EveryRoute(graph, Any(()), Not(there), 0.0, most)
