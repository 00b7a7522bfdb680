"""Lines whose ends meet, joined to closed outlines.

    in   lines, seen from above
    out  rings, and the lines that are in none

A ring runs only through points at which two ends meet: if more meet, the pairs that belong together are not known.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence

import numpy as np
import shapely
from numpy.typing import NDArray

from missionc.base.late_dataclass import dataclass
from missionc.maps.dxf.curves import Points

SAME = 1e-6
"""Metres between two ends that are the same but for rounding."""


@dataclass(frozen=True, slots=True)
class Ring:
    """Lines in order, corners (points, 2), and the largest distance between two ends that meet."""

    lines: tuple[int, ...]
    corners: Points
    gap: float


def join_ends(lines: Sequence[Points], tolerance: float) -> tuple[list[Ring], list[int]]:
    """Rings of lines, in the order of the first line of each, and the remaining lines.

    Args:
        lines: (points, 2) each, at least one point.
        tolerance: distance of two ends that meet.
    """
    if len(lines) == 1 and np.hypot(*(lines[0][0] - lines[0][-1])) <= SAME:
        return [_ring(lines, [(0, 0)])], []
    nodes = _nodes(np.array([end for line in lines for end in (line[0], line[-1])]), tolerance).reshape(-1, 2)
    leaving: dict[int, list[tuple[int, int]]] = defaultdict(list)
    for number, ends in enumerate(nodes.tolist()):
        for side, node in enumerate(ends):
            leaving[node].append((number, side))
    rings, used = [], set[int]()
    # From points with more or fewer ends first: a ring may touch another there. The others are rings through pairs.
    for start in sorted(leaving, key=lambda node: len(leaving[node]) == 2):
        for first in leaving[start]:
            if first[0] in used:
                continue
            chain, node = [first], int(nodes[first[0], 1 - first[1]])
            while node != start and len(leaving[node]) == 2:
                one, other = leaving[node]
                arrived = chain[-1][0], 1 - chain[-1][1]
                chain.append(other if one == arrived else one)
                node = int(nodes[chain[-1][0], 1 - chain[-1][1]])
            used.update(number for number, _ in chain)
            if node == start:
                rings.append(_ring(lines, chain))
    rings.sort(key=lambda ring: min(ring.lines))
    joined = {number for ring in rings for number in ring.lines}
    return rings, [number for number in range(len(lines)) if number not in joined]


def _nodes(ends: Points, tolerance: float) -> NDArray[np.intp]:
    """The point of each end, by a number: ends that are the same, or two others that are nearest to each other."""
    _, nodes, counts = np.unique(np.round(ends / SAME), axis=0, return_inverse=True, return_counts=True)
    nodes = nodes.reshape(-1)
    (alone,) = np.nonzero(counts[nodes] == 1)
    points, nearest = shapely.points(ends[alone]), np.arange(len(alone))
    one, other = shapely.STRtree(points).query_nearest(
        points, max_distance=tolerance, exclusive=True, all_matches=False
    )
    nearest[one] = other
    mutual = nearest[nearest] == np.arange(len(alone))
    nodes[alone[mutual]] = np.minimum(nodes[alone], nodes[alone[nearest]])[mutual]
    return nodes


def _ring(lines: Sequence[Points], chain: list[tuple[int, int]]) -> Ring:
    pieces = [lines[number][:: -1 if side else 1] for number, side in chain]
    gaps = [np.hypot(*(piece[0] - pieces[at - 1][-1])) for at, piece in enumerate(pieces)]
    corners = np.concatenate([piece[1:] for piece in pieces])
    return Ring(tuple(number for number, _ in chain), corners, float(max(gaps)))
