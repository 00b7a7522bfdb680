"""Margins of the edges of a communication graph: positive where two agents are linked."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from missionc.base import trace
from missionc.ir import Graph
from missionc.language.margins import link
from missionc.world.signed_distance import Array, Namespace

ELEMENTS = 1 << 22
"""How many links are held at once; longer traces are judged in pieces."""


def link_margin(graph: Graph, first_position: Array, second_position: Array, *, xp: Namespace = np) -> Array:
    """The margin of the link of two agents: (..., dim) twice -> (...), metres."""
    return link.margin(xp, graph, first_position, second_position)


def are_linked(graph: Graph, first_position: trace.Array, second_position: trace.Array) -> trace.Flags:
    """Whether two agents are linked: (..., dim) twice -> (...); sooner than their margin is found."""
    return np.asarray(link.margin(np, graph, first_position, second_position, floor=0.0) > 0)


def all_links(graph: Graph, position: trace.Array) -> trace.Array:
    """The link margins of all pairs.

    Args:
        position: of all the mission's agents, (agents, steps, dim), metres.

    Returns:
        (steps, members, members), metres, the graph's agents in their order;
        ``-inf`` on the diagonal, for no agent is linked to itself.
    """
    members = position[list(graph.agents)].swapaxes(0, 1)
    links: trace.Array = link_margin(graph, members[:, :, None, :], members[:, None, :, :])
    diagonal = np.arange(len(graph.agents))
    links[:, diagonal, diagonal] = -np.inf
    return links


def pieces(steps: int, members: int) -> Iterator[slice]:
    """The steps 0 … ``steps - 1`` in pieces short enough to hold all links of so many agents at once."""
    size = max(1, ELEMENTS // max(1, members * members))
    return (slice(start, min(start + size, steps)) for start in range(0, steps, size))
