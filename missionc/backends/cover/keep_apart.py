"""Bodies that keep apart: pairs of cells that two agents are never in, and sides on which they cannot pass each other.

Two agents whose cells hold no two points far enough from each other are not in them at the same time. From where they
start, a pair moves through pairs of cells that touch; what it cannot come to that way, it never comes to, however fast.

Source:
    Schwartz and Sharir, "On the piano movers' problem III", 1983: several discs move in a connected part of their
    joint free space.
"""

from __future__ import annotations

from itertools import combinations

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import connected_components

from missionc.backends.cover.bodies import must_be_apart
from missionc.backends.cover.cells import Cells, distance_range
from missionc.backends.cover.cover import Cover
from missionc.backends.smt.encode.clauses import FALSE, Clauses
from missionc.backends.smt.encode.lower_motion import Motion
from missionc.base.trace import Flags
from missionc.ir import Mission

MOST_PAIRS = 400_000
"""Pairs of cells whose connections are looked at, for two agents."""


def may_be_together(mission: Mission, cells: tuple[Cells, Cells], agents: tuple[int, int]) -> Flags:
    """In which pairs of cells two agents may be at the same time, (cells of one, cells of the other)."""
    return distance_range(*cells).high >= must_be_apart(mission, *agents)


def add_separation(mission: Mission, cover: Cover, motion: Motion, agents: frozenset[int], clauses: Clauses) -> None:
    """Adds that no two of these agents are nearer than they may be, nor get past each other where there is no room.

    Raises:
        TooLarge: the clauses would pass their limit.
    """
    known: dict[tuple[int, int, bytes, bytes], Flags] = {}
    for one, other in combinations(sorted(agents), 2):
        first, second = int(motion.roadmap_of[one]), int(motion.roadmap_of[other])
        key = first, second, motion.ways[one][0].tobytes(), motion.ways[other][0].tobytes()
        if key not in known:
            cells, starts = (cover.cells[first], cover.cells[second]), (motion.ways[one][0], motion.ways[other][0])
            known[key] = together_ever(mission, cells, (one, other), starts)
        together = known[key]
        if not together.all():
            _add(clauses, motion, one, other, together)


def together_ever(
    mission: Mission, cells: tuple[Cells, Cells], agents: tuple[int, int], starts: tuple[Flags, Flags]
) -> Flags:
    """In which pairs of cells two agents may ever be together: (cells of one, cells of the other).

    Args:
        starts: in which cells each of them may be at the first step, (cells,).
    """
    together = may_be_together(mission, cells, agents)
    if together.all() or together.size > MOST_PAIRS:
        return together
    number = np.full(together.size, -1, dtype=np.int64)
    kept = np.flatnonzero(together.ravel())
    number[kept] = np.arange(len(kept))
    links = []
    for axis, own in enumerate(cells):
        here, there = np.nonzero(np.triu(own.touching, 1))
        if axis == 0:
            begin, end = number.reshape(together.shape)[here], number.reshape(together.shape)[there]
        else:
            begin, end = number.reshape(together.shape)[:, here], number.reshape(together.shape)[:, there]
        both = (begin >= 0) & (end >= 0)
        links.append((begin[both], end[both]))
    begin, end = (np.concatenate(each) for each in zip(*links, strict=True))
    graph = sparse.coo_matrix((np.ones(len(begin), dtype=np.int8), (begin, end)), shape=(len(kept), len(kept)))
    _, component = connected_components(graph, directed=False)
    begins = starts[0][:, None] & starts[1][None, :]
    reached = np.unique(component[number[(begins & together).ravel()]]) if len(kept) else np.zeros(0)
    reachable: Flags = np.zeros(together.size, dtype=np.bool_)
    reachable[kept] = np.isin(component, reached)
    return reachable.reshape(together.shape)


def _add(clauses: Clauses, motion: Motion, one: int, other: int, together: Flags) -> None:
    """If the one is in a cell, the other is in one that goes with it: at every step."""
    for step in range(motion.steps + 1):
        here, there = motion.states[one][step], motion.states[other][step]
        rows, columns = np.flatnonzero(here != FALSE), np.flatnonzero(there != FALSE)
        fits = together[np.ix_(rows, columns)]
        open_ = np.flatnonzero(~fits.all(axis=1))
        few = (~fits[open_]).sum(axis=1) <= 4
        row, column = np.nonzero(~fits[open_[few]])
        clauses.add(-here[rows[open_[few][row]]], -there[columns[column]])
        many = open_[~few]
        row, column = np.nonzero(fits[many])
        clauses.add_ragged(-here[rows[many]][:, None], there[columns[column]], np.bincount(row, minlength=len(many)))
