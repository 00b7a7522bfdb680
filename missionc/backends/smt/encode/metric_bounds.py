"""Conversion of bounds in metres to forms that a roadmap can encode.

    in   Kernel
    out  stronger Kernel, whose routes in metres have upper bounds only; or weaker Kernel, without metres

Conditions on states use walks; with an upper bound on the length, walks and routes reach the same states. A walk may
turn back, so a lower bound has no effect on it. For lower bounds, the formula uses the shortest path to the agent at
the end.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import replace

from missionc.base.units import Metres
from missionc.ir import Graph, Proximity
from missionc.ir.couplings import with_ranges
from missionc.ir.kernel.analysis import reads_lengths
from missionc.ir.kernel.nodes import (
    All,
    Any,
    EveryReach,
    EveryRoute,
    Goal,
    Is,
    Kernel,
    Neighbour,
    Node,
    Not,
    PathLength,
    Reach,
    Route,
    RouteNode,
)
from missionc.ir.kernel.walk import as_routes, bottom_up, children, postorder, rebuilt, same_objects, way_to

Rewrite = Callable[[Node, tuple[Node, ...]], Node]
"""Function from a node and its rewritten children to the rewritten node."""


def measured_goals(goals: Iterable[Goal]) -> frozenset[str]:
    """Names of the goals about lengths in metres."""
    return frozenset(goal.name for goal in goals if any(map(reads_lengths, postorder((goal.formula,)))))


def bounded_above(kernel: Kernel) -> Kernel:
    """Stronger kernel in which the only lengths in metres are upper bounds of routes."""
    return _rewritten(kernel, _stronger)


def without_metres(kernel: Kernel) -> Kernel:
    """Weaker kernel without lengths in metres."""
    return _rewritten(kernel, _weaker)


def _rewritten(kernel: Kernel, rewrite: Rewrite) -> Kernel:
    def over(node: Node, parts: tuple[Node, ...]) -> Node:
        same = same_objects(parts, children(node)) and not reads_lengths(node)
        return node if same else rewrite(node, parts)

    return kernel.with_formulas(bottom_up(kernel.formulas, over).__getitem__)


def _stronger(node: Node, parts: tuple[Node, ...]) -> Node:
    match node:
        case PathLength() | Not(PathLength()):
            return _unbounded_as_hops(_path_routes(node))
        case RouteNode(graph, low=low) if low > 0:
            return _unbounded_as_hops(_nearest(node, graph, *parts))
        case RouteNode():
            return _unbounded_as_hops(rebuilt(node, parts))
        case _:
            return rebuilt(node, parts)


def _path_routes(node: Node) -> Node:
    leaf = node.body if isinstance(node, Not) else node
    assert isinstance(leaf, PathLength)
    return as_routes(leaf.graph, leaf.agent, leaf.low, leaf.high, leaf is node)


def _nearest(node: RouteNode, graph: Graph, through: Node, end: Node) -> Node:
    """Stronger form of a route with a lower bound.

    For *some* route: a route to an agent whose shortest path is at least the lower bound. For *every* route: also the
    shorter routes, except to the agent itself.
    """

    def named(agent: int) -> tuple[Node, Node]:
        here = Is(frozenset((agent,)))
        return here, Not(here)

    if node.every:
        cases = []
        for agent in graph.agents:
            here, other = named(agent)
            each = EveryRoute(graph, through, Any((end, here)), 0.0, node.high, node.span)
            cases.append(Any((other, each), node.span))
        return All(tuple(cases), node.span)
    ways = []
    for agent in graph.agents:
        here, other = named(agent)
        route = Route(graph, through, All((end, here)), 0.0, node.high, node.span)
        ways.append(All((other, route, way_to(graph, agent, math.nextafter(node.low, 0.0), False)), node.span))
    return Any(tuple(ways), node.span)


def _unbounded_as_hops(root: Node) -> Node:
    """Formula with routes of unbounded length replaced by routes with an unbounded number of links."""

    def over(node: Node, parts: tuple[Node, ...]) -> Node:
        if isinstance(node, RouteNode) and math.isinf(node.high):
            return _of_hops(node, node.graph, *parts)
        return rebuilt(node, parts) if parts else node

    return bottom_up((root,), over)[root]


def _of_hops(node: RouteNode, graph: Graph, through: Node, end: Node) -> Node:
    kind = EveryReach if node.every else Reach
    return kind(graph, through, end, max(len(graph.agents) - 1, 0), node.span)


def _weaker(node: Node, parts: tuple[Node, ...]) -> Node:
    match node:
        case PathLength(graph, agent, _, high):
            return _some_way(Route(graph, All(()), Is(frozenset((agent,))), 0.0, high))
        case Not(PathLength()):
            return All(())
        case RouteNode(low=low) if node.every:
            return parts[1] if low <= 0 else All(())
        case Route(graph, _, _, low, high) if low > 0:
            through, end = parts
            ways = []
            for agent in graph.agents:
                here = Is(frozenset((agent,)))
                ways.append(All((here, _some_way(Route(graph, through, All((end, Not(here))), 0.0, high, node.span)))))
            return Any(tuple(ways), node.span)
        case Route(graph, _, _, _, high):
            through, end = parts
            return _some_way(Route(graph, through, end, 0.0, high, node.span))
        case _:
            return rebuilt(node, parts)


def _some_way(node: Route) -> Node:
    """Weaker form of a route without metres: links no longer than the bound, and an end agent within the bound."""
    graph, through, end, metres = node.graph, node.through, node.end, node.high
    just = Metres(math.nextafter(metres, math.inf))
    near = Proximity("near", just, graph.agents, graph.span)
    shorter = tuple(replace(each, radius=min(each.radius, just)) for each in graph.ranges)
    capped = with_ranges(graph, min(graph.radius, just), shorter)
    links = capped if isinstance(graph, Proximity) and capped.rule != graph.rule else graph
    route = _of_hops(node, links, through, end)
    if math.isinf(metres):
        return route
    return All((Any((end, Neighbour(near, end, node.span)), node.span), route), node.span)
