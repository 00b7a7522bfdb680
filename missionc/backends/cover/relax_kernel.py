"""Relaxed formulas: consequences of the requirements about the positions of one or two agents.

    in   Kernel
    out  a weaker Kernel without links and routes

A link between two agents becomes a bound on their distance, and a route becomes a sequence of links between named
agents. Conditions on motion, earlier steps or more than two positions are dropped.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import lru_cache

from missionc import ir
from missionc.backends.cover.may_labels import SightLink
from missionc.backends.smt.encode.metric_bounds import without_metres
from missionc.ir.kernel import nodes as k
from missionc.ir.kernel.normal_form import YES
from missionc.ir.kernel.walk import bottom_up, rebuilt
from missionc.ir.pair_ranges import all_ranges, range_of

MOST_PAIRS = 300
"""Maximum number of pairs of agents times links for which a route is expanded."""


def relaxed(mission: ir.Mission, kernel: k.Kernel) -> k.Kernel:
    """Kernel with weaker requirements, without links and routes, and mostly without conditions on motion and the
    past."""
    weaker = without_metres(kernel)
    speeds = mission.steps > 0 and not any(agent.dynamics.has_momentum for agent in mission.agents)
    required = replace(weaker, preferences=())
    made = bottom_up(required.formulas, lambda node, parts: _relaxed(node, parts, speeds=speeds))
    return required.with_formulas(made.__getitem__)


def _relaxed(node: k.Node, parts: tuple[k.Node, ...], *, speeds: bool) -> k.Node:
    match node:
        case k.Atom(predicate) if predicate.restricted is not None and not predicate.reads_past:
            return _connected(predicate.restricted)
        case k.Atom(predicate) | k.Not(k.Atom(predicate)) if not _of_places(predicate, speeds=speeds):
            return YES
        case k.PathLength() | k.Not(k.PathLength()) | k.RouteNode():
            return YES
        case k.NeighbourNode(graph):
            return _neighbour(graph, parts[0], node.every)
        case k.ReachNode(graph, hops=hops):
            through, end = parts
            return _route(graph, through, end, min(hops, max(len(graph.agents) - 1, 0)), node.every)
        case _:
            return rebuilt(node, parts) if parts else node


def _of_places(predicate: ir.Predicate, *, speeds: bool) -> bool:
    """Return true if positions decide the predicate: of at most two agents, or for a speed, of one agent at two
    steps."""
    if isinstance(predicate, ir.Flagged):
        return True
    if predicate.reads_past or predicate.reads_heading or predicate.graph is not None:
        return False
    if predicate.reads_speed:
        return speeds and not predicate.others
    return all(len(part.others) + (not part.about_team) <= 2 for part in predicate.parts)


def _neighbour(graph: ir.Graph, body: k.Node, every: bool) -> k.Node:
    """Relaxed ``Neighbour``: the body at some agent that may be linked; if ``every``, at each agent that must be
    linked."""
    inner, outer = (k.Any, k.All) if not every else (k.All, k.Any)
    cases: list[k.Node] = []
    for agent in graph.agents:
        here: k.Node = k.Is(frozenset((agent,)))
        beside = [
            outer((_linked(graph, agent, other, not every), k.At(other, body)))
            for other in graph.agents
            if other != agent
        ]
        cases.append(outer((k.Not(here) if every else here, inner(tuple(beside)))))
    return inner(tuple(cases))


def _linked(graph: ir.Graph, sender: int, receiver: int, holds: bool) -> k.Node:
    """Formula that a link from ``sender``, for which it is evaluated, to ``receiver`` may exist (``holds``) or may be
    absent."""
    match graph:
        case ir.BeaconCover(beacons=beacons):
            of_each, of_all = (k.All, k.Any) if holds else (k.Any, k.All)
            near = [near_beacon(graph, position, holds) for position in beacons]
            return of_all(tuple(of_each((here, k.At(receiver, here))) for here in near))
        case ir.Sight() if not holds:
            return YES
        case ir.Sight():
            return seen(graph, sender, receiver)
        case _:
            near_by = nearer(sender, receiver, float(range_of(graph, sender, receiver)))
            return near_by if holds else k.Not(near_by)


@lru_cache(maxsize=256)
def near_beacon(graph: ir.BeaconCover, position: ir.Vector, holds: bool) -> k.Node:
    near = k.Atom(
        ir.Compare(((-1.0, ir.DistanceTo(ir.Beacon(graph.name, position, graph.span))),), float(graph.radius), True)
    )
    return near if holds else k.Not(near)


@lru_cache(maxsize=4096)
def seen(graph: ir.Sight, sender: int, receiver: int) -> k.Atom:
    first, second = sorted((sender, receiver))
    reach = float(range_of(graph, sender, receiver))
    return k.Atom(SightLink(((-1.0, ir.DistanceBetween(first, second)),), reach, True, graph))


@lru_cache(maxsize=4096)
def nearer(one: int, other: int, metres: float) -> k.Atom:
    first, second = sorted((one, other))
    return k.Atom(ir.Compare(((-1.0, ir.DistanceBetween(first, second)),), metres, True))


def _route(graph: ir.Graph, through: k.Node, end: k.Node, hops: int, every: bool) -> k.Node:
    """Relaxed ``Reach``: some possible route of at most ``hops`` links; if ``every``, each certain route.

    Source:
        [strel] Definition 5, unrolled.
    """
    if hops * len(graph.agents) ** 2 > MOST_PAIRS:
        return end if every else _within(graph, end, hops)
    both, either = (k.All, k.Any) if not every else (k.Any, k.All)
    made = end
    for _ in range(hops):
        made = either((end, both((through, _neighbour(graph, made, every)))))
    return made if every or hops < 2 else k.All((made, _within(graph, end, hops)))


def _within(graph: ir.Graph, end: k.Node, hops: int) -> k.Node:
    """Formula that some agent within ``hops`` times the longest link range satisfies ``end``."""
    if isinstance(graph, ir.BeaconCover):
        return YES
    reach = hops * float(max(all_ranges(graph), default=0.0))
    cases = []
    for agent in graph.agents:
        near = [nearer(agent, other, reach) if other != agent else YES for other in graph.agents]
        ends = tuple(k.All((k.At(other, end), there)) for other, there in zip(graph.agents, near, strict=True))
        cases.append(k.All((k.Is(frozenset((agent,))), k.Any(ends))))
    outside = k.Not(k.Is(frozenset(graph.agents)))
    return k.Any((*cases, k.All((outside, end))))


def _connected(graph: ir.Graph) -> k.Node:
    """Formula that there are routes from the first agent to all others."""
    first, *others = graph.agents
    return k.All(tuple(k.At(first, route) for route in _to_each(graph, others)))


def _to_each(graph: ir.Graph, others: list[int]) -> Iterator[k.Node]:
    for other in others:
        yield _route(graph, YES, k.Is(frozenset((other,))), len(graph.agents) - 1, False)
