"""Cost graph: the kernel with routes unrolled into links, in the form that the optimiser evaluates.

    in   Kernel
    out  Kernel, without ``Reach``, ``EveryReach`` and ``PathLength``; every part of a conjunction, a disjunction or a
         count matters to its truth

Every formula has a value for each candidate, agent and step: its space robustness, positive if it is satisfied. The
constructor determines which children must be satisfied, since negations are at the leaves.

Source:
    [clot] IV-A.1, the tree of a formula; here a graph, since shared formulas are one node.
"""

from __future__ import annotations

from typing import TypeAlias

from missionc.ir import Connected, Graph, Predicate
from missionc.ir.couplings import directed
from missionc.ir.kernel.nodes import (
    All,
    Any,
    At,
    AtLeast,
    Atom,
    EveryNeighbour,
    EveryReach,
    Is,
    Kernel,
    Neighbour,
    Node,
    Not,
    PathLength,
    Reach,
    ReachNode,
)
from missionc.ir.kernel.normal_form import at_least
from missionc.ir.kernel.walk import as_routes, bottom_up, rebuilt

Unrolled: TypeAlias = ReachNode | PathLength
"""Constructors that a cost graph replaces by links, or by routes bounded in metres."""

SignedPredicate: TypeAlias = tuple[Predicate, bool]
"""Predicate, and whether it must be true or false."""


def build(formulas: Kernel) -> Kernel:
    """Cost graph of a mission's requirements and preferences."""
    made = formulas.with_formulas(bottom_up(formulas.formulas, _rewritten).__getitem__)
    return Kernel(made.requirements, made.preferences)


def signed_predicate(leaf: Node) -> SignedPredicate:
    """Predicate of an ``Atom`` (must be true) or of its negation (must be false)."""
    match leaf:
        case Atom(predicate) | Not(Atom(predicate)):
            return predicate, isinstance(leaf, Atom)
        case _:
            raise AssertionError("without a predicate")


def _rewritten(node: Node, parts: tuple[Node, ...]) -> Node:
    """Cost graph form of a formula over rewritten children."""
    match node:
        case All() | Any() if (connected := _connected(node)) is not None:
            atom = Atom(connected, node.span)
            return atom if node.every else Not(atom, node.span)
        case All() | Any() if len(parts) == 1:
            return parts[0]
        case AtLeast(count):
            return at_least(count, parts)
        case Reach(graph, _, _, hops) | EveryReach(graph, _, _, hops):
            most = min(hops, max(len(graph.agents) - 1, 0))
            return _unrolled(graph, parts[0], parts[1], most, isinstance(node, Reach))
        case PathLength(graph, agent, low_m, high_m):
            return as_routes(graph, agent, low_m, high_m, True)
        case Not(PathLength(graph, agent, low_m, high_m)):
            return as_routes(graph, agent, low_m, high_m, False)
        case _:
            return rebuilt(node, parts)


def _connected(node: All | Any) -> Connected | None:
    """Connectivity predicate equivalent to a conjunction of routes from every member of a graph to a common member;
    None for other formulas.

    For directed links, the common member must also reach every other. As one leaf, the predicate gives a spanning tree
    to optimise, and its value takes one pass instead of one per link of a route. A disjunction of the duals of such
    routes is its negation.
    """
    pairs: set[tuple[int, int]] = set()
    graph: Graph | None = None
    for part in node.parts:
        match part:
            case At(start, Reach(links, All(()), Is(agents), hops)) | At(
                start, EveryReach(links, Any(()), Not(Is(agents)), hops)
            ) if (
                len(agents) == 1
                and hops >= len(links.agents) - 1
                and graph in (None, links)
                and isinstance(part.body, Reach) is node.every
            ):
                graph = links
                pairs |= {(start, end) for end in agents}
            case _:
                return None
    if graph is None:
        return None
    return Connected(graph, graph.agents) if _amounts_to_connected(graph, pairs) else None


def _amounts_to_connected(graph: Graph, pairs: set[tuple[int, int]]) -> bool:
    """Return true if routes between exactly these pairs connect every member of the graph with every other."""
    for one in {end for _, end in pairs}:
        others = set(graph.agents) - {one}
        there, back = {(each, one) for each in others}, {(one, each) for each in others}
        if pairs - {(one, one)} == (there | back if directed(graph) else there):
            return True
    return False


def _unrolled(graph: Graph, through: Node, end: Node, hops: int, holds: bool) -> Node:
    """Formula of a route of at most ``hops`` links (or if not ``holds``, its dual), one link at a time.

    Agents may repeat, which is equivalent without a lower bound.
    """
    reached = end
    for _ in range(hops):
        further: Node = Neighbour(graph, reached) if holds else EveryNeighbour(graph, reached)
        reached = Any((end, All((through, further)))) if holds else All((end, Any((through, further))))
    return reached
