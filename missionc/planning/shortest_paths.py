"""Shortest paths on a graph between terminal nodes: the edges they use, their exits to a goal, and a spanner.

The spanner has few edges, such that no path becomes much longer. It tests each pair with a bounded search on the edges
accepted so far. The A* search is our own, since scipy's Dijkstra would need a new graph for every edge.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from heapq import heappop, heappush

import numpy as np
from scipy.sparse import coo_array, csr_array
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import cKDTree

from missionc.base.trace import Array, Indices


def on_shortest_ways(graph: csr_array, nodes: Array, places: int) -> Indices:
    """Edges of shortest paths between terminals (the first ``places`` nodes): (edges, 2), the smaller node index first.

    The paths lead from the first terminal to all others, so that terminals stay connected, and from each other terminal
    to its nearest terminals.

    Args:
        graph: edge lengths, metres, each edge once.
        nodes: (nodes, dim), metres, the terminals first.
        places: number of terminals.
    """
    local, detour = 60, 3.0  # nearest places with a path; greatest length over the straight line
    at_once = 64  # number of places whose distances to all nodes are in memory at once
    graph, far = csr_array(graph + graph.T), np.inf
    if places > local:
        far = detour * np.asarray(cKDTree(nodes[:places]).query(nodes[:places], k=local + 1)[0])[:, -1].max()
    taken = []
    for first in (0, *range(1, places, at_once)):
        rows = np.arange(first, min(first + at_once, places)) if first else np.array([0])
        lengths, befores = dijkstra(graph, indices=rows, return_predecessors=True, limit=far if first else np.inf)
        for length, before in zip(lengths, befores, strict=True):
            here = np.arange(places)
            if first and places > local:
                here = np.argpartition(length[:places], local)[:local]
            met = np.zeros(len(nodes), dtype=bool)
            while len(here):
                here = here[(before[here] >= 0) & ~met[here]]
                met[here] = True
                taken.append(np.stack([before[here], here], axis=1))
                here = np.unique(before[here])
    edges = np.concatenate([np.zeros((0, 2), dtype=np.int64), *taken]).astype(np.int64)
    return np.unique(np.sort(edges, axis=1), axis=0)


def left_at(graph: csr_array, nears: list[Indices], lasts: list[Array]) -> Iterator[Indices]:
    """For each goal, yield the node at which the shortest path from each node leaves the graph towards the goal.

    Shape: (nodes,), -1 without a path.

    Args:
        graph: edge lengths, metres, each edge once.
        nears: for each goal, the nodes next to it.
        lasts: distances from these nodes to the goal, metres.
    """
    count = graph.shape[0]
    one, other = graph.tocoo().coords
    goal = np.repeat(count + np.arange(len(nears)), [len(near) for near in nears])
    ends = np.r_[one, other, goal], np.concatenate([other, one, *nears])
    size = count + len(nears)
    outward = csr_array(coo_array((np.concatenate([graph.data, graph.data, *lasts]), ends), shape=(size, size)))
    for number in range(count, size):
        before = dijkstra(outward, indices=np.array([number]), return_predecessors=True)[1][0]
        left = np.where(before == number, np.arange(size), before)
        left[before < 0] = number
        for _ in range(count.bit_length()):
            left = left[left]
        yield np.where(left[:count] == number, -1, left[:count])


def greedy_spanner(nodes: Array, edges: Indices, stretch: float) -> Indices:
    """Edges, (edges, 2), of a greedy spanner: no path is longer than ``stretch`` times the shortest path in all edges.

    Args:
        nodes: (nodes, dim), metres.
        edges: candidate edges, (edges, 2), node indices.

    Source:
        Althöfer, Das, Dobkin, Joseph, Soares, "On sparse spanners of weighted graphs" (1993).
    """
    place = [tuple(node) for node in nodes.tolist()]
    length = np.linalg.norm(nodes[edges[:, 0]] - nodes[edges[:, 1]], axis=1)
    links: dict[int, list[int]] = {}
    needed = []
    for edge in np.argsort(length, kind="stable").tolist():
        one, other = edges[edge].tolist()
        if not _is_near(one, other, stretch * float(length[edge]), place, links):
            needed.append(edge)
            links.setdefault(one, []).append(other)
            links.setdefault(other, []).append(one)
    return np.asarray(edges[np.sort(np.array(needed, dtype=np.int64))])


def _is_near(one: int, other: int, most: float, place: list[tuple[float, ...]], links: dict[int, list[int]]) -> bool:
    """Return true if a path along the links from ``one`` to ``other`` has at most ``most`` metres, by A*."""
    goal, best = place[other], {one: 0.0}
    queue = [(math.dist(place[one], goal), one)]
    while queue:
        _, here = heappop(queue)
        if here == other:
            return True
        for there in links.get(here, ()):
            gone = best[here] + math.dist(place[here], place[there])
            whole = gone + math.dist(place[there], goal)
            if whole <= most and gone < best.get(there, math.inf):
                best[there] = gone
                heappush(queue, (whole, there))
    return False
