"""Relaxed formulas: what follows from the requirements and is about nothing but where one agent is, or two.

    in   Kernel
    out  Kernel, weaker, without links and routes

A link between two agents is asked for as a bound on their distance, a route as links one after the other, each agent
by name. What depends on motion, on the steps before or on more than two places at once may hold and may fail.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import lru_cache

from missionc.backends.cover.may_see import SightLink
from missionc.backends.smt.encode.metric_bounds import without_metres
from missionc.ir import (
    Beacon,
    BeaconCover,
    Compare,
    DistanceBetween,
    DistanceTo,
    Flagged,
    Graph,
    Mission,
    Predicate,
    Sight,
    Vector,
)
from missionc.ir.pair_ranges import all_ranges, range_of
from missionc.kernel.nodes import (
    All,
    Any,
    At,
    Atom,
    Is,
    Kernel,
    NeighbourNode,
    Node,
    Not,
    PathLength,
    ReachNode,
    RouteNode,
)
from missionc.kernel.normal_form import YES
from missionc.kernel.walk import bottom_up, rebuilt

MOST_PAIRS = 300
"""Pairs of agents times links of a route, beyond which its links are not looked at one by one."""


def relaxed(mission: Mission, kernel: Kernel) -> Kernel:
    """The requirements, weaker, without links and routes, and of what motion was and is without most."""
    weaker = without_metres(kernel)
    speeds = mission.steps > 0 and not any(agent.dynamics.has_momentum for agent in mission.agents)
    required = replace(weaker, preferences=())
    made = bottom_up(required.formulas, lambda node, parts: _relaxed(node, parts, speeds=speeds))
    return required.with_formulas(made.__getitem__)


def _relaxed(node: Node, parts: tuple[Node, ...], *, speeds: bool) -> Node:
    match node:
        case Atom(predicate) if predicate.restricted is not None and not predicate.reads_past:
            return _connected(predicate.restricted)
        case Atom(predicate) | Not(Atom(predicate)) if not _of_places(predicate, speeds=speeds):
            return YES
        case PathLength() | Not(PathLength()) | RouteNode():
            return YES
        case NeighbourNode(graph):
            return _neighbour(graph, parts[0], node.every)
        case ReachNode(graph, hops=hops):
            through, end = parts
            return _route(graph, through, end, min(hops, max(len(graph.agents) - 1, 0)), node.every)
        case _:
            return rebuilt(node, parts) if parts else node


def _of_places(predicate: Predicate, *, speeds: bool) -> bool:
    """Whether the places of two agents at most decide it; or those where one is, and is next, for its speed."""
    if isinstance(predicate, Flagged):
        return True
    if predicate.reads_past or predicate.reads_heading or predicate.graph is not None:
        return False
    if predicate.reads_speed:
        return speeds and not predicate.others
    return all(len(part.others) + (not part.about_team) <= 2 for part in predicate.parts)


def _neighbour(graph: Graph, body: Node, every: bool) -> Node:
    """The body holds of some agent that may be linked; ``every``: of each that must be."""
    inner, outer = (Any, All) if not every else (All, Any)
    cases: list[Node] = []
    for agent in graph.agents:
        here: Node = Is(frozenset((agent,)))
        beside = [
            outer((_linked(graph, agent, other, not every), At(other, body)))
            for other in graph.agents
            if other != agent
        ]
        cases.append(outer((Not(here) if every else here, inner(tuple(beside)))))
    return inner(tuple(cases))


def _linked(graph: Graph, sender: int, receiver: int, holds: bool) -> Node:
    """That there may be a link from the one, of which it is asked, to the other; that there may be none."""
    match graph:
        case BeaconCover(beacons=beacons):
            of_each, of_all = (All, Any) if holds else (Any, All)
            near = [near_beacon(graph, position, holds) for position in beacons]
            return of_all(tuple(of_each((here, At(receiver, here))) for here in near))
        case Sight() if not holds:
            return YES
        case Sight():
            return seen(graph, sender, receiver)
        case _:
            near_by = nearer(sender, receiver, float(range_of(graph, sender, receiver)))
            return near_by if holds else Not(near_by)


@lru_cache(maxsize=256)
def near_beacon(graph: BeaconCover, position: Vector, holds: bool) -> Node:
    near = Atom(Compare(((-1.0, DistanceTo(Beacon(graph.name, position, graph.span))),), float(graph.radius), True))
    return near if holds else Not(near)


@lru_cache(maxsize=4096)
def seen(graph: Sight, sender: int, receiver: int) -> Atom:
    first, second = sorted((sender, receiver))
    reach = float(range_of(graph, sender, receiver))
    return Atom(SightLink(((-1.0, DistanceBetween(first, second)),), reach, True, graph))


@lru_cache(maxsize=4096)
def nearer(one: int, other: int, metres: float) -> Atom:
    first, second = sorted((one, other))
    return Atom(Compare(((-1.0, DistanceBetween(first, second)),), metres, True))


def _route(graph: Graph, through: Node, end: Node, hops: int, every: bool) -> Node:
    """Some route of so many links that there may be leads there, or each that must be.

    Source: [strel] Definition 5, unrolled.
    """
    if hops * len(graph.agents) ** 2 > MOST_PAIRS:
        return end if every else _within(graph, end, hops)
    both, either = (All, Any) if not every else (Any, All)
    made = end
    for _ in range(hops):
        made = either((end, both((through, _neighbour(graph, made, every)))))
    return made if every or hops < 2 else All((made, _within(graph, end, hops)))


def _within(graph: Graph, end: Node, hops: int) -> Node:
    """The end holds of some agent, which is no further away than so many of the longest links."""
    if isinstance(graph, BeaconCover):
        return YES
    reach = hops * float(max(all_ranges(graph), default=0.0))
    cases = []
    for agent in graph.agents:
        near = [nearer(agent, other, reach) if other != agent else YES for other in graph.agents]
        ends = tuple(All((At(other, end), there)) for other, there in zip(graph.agents, near, strict=True))
        cases.append(All((Is(frozenset((agent,))), Any(ends))))
    outside = Not(Is(frozenset(graph.agents)))
    return Any((*cases, All((outside, end))))


def _connected(graph: Graph) -> Node:
    """A route to everybody from the first."""
    first, *others = graph.agents
    return All(tuple(At(first, route) for route in _to_each(graph, others)))


def _to_each(graph: Graph, others: list[int]) -> Iterator[Node]:
    for other in others:
        yield _route(graph, YES, Is(frozenset((other,))), len(graph.agents) - 1, False)
