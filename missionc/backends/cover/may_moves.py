"""May moves and may turns: the cells that an agent may reach from a cell in a number of steps.

A move between two cells is possible under two conditions. Some points of both cells are no further apart than the agent
can move in that time, and no nearer than the agent must move. A chain of cells connects the two cells, and no point of
the chain is too far from both. No trajectory makes an excluded move.

A turn bounds the later position of an agent of bounded acceleration by its current position and the position equally
long before. Over a time t before and after, its path bends by at most its acceleration times t squared.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import connected_components

from missionc.backends.cover.cells import Cells
from missionc.backends.smt.encode.clauses import FALSE, Clauses
from missionc.backends.smt.encode.lower_motion import Motion
from missionc.base.trace import Array, Flags
from missionc.geometry.distance_ranges import Range, length_range
from missionc.ir import Dynamics, Mission

MORE = 1e-5
"""Fraction, and metres, by which an agent may exceed its dynamics; it is above the verification tolerance."""

NEAR = 120
"""Maximum number of cells within reach for which every chain is examined."""


def furthest(dynamics: Dynamics, seconds: float) -> float:
    """Greatest distance that an agent can move in a time, metres.

    An agent with momentum counts as moving at top speed from the start.
    """
    return (dynamics.top_speed * (1 + MORE) + MORE) * seconds + MORE


def nearest(dynamics: Dynamics, step: float, steps: int, dimension: int) -> float:
    """Least distance between an agent's positions ``steps`` steps apart, metres, with the sharpest constant turn.

    In a volume, climbs are unbounded, so that after two steps the agent may be at the same position.

    Source:
        Schur's comparison theorem for polygons; no bound for turns of half a turn or more.
    """
    slowest = 0.0 if dynamics.has_momentum else dynamics.lowest_speed
    turn = dynamics.top_turn * step + MORE
    if slowest <= 0 or (steps > 1 and (dimension > 2 or (steps - 1) * turn >= math.pi)):
        return 0.0
    stretch = 1.0 if steps == 1 else math.sin(steps * turn / 2) / math.sin(turn / 2)
    return max(0.0, (slowest * (1 - MORE) - MORE) * step * stretch - MORE)


def may_move(cells: Cells, least: float, most: float) -> Flags:
    """Return true for each pair of cells, (cells, cells), joined by a possible motion of ``least`` to ``most``
    metres."""
    distance = cells.distance
    near = (distance.low <= most) & (distance.high >= least)
    if len(cells) == 0 or bool(_connected(cells.touching)):
        return near
    return near & _joined(distance.low, cells.touching, cells.before, most)


def _connected(touching: Flags) -> bool:
    """Return true if all cells touch each other, so that every straight path is clear and chains exclude nothing."""
    return bool(touching.all())


def _joined(distance: Array, touching: Flags, before: NDArray[np.int32], most: float) -> Flags:
    """Return true for each pair of cells that a chain of cells within reach connects: (cells, cells).

    Args:
        distance: least distances of cells, (cells, cells), metres.
    """
    within = distance <= most
    few = within.sum(axis=1) <= NEAR
    joined = _led_to(distance, before, most, few)
    links = csr_matrix(touching, dtype=np.int8)
    for cell in np.flatnonzero((within & ~joined).any(axis=1)).tolist():
        near = np.flatnonzero(within[cell])
        here = int(np.searchsorted(near, cell))
        if not few[cell]:
            part = connected_components(links[near][:, near])[1]
            joined[cell, near] = part == part[here]
            continue
        row = np.flatnonzero(~joined[cell, near])
        allowed = distance[cell, near][None, :] + distance[np.ix_(near[row], near)] <= most
        joined[cell, near[row]] = _met(touching[np.ix_(near, near)], allowed, here)[np.arange(row.size), row]
    return joined


def _led_to(distance: Array, before: NDArray[np.int32], most: float, few: Flags) -> Flags:
    """Return true for each pair of cells whose shortest chain stays within reach: (cells, cells).

    Most reachable cells are reached along the shortest chain, which is the fastest to test.

    Args:
        distance: least distances of cells, (cells, cells), metres.
        few: (cells,): True if no cell of the chain may be too far from both its ends.
    """
    led: Flags = np.zeros(distance.shape, dtype=np.bool_)
    begin, end = np.nonzero(distance <= most)
    at = end
    while begin.size:
        there = at == begin
        led[begin[there], end[there]] = True
        begin, end, at = begin[~there], end[~there], before[begin[~there], at[~there]]
        chained = at >= 0
        begin, end, at = begin[chained], end[chained], at[chained]
        on = distance[begin, at] + np.where(few[begin], distance[end, at], 0.0) <= most
        begin, end, at = begin[on], end[on], at[on]
    return led


def _met(links: Flags, allowed: Flags, here: int) -> Flags:
    """Return true for each cell that is reachable in each row from cell ``here``, over links and the row's allowed
    cells.

    Shape: (rows, near).
    """
    reached: Flags = np.zeros(allowed.shape, dtype=np.bool_)
    reached[:, here] = True
    weight = links.astype(np.float32)
    while True:
        after = reached | ((reached.astype(np.float32) @ weight > 0) & allowed)
        if np.array_equal(after, reached):
            return reached
        reached = after


MOST_CELLS = 60
"""Maximum number of cells for which triples are examined."""

SHAKEN = 1e-5
"""Error of positions per step, metres; it is above the verification tolerance."""


def add_turns(
    mission: Mission, cells: tuple[Cells, ...], motion: Motion, cast: frozenset[int], clauses: Clauses
) -> None:
    """Add clauses that limit turns by the agents' accelerations, over 1, 2, 4, … steps.

    Raises:
        TooLarge: the clauses would exceed their limit.
    """
    for number, own in enumerate(cells):
        agents = cast.intersection(motion.roadmaps[number].agents)
        dynamics = mission.agents[motion.roadmaps[number].agents[0]].dynamics
        for apart, may in may_turn(mission, own, dynamics) if agents else ():
            for agent in sorted(agents):
                _add(clauses, motion, agent, apart, may)


def may_turn(mission: Mission, cells: Cells, dynamics: Dynamics) -> Iterator[tuple[int, Flags]]:
    """Yield numbers of steps with the possible triples of cells at these intervals, (cells, cells, cells), if any is
    excluded."""
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
    """Return true for each possible third cell after two others at equal intervals: (cells, cells, cells)."""
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
