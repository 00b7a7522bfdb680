"""Margins of the edges of a communication graph: positive if two agents are linked."""

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
"""Maximum number of links in memory at once; longer traces are judged in pieces."""


def ranges(graph: Graph, first: Agents, second: Agents) -> float | trace.Array:
    """Ranges of the links from some agents to others, by index: metres, broadcast, or one number for all.

    The range of an agent to itself has no meaning.
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
    """Margin of the links from the first agents to the second: (..., dim) twice -> (...), metres.

    Args:
        first: indices of the agents, which broadcast against (...); likewise ``second``.
    """
    reach: Array = ranges(graph, first, second)
    if xp is not np and graph.ranges:
        reach = first_position.new_tensor(reach)
    return link.link_margin_of(xp, graph, reach, first_position, second_position)


def are_linked(
    graph: Graph, first: Agents, second: Agents, first_position: trace.Array, second_position: trace.Array
) -> trace.Flags:
    """Flags of links from the first agents to the second, faster than the margin.

    Shape: (..., dim) twice, metres -> (...), boolean.
    """
    reach = ranges(graph, first, second)
    return np.asarray(link.link_margin_of(np, graph, reach, first_position, second_position, floor=0.0) > 0)


def places_linked(graph: Graph, first_position: trace.Array, second_position: trace.Array) -> trace.Flags:
    """Flags of links between places of a graph with one range for all.

    Shape: (..., dim) twice, metres -> (...), boolean.
    """
    assert not graph.ranges, "whether two places are linked hangs on who is there"
    return np.asarray(link.link_margin_of(np, graph, graph.radius, first_position, second_position, floor=0.0) > 0)


def all_links(graph: Graph, position: trace.Array) -> trace.Array:
    """Link margins of all pairs.

    Args:
        position: all agents of the mission, (agents, steps, dim), metres.

    Returns:
        (steps, members, members), metres, from each of the graph's agents to each, in their
        order; ``-inf`` on the diagonal, since no agent is linked to itself.
    """
    agents = np.array(graph.agents, dtype=np.int64)
    members = position[agents].swapaxes(0, 1)
    links: trace.Array = link_margin(graph, agents[:, None], agents, members[:, :, None, :], members[:, None, :, :])
    diagonal = np.arange(len(graph.agents))
    links[:, diagonal, diagonal] = -np.inf
    return links


def link_pieces(steps: int, members: int) -> Iterator[slice]:
    """Split the steps 0 … ``steps - 1`` into pieces whose links fit in memory at once."""
    size = max(1, ELEMENTS // max(1, members * members))
    return (slice(start, min(start + size, steps)) for start in range(0, steps, size))
