"""Shortest ways along a graph between places, by Dijkstra: the edges they take, and where they leave it for a goal."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array, csr_array
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import cKDTree

from missionc.base.trace import Array

Indices = NDArray[np.int64]


def on_shortest_ways(graph: csr_array, nodes: Array, places: int) -> Indices:
    """The edges of shortest ways between places: (edges, 2), the lesser node first.

    From the first to all others, so that nothing is apart that need not be; from each other to the nearest ones.

    Args:
        graph: metres, each edge once.
        nodes: (nodes, dim), metres, the places first.
        places: how many they are.
    """
    local, detour = 60, 3.0  # nearest places of a place that get a path, and its length over the straight one at most
    at_once = 64  # places whose distances to all nodes are held at once
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
    """For each goal, where the shortest way from each node to it leaves the graph: (nodes,), -1 where there is none.

    Args:
        graph: metres, each edge once.
        nears: for each goal the nodes that it is come to from.
        lasts: how far it is from them, metres.
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
