"""Links of a graph by kinds of agents, since the range depends on the two agents."""

from __future__ import annotations

from functools import lru_cache

from missionc.backends.smt.encode.occupancy import Agents
from missionc.ir import Graph
from missionc.ir.pair_ranges import between, kinds, range_of

KEPT = 256
"""Maximum number of cached graphs and kinds."""


@lru_cache(maxsize=KEPT)
def kinds_of(graph: Graph) -> tuple[Agents, ...]:
    """Partition of the graph's agents into kinds with equal link ranges."""
    return tuple(map(frozenset, kinds(graph)))


def kind_of(graph: Graph, agent: int) -> Agents:
    """Kind that contains an agent of the graph."""
    return next(kind for kind in kinds_of(graph) if agent in kind)


@lru_cache(maxsize=KEPT)
def links_from(graph: Graph, senders: Agents) -> tuple[tuple[Graph, Agents], ...]:
    """Possible receivers of links from agents of a kind: each kind of agents, with a graph that has the range of the
    pair.

    Kinds out of range, and links of an agent to itself, are omitted.
    """
    onward = []
    for receivers in kinds_of(graph):
        one, other = min(senders), max(receivers)
        if one != other and range_of(graph, one, other) > 0:
            onward.append((between(graph, one, other), receivers))
    return tuple(onward)
