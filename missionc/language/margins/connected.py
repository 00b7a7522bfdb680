"""Margin of ``connected(graph)``: a route from each of the agents to each, over these alone; algebraic connectivity."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from missionc.base.trace import Array, Trace
from missionc.ir import Graph
from missionc.ir.pair_ranges import directed
from missionc.language.margins.links import all_links, pieces
from missionc.language.margins.spanning_trees import spanning_tree


def margin(graph: Graph, trace: Trace) -> Array:
    """The worst link of the best spanning tree: (steps + 1,), metres.

    In a proximity graph that is the radius minus the longest edge of the
    minimum spanning tree. Of links that lead one way, the worst of two trees: of
    ways from the first agent to all others, and of ways back from them.
    ``inf`` for fewer than two agents.
    """
    if directed(graph):
        return _by_pieces(lambda links: np.minimum(_bottleneck(links), _bottleneck(links.mT)), graph, trace)
    return _by_pieces(_bottleneck, graph, trace)


def algebraic_connectivity(graph: Graph, trace: Trace) -> Array:
    """The second smallest eigenvalue of the links' Laplacian, (steps + 1,): positive where the graph is connected.

    Without unit; 0 for fewer than two agents. Of links that lead one way it says nothing.

    Source:
        [clot] III-C, λ₂.
    """
    return _by_pieces(_second_eigenvalue, graph, trace)


def _by_pieces(measure: Callable[[Array], Array], graph: Graph, trace: Trace) -> Array:
    steps = trace.position.shape[1]
    return np.concatenate(
        [measure(all_links(graph, trace.position[:, piece])) for piece in pieces(steps, len(graph.agents))]
    )


def _bottleneck(links: Array) -> Array:
    """The worst link of the best spanning tree: (steps, members, members) -> (steps,), metres; without limit of one."""
    if links.shape[1] < 2:
        return np.full(len(links), np.inf)
    first, second, worst = spanning_tree(links)
    step = np.arange(len(links))
    return np.asarray(links[step, first[step, worst], second[step, worst]])


def _second_eigenvalue(links: Array) -> Array:
    steps, members, _ = links.shape
    if members < 2:
        return np.zeros(steps)
    linked = (links > 0).astype(np.float64)
    laplacian = np.eye(members) * linked.sum(axis=2)[:, :, None] - linked
    return np.linalg.eigvalsh(laplacian)[:, 1]
