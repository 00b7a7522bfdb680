"""Visibility graph of a geodesic roadmap: straight clear paths between nodes.

    in   Ground, nodes, of which the first are terminals
    out  lengths of the paths, longer without additional clearance

Results for pairs of nodes are cached. Unlike ``geodesic_bounds``, whose lengths are lower bounds, these paths must be
clear: they become moves of agents.

Source:
    de Berg et al., "Computational Geometry" (2008), 15.1.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy.sparse import coo_array, csr_array
from scipy.spatial import cKDTree

from missionc.backends.smt.roadmap.sample_nodes import Ground
from missionc.backends.smt.settings import ShortestPathSettings, smt_settings
from missionc.base.trace import Array, Flags, Indices
from missionc.geometry.clearance import clear_of


@dataclass(slots=True, eq=False)
class Visibility:
    """Cache of the visibility of pairs of nodes, by node identifier.

    ``spare``: preferred additional clearance, metres.
    """

    ground: Ground
    spare: float
    pairs: Indices = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    clear: Flags = field(default_factory=lambda: np.zeros(0, dtype=np.bool_))
    roomy: Flags = field(default_factory=lambda: np.zeros(0, dtype=np.bool_))

    def graph(self, nodes: Array, names: Indices, places: int) -> csr_array:
        """Graph of clear straight paths between nodes, (nodes, dim), metres, of which the first ``places`` are
        terminals.

        Args:
            names: fixed identifier of each node, (nodes,).
        """
        most_nodes = 1 << 31  # more than can occur
        settings = smt_settings(self.ground.mission).shortest_paths
        one, other = _pairs(nodes, places, settings)
        length = np.linalg.norm(nodes[one] - nodes[other], axis=1)
        apart = length > 0
        one, other, length = one[apart], other[apart], length[apart]
        pair = np.minimum(names[one], names[other]) * most_nodes + np.maximum(names[one], names[other])
        self._look(pair, nodes[one], nodes[other])
        at = np.searchsorted(self.pairs, pair)
        clear = self.clear[at]
        weight = np.where(self.roomy[at], length, settings.penalty * length)[clear]
        return csr_array(coo_array((weight, (one[clear], other[clear])), shape=(len(nodes), len(nodes))))

    def _look(self, pair: Indices, start: Array, end: Array) -> None:
        """Test the pairs that are not cached; ``start`` and ``end`` are (pairs, dim), metres."""
        new = np.flatnonzero(~np.isin(pair, self.pairs))
        margin = np.full(len(new), self.ground.margin)
        clear = clear_of(self.ground.obstacles, start[new], end[new], margin)
        roomy, seen = np.zeros(len(new), dtype=np.bool_), new[clear]
        roomy[clear] = clear_of(self.ground.obstacles, start[seen], end[seen], margin[clear] + self.spare)
        pairs = np.concatenate([self.pairs, pair[new]])
        order = np.argsort(pairs, kind="stable")
        self.pairs = pairs[order]
        self.clear = np.concatenate([self.clear, clear])[order]
        self.roomy = np.concatenate([self.roomy, roomy])[order]


def _pairs(nodes: Array, places: int, settings: ShortestPathSettings) -> tuple[Indices, Indices]:
    """Pairs of nodes, (pairs,) twice, to test for a straight path; ``nodes`` is (nodes, dim), metres."""
    count = len(nodes)
    if count <= settings.all_pairs:
        one, other = np.triu_indices(count, 1)
        return one, other
    tree, looks = cKDTree(nodes), min(count, max(settings.nearest, settings.pairs // places))
    near = np.asarray(tree.query(nodes, k=settings.nearest + 1)[1])[:, 1:]
    further = np.asarray(tree.query(nodes[:places], k=looks)[1])
    one = np.r_[np.repeat(np.arange(count), settings.nearest), np.repeat(np.arange(places), looks)]
    other = np.r_[near.ravel(), further.ravel()]
    one, other = np.divmod(np.unique(np.minimum(one, other) * count + np.maximum(one, other)), count)
    return one, other
