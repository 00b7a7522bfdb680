"""May turns: where an agent of bounded acceleration may be later, by where it is and where it was as long before.

In a time t before and after, its way may bend by its acceleration times t squared, and no more.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from missionc.backends.cover.cells import Cells
from missionc.backends.cover.may_moves import MORE
from missionc.backends.smt.encode.clauses import FALSE, Clauses
from missionc.backends.smt.encode.lower_motion import Motion
from missionc.base.trace import Flags
from missionc.ir import Dynamics, Mission
from missionc.world.distance_ranges import Range, length_range

MOST_CELLS = 60
"""Cells up to which every two are looked at, with every third."""

SHAKEN = 1e-5
"""Metres for each step by which places may be off: more than verification lets pass."""


def add_turns(
    mission: Mission, cells: tuple[Cells, ...], motion: Motion, cast: frozenset[int], clauses: Clauses
) -> None:
    """Adds that nobody turns more sharply than its acceleration lets it, in 1, 2, 4, … steps.

    Raises:
        TooLarge: the clauses would pass their limit.
    """
    for number, own in enumerate(cells):
        agents = cast.intersection(motion.roadmaps[number].agents)
        dynamics = mission.agents[motion.roadmaps[number].agents[0]].dynamics
        for apart, may in may_turn(mission, own, dynamics) if agents else ():
            for agent in sorted(agents):
                _add(clauses, motion, agent, apart, may)


def may_turn(mission: Mission, cells: Cells, dynamics: Dynamics) -> Iterator[tuple[int, Flags]]:
    """Numbers of steps, and to which third cell an agent may come so many after the second, and they after the first.

    Flags are (cells, cells, cells); nothing is said where they are all set.
    """
    if not math.isfinite(dynamics.top_acceleration) or not 0 < len(cells) <= MOST_CELLS:
        return
    apart = 1
    while 2 * apart <= mission.steps:
        time = apart * mission.step
        bend = (dynamics.top_acceleration * (1 + MORE) + MORE) * time**2 + 4 * apart * SHAKEN
        may = _may_follow(cells, bend)
        if not may.all():
            yield apart, may
        apart *= 2


def _may_follow(cells: Cells, bend: float) -> Flags:
    """Whether the third cell may come after the first two, as long after as between them: (cells, cells, cells)."""
    bent = []
    for axis in range(cells.low.shape[1]):
        low, high = cells.low[:, axis], cells.high[:, axis]
        before = Range(low, high)
        now = Range(-2 * high, -2 * low)
        both = Range(before.low[:, None] + now.low[None, :], before.high[:, None] + now.high[None, :])
        bent.append(Range(both.low[..., None] + low, both.high[..., None] + high))
    may: Flags = length_range(bent).low <= bend
    return may


def _add(clauses: Clauses, motion: Motion, agent: int, apart: int, may: Flags) -> None:
    states = motion.states[agent]
    for step in range(apart, len(states) - apart):
        before, now, after = (np.flatnonzero(states[at] != FALSE) for at in (step - apart, step, step + apart))
        fits = may[np.ix_(before, now, after)]
        first, second = np.nonzero(~fits.all(axis=2))
        chosen = fits[first, second]
        heads = np.stack([-states[step - apart][before[first]], -states[step][now[second]]], axis=1)
        _, column = np.nonzero(chosen)
        clauses.add_ragged(heads, states[step + apart][after[column]], chosen.sum(axis=1))
