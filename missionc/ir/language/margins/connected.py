"""Margins of ``connected(graph)``: the worst link of a maximum spanning tree, and the algebraic connectivity.

Every agent must have a route to every other agent of the set, through agents of the set only. Prim's algorithm in numpy
computes maximum spanning trees of many graphs at once.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from missionc.base.trace import Array, Indices, Trace
from missionc.ir import Graph
from missionc.ir.couplings import directed
from missionc.ir.language.margins.links import all_links, link_pieces


def spanning_tree(links: Array) -> tuple[Indices, Indices, Indices]:
    """Maximum spanning trees of graphs: the worst link is as large as possible, then the second worst, and so on.

    For directed links, the result is the tree of paths from the first member to all others. No path to any member has a
    better worst link than the path in the tree.

    Args:
        links: link margins, (graphs, members, members), metres; larger is better.

    Returns:
        both members of each edge, (graphs, members - 1) twice, in the order in which the tree grows by the second
        member; and the position of the worst edge, (graphs,).
    """
    graphs, members, _ = links.shape
    row = np.arange(graphs)
    first = np.zeros((graphs, max(members - 1, 0)), dtype=np.int64)
    second, quality = first.copy(), np.zeros(first.shape)
    best, nearest = links[:, 0].copy(), np.zeros((graphs, members), dtype=np.int64)
    outside = np.ones((graphs, members), dtype=np.bool_)
    outside[:, 0] = False
    for edge in range(members - 1):
        chosen = np.where(outside, best, -np.inf).argmax(axis=1)
        first[:, edge], second[:, edge], quality[:, edge] = nearest[row, chosen], chosen, best[row, chosen]
        outside[row, chosen] = False
        further = links[row, chosen]
        better = further > best
        best = np.where(better, further, best)
        nearest = np.where(better, chosen[:, None], nearest)
    worst = quality.argmin(axis=1) if members > 1 else np.zeros(graphs, dtype=np.int64)
    return first, second, worst


def connected_margin(graph: Graph, trace: Trace) -> Array:
    """Margin of ``connected(graph)`` along a trace: the worst link of a maximum spanning tree; (steps + 1,), metres.

    In a proximity graph, the margin is the range minus the longest edge of the minimum spanning tree. For directed
    links, it is the worse of two trees: paths from the first agent to all others, and paths back. The margin is ``inf``
    for fewer than two agents.
    """
    if directed(graph):
        return _by_pieces(lambda links: np.minimum(_bottleneck(links), _bottleneck(links.mT)), graph, trace)
    return _by_pieces(_bottleneck, graph, trace)


def algebraic_connectivity(graph: Graph, trace: Trace) -> Array:
    """Algebraic connectivity along a trace: second smallest eigenvalue of the Laplacian of the links, (steps + 1,),
    dimensionless.

    The eigenvalue is positive if the graph is connected, and 0 for fewer than two agents. For directed links, it has no
    meaning.

    Source:
        [clot] III-C, λ₂.
    """
    return _by_pieces(_second_eigenvalue, graph, trace)


def _by_pieces(measure: Callable[[Array], Array], graph: Graph, trace: Trace) -> Array:
    steps = trace.position.shape[1]
    return np.concatenate(
        [measure(all_links(graph, trace.position[:, piece])) for piece in link_pieces(steps, len(graph.agents))]
    )


def _bottleneck(links: Array) -> Array:
    """Worst link margin of the maximum spanning tree: (steps, members, members) -> (steps,), metres; infinite for one
    member."""
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
