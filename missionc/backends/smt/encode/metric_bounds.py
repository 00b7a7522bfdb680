"""Bounds in metres in the forms that a roadmap can be asked for.

    in   Kernel
    out  Kernel, stronger, whose routes in metres are bounded from above alone; or weaker, without metres

What is asked of places looks at walks, and one of at most so many metres leads wherever a route of so many does. It
may turn back, so that a lower bound is no bound on it: there the shortest way to the agent at the end is asked for.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import replace

from missionc.base.units import Metres
from missionc.ir import Graph, Proximity
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
from missionc.ir.kernel.path_routes import as_routes, way_to
from missionc.ir.kernel.walk import bottom_up, children, postorder, rebuilt, same_objects
from missionc.ir.pair_ranges import with_ranges

Rewrite = Callable[[Node, tuple[Node, ...]], Node]
"""A formula over the rewritten ones below it."""


def measured_goals(goals: Iterable[Goal]) -> frozenset[str]:
    """The names of those that are about lengths in metres."""
    return frozenset(goal.name for goal in goals if any(map(reads_lengths, postorder((goal.formula,)))))


def bounded_above(kernel: Kernel) -> Kernel:
    """A kernel that implies the one given, and asks for no lengths but of routes with a lower bound of 0."""
    return _rewritten(kernel, _stronger)


def without_metres(kernel: Kernel) -> Kernel:
    """A kernel that follows from the one given, and asks for no length in metres."""
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
    """Bounded below, in stronger form.

    Some route: one to an agent whose shortest way is no shorter than the lower bound. Every route: those shorter
    than that as well, but for the agent itself.
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
    """Routes of any length, as routes of any number of links."""

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
    """A route of so many metres has links to its end, none longer than itself, and that end is no farther away."""
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
