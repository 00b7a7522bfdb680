"""Link margins of a communication graph: positive if two agents are linked."""

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
"""Mission index of one agent, or an array of indices."""

ELEMENTS = 1 << 22
"""Maximum number of link margins in memory at once; longer traces are evaluated in pieces."""


def ranges(graph: Graph, first: Agents, second: Agents) -> float | trace.Array:
    """Communication ranges of the links from agents ``first`` to agents ``second`` (mission indices), metres.

    The indices broadcast; the result is one number if all pairs have the same range. The range of an agent to itself
    has no meaning.
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
    """Margins of the links from the agents ``first`` to the agents ``second``: (..., dim) twice, metres -> (...),
    metres.

    Args:
        first: mission indices that broadcast against (...); likewise ``second``.
    """
    reach: Array = ranges(graph, first, second)
    if xp is not np and graph.ranges:
        reach = first_position.new_tensor(reach)
    return link.link_margin_of(xp, graph, reach, first_position, second_position)


def are_linked(
    graph: Graph, first: Agents, second: Agents, first_position: trace.Array, second_position: trace.Array
) -> trace.Flags:
    """Return true for each linked pair of agents ``first`` and ``second``; faster than computing margins.

    Shape: (..., dim) twice, metres -> (...), boolean.
    """
    reach = ranges(graph, first, second)
    return np.asarray(link.link_margin_of(np, graph, reach, first_position, second_position, floor=0.0) > 0)


def places_linked(graph: Graph, first_position: trace.Array, second_position: trace.Array) -> trace.Flags:
    """Return true for each pair of positions that a link would connect, in a graph with one range for all agents.

    Shape: (..., dim) twice, metres -> (...), boolean.
    """
    assert not graph.ranges, "whether two places are linked hangs on who is there"
    return np.asarray(link.link_margin_of(np, graph, graph.radius, first_position, second_position, floor=0.0) > 0)


def all_links(graph: Graph, position: trace.Array) -> trace.Array:
    """Link margins between all agents of a graph, at each step.

    Args:
        position: positions of all agents of the mission, (agents, steps, dim), metres.

    Returns:
        (steps, members, members), metres: from the graph's agent in the second axis to the one in the third; ``-inf``
            on the diagonal, since no agent is linked to itself.
    """
    agents = np.array(graph.agents, dtype=np.int64)
    members = position[agents].swapaxes(0, 1)
    links: trace.Array = link_margin(graph, agents[:, None], agents, members[:, :, None, :], members[:, None, :, :])
    diagonal = np.arange(len(graph.agents))
    links[:, diagonal, diagonal] = -np.inf
    return links


def link_pieces(steps: int, members: int) -> Iterator[slice]:
    """Slices of the steps 0 … ``steps - 1`` whose link margins fit into memory at once."""
    size = max(1, ELEMENTS // max(1, members * members))
    return (slice(start, min(start + size, steps)) for start in range(0, steps, size))
