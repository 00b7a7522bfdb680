"""Maximum (and so widest) spanning trees of many graphs at once, by Prim's algorithm in numpy."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from missionc.base.trace import Array

Indices = NDArray[np.int64]


def spanning_tree(links: Array) -> tuple[Indices, Indices, Indices]:
    """The tree whose worst link is best, and as good as can be in every other.

    Of links that lead one way it is the tree of ways from the first member to all
    others: no way to any of them has a better worst link than the one in it.

    Args:
        links: (graphs, members, members), metres; the more, the better.

    Returns:
        the edges in the order in which the tree grows, as numbers of members, (graphs, members - 1)
        twice, the second of each new to the tree; and the number of the worst, (graphs,).
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
