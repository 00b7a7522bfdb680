"""May visits: pairs of cells that an agent cannot both visit because the path would be too long."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from missionc.backends.cover.cells import Cells
from missionc.backends.cover.cover import Cover
from missionc.backends.cover.may_moves import MORE, furthest
from missionc.backends.smt.encode.clauses import FALSE, TRUE, Clauses
from missionc.backends.smt.encode.lower_motion import Motion
from missionc.base.trace import Flags
from missionc.ir import Mission


def add_visits(
    mission: Mission,
    cover: Cover,
    motion: Motion,
    cast: frozenset[int],
    lengths: Mapping[int, float],
    clauses: Clauses,
) -> None:
    """Add clauses that no agent ever visits two cells too far from its start and from each other.

    Args:
        lengths: maximum path length of some agents, metres; by default the distance at top speed.

    Raises:
        TooLarge: the clauses would exceed their limit.
    """
    for agent in sorted(cast):
        cells = cover.cells[int(motion.roadmap_of[agent])]
        never = too_far_apart(mission, cells, agent, motion.ways[agent][0], lengths)
        there = motion.states[agent]
        able = (there != FALSE).any(axis=0)
        one, other = np.nonzero(np.triu(never, 1) & able[:, None] & able[None, :])
        alone = np.flatnonzero(never.diagonal() & able)
        wanted = np.unique(np.concatenate([one, other, alone]))
        ever = np.full(len(never), FALSE, dtype=np.int32)
        ever[wanted] = clauses.fresh(len(wanted))
        ever[(there == TRUE).any(axis=0)] = TRUE
        step, cell = np.nonzero(there[:, wanted] != FALSE)
        clauses.add(-there[step, wanted[cell]], ever[wanted[cell]])
        clauses.add(-ever[one], -ever[other])
        clauses.add(-ever[alone])


def too_far_apart(mission: Mission, cells: Cells, agent: int, starts: Flags, lengths: Mapping[int, float]) -> Flags:
    """Return true for each pair of cells that an agent cannot both visit: (cells, cells); the diagonal is for single
    cells.

    Args:
        starts: possible cells at the first step, (cells,).
        lengths: maximum path lengths, metres, as for ``add_visits``.
    """
    most = furthest(mission.agents[agent].dynamics, mission.steps * mission.step)
    if agent in lengths:
        most = min(most, lengths[agent] * (1 + MORE) + MORE)
    if not starts.any():
        return np.zeros((len(cells), len(cells)), dtype=np.bool_)
    first = cells.distance.low[starts].min(axis=0)
    far: Flags = np.minimum(first[:, None], first[None, :]) + cells.distance.low > most
    return far
