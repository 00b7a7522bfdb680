"""Margins of the edges of a communication graph: positive where two agents are linked."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from missionc.base import trace
from missionc.ir import Graph
from missionc.ir.distances.signed_distance import Array, Namespace
from missionc.ir.language.margins import link

Agents: TypeAlias = int | NDArray[np.int64]
"""The numbers of agents."""

ELEMENTS = 1 << 22
"""How many links are held at once; longer traces are judged in pieces."""


def ranges(graph: Graph, first: Agents, second: Agents) -> float | trace.Array:
    """The ranges of the links from some agents to others, by their numbers: metres, as they broadcast, or one for all.

    What is said of an agent and itself is of no use.
    """
    if not graph.ranges:
        return float(graph.radius)
    first, second = np.asarray(first), np.asarray(second)
    reach = np.full(np.broadcast_shapes(first.shape, second.shape), float(graph.radius))
    for each in graph.ranges:
        reach[np.isin(first, tuple(each.senders)) & np.isin(second, tuple(each.receivers))] = each.radius
    return reach


def link_margin(
    graph: Graph, first: Agents, second: Agents, first_position: Array, second_position: Array, *, xp: Namespace = np
) -> Array:
    """The margin of the links from the first agents to the second: (..., dim) twice -> (...), metres.

    Args:
        first: the numbers of the agents, which broadcast against (...); likewise ``second``.
    """
    reach: Array = ranges(graph, first, second)
    if xp is not np and graph.ranges:
        reach = first_position.new_tensor(reach)
    return link.link_margin_of(xp, graph, reach, first_position, second_position)


def are_linked(
    graph: Graph, first: Agents, second: Agents, first_position: trace.Array, second_position: trace.Array
) -> trace.Flags:
    """Whether links lead from the first agents to the second: (..., dim) twice -> (...); sooner than by the margin."""
    reach = ranges(graph, first, second)
    return np.asarray(link.link_margin_of(np, graph, reach, first_position, second_position, floor=0.0) > 0)


def places_linked(graph: Graph, first_position: trace.Array, second_position: trace.Array) -> trace.Flags:
    """Whether whoever is at two places is linked, of a graph whose links have one range: (..., dim) twice -> (...)."""
    assert not graph.ranges, "whether two places are linked hangs on who is there"
    return np.asarray(link.link_margin_of(np, graph, graph.radius, first_position, second_position, floor=0.0) > 0)


def all_links(graph: Graph, position: trace.Array) -> trace.Array:
    """The link margins of all pairs.

    Args:
        position: of all the mission's agents, (agents, steps, dim), metres.

    Returns:
        (steps, members, members), metres, from each of the graph's agents, in
        their order, to each; ``-inf`` on the diagonal, for no agent is linked
        to itself.
    """
    agents = np.array(graph.agents, dtype=np.int64)
    members = position[agents].swapaxes(0, 1)
    links: trace.Array = link_margin(graph, agents[:, None], agents, members[:, :, None, :], members[:, None, :, :])
    diagonal = np.arange(len(graph.agents))
    links[:, diagonal, diagonal] = -np.inf
    return links


def link_pieces(steps: int, members: int) -> Iterator[slice]:
    """The steps 0 … ``steps - 1`` in pieces short enough to hold all links of so many agents at once."""
    size = max(1, ELEMENTS // max(1, members * members))
    return (slice(start, min(start + size, steps)) for start in range(0, steps, size))
