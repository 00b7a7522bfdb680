"""Links of a graph by kinds of agents: places know how far apart they are, and the range hangs on who stands there."""

from __future__ import annotations

from functools import lru_cache

from missionc.backends.smt.encode.occupancy import Agents
from missionc.ir import Graph
from missionc.ir.pair_ranges import between, kinds, range_of

KEPT = 256
"""Graphs, and kinds of them, whose links are remembered."""


@lru_cache(maxsize=KEPT)
def kinds_of(graph: Graph) -> tuple[Agents, ...]:
    """The agents of a graph in parts, those of a part with links of the same ranges."""
    return tuple(map(frozenset, kinds(graph)))


def kind_of(graph: Graph, agent: int) -> Agents:
    """The part that an agent of the graph is in."""
    return next(kind for kind in kinds_of(graph) if agent in kind)


@lru_cache(maxsize=KEPT)
def links_from(graph: Graph, senders: Agents) -> tuple[tuple[Graph, Agents], ...]:
    """Where links of a kind's agents may lead: each kind of agents there, after a graph whose links have that range.

    None to a kind that is out of every range, or that an agent would have to itself.
    """
    onward = []
    for receivers in kinds_of(graph):
        one, other = min(senders), max(receivers)
        if one != other and range_of(graph, one, other) > 0:
            onward.append((between(graph, one, other), receivers))
    return tuple(onward)
