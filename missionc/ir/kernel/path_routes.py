"""Shortest paths to an agent as routes: some route is short enough, and none is too short."""

from __future__ import annotations

import math

from missionc.ir import Graph
from missionc.ir.kernel.nodes import All, Any, EveryRoute, Is, Node, Not, Route


def as_routes(graph: Graph, agent: int, low: float, high: float, holds: bool) -> Node:
    """Formula that the shortest path to an agent is within the bounds, in metres, or outside them."""
    near = way_to(graph, agent, high, holds)
    if low <= 0:
        return near
    far = way_to(graph, agent, math.nextafter(low, 0.0), not holds)
    return All((near, far)) if holds else Any((near, far))


def way_to(graph: Graph, agent: int, most: float, holds: bool) -> Node:
    """Formula that a path of at most ``most`` metres leads to the agent, or with False that none does."""
    there = Is(frozenset((agent,)))
    return Route(graph, All(()), there, 0.0, most) if holds else EveryRoute(graph, Any(()), Not(there), 0.0, most)
