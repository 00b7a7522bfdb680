"""Separation of bodies on a cover: excluded pairs of cells, and limits on the number of agents in a box.

    in   Mission, Cover, Motion
    out  clauses on pairs of cells, on the sides of passing agents, and on the number of agents in a box

Two agents can be in two cells at the same time only if the cells contain two points that are far enough apart. From its
starts, a pair of agents moves through pairs of cells that touch. It never reaches another pair of cells, at any speed.

At each step, the cells of a box contain at most as many agents as fit into the box.

Source:
    Schwartz and Sharir, "On the piano movers' problem III", 1983: several discs move in a connected part of their joint
    free space. Oler, "A finite packing problem", 1961: points at least 1 apart in a convex set of area A and
    circumference P are at most 2 A / sqrt(3) + P / 2 + 1; and Dirichlet's principle, for a box cut into parts too small
    for two.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import combinations, product

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import connected_components

from missionc.backends.cover.bodies import must_be_apart
from missionc.backends.cover.cells import Cells, distance_range
from missionc.backends.cover.cover import Cover
from missionc.backends.smt.encode.clauses import FALSE, TRUE, Clauses, Literals
from missionc.backends.smt.encode.lower_motion import Motion
from missionc.base.trace import Array, Flags
from missionc.ir import Mission

MOST_PARTS = 12
"""Maximum number of parts of a box along each axis in the packing bound."""

MOST_CHOICES = 600
"""Maximum number of agent subsets too large for a box that are excluded one by one."""


def fits(size: Sequence[float], apart: float) -> int:
    """Upper bound of the number of points with pairwise distances of at least ``apart`` metres in a box with these side
    lengths."""
    if apart <= 0:
        return 10**9
    most = math.prod(math.floor(side * math.sqrt(len(size)) / apart) + 1 for side in size)
    for parts in product(range(1, MOST_PARTS + 1), repeat=len(size)):
        if (
            math.prod(parts) < most
            and math.hypot(*(side / each for side, each in zip(size, parts, strict=True))) < apart
        ):
            most = math.prod(parts)
    if len(size) == 2:
        area, around = size[0] * size[1] / apart**2, 2 * (size[0] + size[1]) / apart
        most = min(most, math.floor(2 * area / math.sqrt(3) + around / 2 + 1 + 1e-9))
    return most


def add_crowding(mission: Mission, cover: Cover, motion: Motion, agents: frozenset[int], clauses: Clauses) -> None:
    """Add clauses that limit the number of ``agents`` in each box of the cover.

    Raises:
        TooLarge: the clauses would exceed their limit.
    """
    for low, high, most in rooms(mission, cover, agents):
        inside = np.stack([_inside(cover, motion, agent, low, high, clauses) for agent in sorted(agents)])
        for chosen in combinations(range(len(inside)), most + 1):
            clauses.add(*(-inside[list(chosen)]))


def rooms(mission: Mission, cover: Cover, agents: frozenset[int]) -> Iterator[tuple[Array, Array, int]]:
    """Yield the boxes of the cover that cannot contain all of ``agents``: corners (dim,), metres, and the maximum
    number of agents."""
    if len(agents) < 2:
        return
    apart = min(must_be_apart(mission, one, other) for one, other in combinations(sorted(agents), 2))
    for low, high in cover.boxes:
        most = fits((high - low).tolist(), apart)
        if most < len(agents) and math.comb(len(agents), most + 1) <= MOST_CHOICES:
            yield low, high, most


def _inside(cover: Cover, motion: Motion, agent: int, low: Array, high: Array, clauses: Clauses) -> Literals:
    """Literals that an agent is in a cell inside the box at each step: (steps + 1,).

    Args:
        low: lowest corner of the box, (dim,), metres; ``high``: highest corner.
    """
    cells = cover.cells[int(motion.roadmap_of[agent])]
    within = np.all((cells.low >= low) & (cells.high <= high), axis=1)
    there = motion.states[agent][:, within]
    result = np.where((there == TRUE).any(axis=1), TRUE, FALSE).astype(np.int32)
    open_ = (result == FALSE) & (there != FALSE).any(axis=1)
    result[open_] = clauses.fresh(int(open_.sum()))
    row, column = np.nonzero((there != FALSE) & open_[:, None])
    clauses.add(-there[row, column], result[row])
    return result


MOST_PAIRS = 400_000
"""Maximum number of pairs of cells for which reachability of joint positions of two agents is analysed."""


def may_be_together(mission: Mission, cells: tuple[Cells, Cells], agents: tuple[int, int]) -> Flags:
    """Return true for each pair of cells that two agents may occupy together: (cells of one, cells of the other)."""
    return distance_range(*cells).high >= must_be_apart(mission, *agents)


def add_separation(mission: Mission, cover: Cover, motion: Motion, agents: frozenset[int], clauses: Clauses) -> None:
    """Add clauses for the separation of ``agents``, which also forbid that they pass each other without room.

    Raises:
        TooLarge: the clauses would exceed their limit.
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
    """Return true for each pair of cells that two agents can reach together from their starts.

    Shape: (cells of one, cells of the other).

    Args:
        starts: possible cells of each agent at the first step, (cells,).
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
    """Add for every step: if the first agent is in a cell, the second agent is in a compatible cell."""
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
