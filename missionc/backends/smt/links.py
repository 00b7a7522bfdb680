"""Which places are linked in a graph: where two agents standing there would be."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from missionc.backends.smt.roadmap import Indices
from missionc.ir import Graph
from missionc.margins import link_margin
from missionc.plan import Array

BLOCK = 1 << 20
"""How many pairs of places are looked at at once."""


@dataclass(frozen=True, slots=True, eq=False)
class Links:
    """For each place the places linked to it, itself never among them.

    Args:
        first: (places + 1,): where the neighbours of each begin.
        neighbours: (links,): each link is there from both its ends.
    """

    first: Indices
    neighbours: Indices

    def beside(self, places: Indices) -> tuple[Indices, Indices, Indices]:
        """The neighbours of these places, one after the other.

        Returns:
            how many each has, (places,); whose each is, by position in
            ``places``; and the neighbours, in the same order.
        """
        sizes = np.diff(self.first)[places]
        owner = np.repeat(np.arange(len(places)), sizes)
        within = np.arange(len(owner)) - np.repeat(np.cumsum(sizes) - sizes, sizes)
        return sizes, owner, self.neighbours[self.first[places][owner] + within]


def links_between(graph: Graph, position: Array) -> Links:
    """The links between places, (places, dim), metres."""
    places = len(position)
    rows, columns = [np.zeros(0, dtype=np.int64)], [np.zeros(0, dtype=np.int64)]
    block = max(1, BLOCK // max(1, places))
    for start in range(0, places, block):
        linked = link_margin(graph, position[start : start + block, None, :], position[None, :, :]) > 0
        row, column = np.nonzero(linked)
        row += start
        rows.append(row[row != column])
        columns.append(column[row != column])
    degrees = np.bincount(np.concatenate(rows), minlength=places)
    return Links(np.concatenate([[0], np.cumsum(degrees)]), np.concatenate(columns))
