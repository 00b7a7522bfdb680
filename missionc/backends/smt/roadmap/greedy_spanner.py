"""A greedy spanner: few edges of a graph, along which no way is much longer."""

from __future__ import annotations

import math
from heapq import heappop, heappush

import numpy as np
from numpy.typing import NDArray

from missionc.base.trace import Array

Indices = NDArray[np.int64]


def greedy_spanner(nodes: Array, edges: Indices, stretch: float) -> Indices:
    """Edges, (edges, 2), of a greedy spanner: without the others no path is longer than ``stretch`` times itself.

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
    """Whether a way along the links has so many metres at most: A* among what lies near the straight way."""
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
