"""Crowding: how many bodies fit into a box at the same time, as a bound on how many agents are in cells within it.

in   Mission, Cover, Motion
out  clauses: at no step are more agents in the cells of a box than fit

Source:
    Oler, "A finite packing problem", 1961: points at least 1 apart in a convex set of area A and circumference P are at
    most 2 A / sqrt(3) + P / 2 + 1; and Dirichlet's principle, for a box cut into parts too small for two.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import combinations, product

import numpy as np

from missionc.backends.cover.bodies import must_be_apart
from missionc.backends.cover.cover import Cover
from missionc.backends.smt.encode.clauses import FALSE, TRUE, Clauses, Literals
from missionc.backends.smt.encode.lower_motion import Motion
from missionc.base.trace import Array
from missionc.ir import Mission

MOST_PARTS = 12
"""Parts along each axis, beyond which nobody counts."""

MOST_CHOICES = 600
"""Choices of agents of which one too many are said not to be there together, one by one."""


def fits(size: Sequence[float], apart: float) -> int:
    """How many points at least so many metres apart fit into a box with these sides, at most."""
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
    """Adds that in each box of the cover there are no more of these agents than fit.

    Raises:
        TooLarge: the clauses would pass their limit.
    """
    for low, high, most in rooms(mission, cover, agents):
        inside = np.stack([_inside(cover, motion, agent, low, high, clauses) for agent in sorted(agents)])
        for chosen in combinations(range(len(inside)), most + 1):
            clauses.add(*(-inside[list(chosen)]))


def rooms(mission: Mission, cover: Cover, agents: frozenset[int]) -> Iterator[tuple[Array, Array, int]]:
    """Boxes of the cover, corners (dim,) each, metres, that fewer of these agents fit into than there are; how many."""
    if len(agents) < 2:
        return
    apart = min(must_be_apart(mission, one, other) for one, other in combinations(sorted(agents), 2))
    for low, high in cover.boxes:
        most = fits((high - low).tolist(), apart)
        if most < len(agents) and math.comb(len(agents), most + 1) <= MOST_CHOICES:
            yield low, high, most


def _inside(cover: Cover, motion: Motion, agent: int, low: Array, high: Array, clauses: Clauses) -> Literals:
    """Literals that an agent in a cell within the box implies, at each step: (steps + 1,)."""
    cells = cover.cells[int(motion.roadmap_of[agent])]
    within = np.all((cells.low >= low) & (cells.high <= high), axis=1)
    there = motion.states[agent][:, within]
    result = np.where((there == TRUE).any(axis=1), TRUE, FALSE).astype(np.int32)
    open_ = (result == FALSE) & (there != FALSE).any(axis=1)
    result[open_] = clauses.fresh(int(open_.sum()))
    row, column = np.nonzero((there != FALSE) & open_[:, None])
    clauses.add(-there[row, column], result[row])
    return result
