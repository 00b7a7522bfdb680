"""May moves: from which cell an agent may come to which other in a number of steps.

A move may be made if some point of one cell is no further from some point of the other than the agent goes in that
time, and no nearer than it must; and if a chain of cells leads there on which no point is too far from both. What is
left out, no motion of the agent does.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import connected_components

from missionc.backends.cover.cells import Cells
from missionc.base.trace import Array, Flags
from missionc.ir import Dynamics

MORE = 1e-5
"""The share by which an agent may be faster or slower than its dynamics say, and so many metres: more than
verification lets pass."""

NEAR = 120
"""Cells within reach of one, up to which every chain between two is looked at by itself."""


def furthest(dynamics: Dynamics, seconds: float) -> float:
    """How far such an agent gets at most in some time, metres; with momentum, as if it were at top speed at once."""
    return (dynamics.top_speed * (1 + MORE) + MORE) * seconds + MORE


def nearest(dynamics: Dynamics, step: float, steps: int, dimension: int) -> float:
    """How far such an agent gets at least in so many steps, metres: one that keeps turning the same way.

    In a volume nothing bounds how steeply it climbs and falls, so that after two steps it may be where it was.

    Source:
        Schur's comparison theorem for polygons; nothing is said of those that may turn by half a turn and more.
    """
    slowest = 0.0 if dynamics.has_momentum else dynamics.lowest_speed
    turn = dynamics.top_turn * step + MORE
    if slowest <= 0 or (steps > 1 and (dimension > 2 or (steps - 1) * turn >= math.pi)):
        return 0.0
    stretch = 1.0 if steps == 1 else math.sin(steps * turn / 2) / math.sin(turn / 2)
    return max(0.0, (slowest * (1 - MORE) - MORE) * step * stretch - MORE)


def may_move(cells: Cells, least: float, most: float) -> Flags:
    """From which cell to which, (cells, cells), there may be a motion of so many metres at least and at most."""
    distance = cells.distance
    near = (distance.low <= most) & (distance.high >= least)
    if len(cells) == 0 or bool(_connected(cells.touching)):
        return near
    return near & _joined(distance.low, cells.touching, most)


def _connected(touching: Flags) -> bool:
    """Whether the cells fill a box: then every straight way is clear, and chains say nothing more."""
    return bool(touching.all())


def _joined(distance: Array, touching: Flags, most: float) -> Flags:
    """To which cells of those within reach a chain of cells leads along which a motion may be short enough."""
    joined: Flags = np.zeros(distance.shape, dtype=np.bool_)
    links = csr_matrix(touching, dtype=np.int8)
    _, whole = connected_components(links)
    for cell in range(len(distance)):
        near = np.flatnonzero(distance[cell] <= most)
        here = int(np.searchsorted(near, cell))
        if len(near) > NEAR:
            part = whole if len(near) == len(whole) else connected_components(links[near][:, near])[1]
            joined[cell, near] = part == part[here]
            continue
        allowed = distance[cell, near][None, :] + distance[np.ix_(near, near)] <= most
        joined[cell, near] = _met(touching[np.ix_(near, near)], allowed, here)
    return joined


def _met(links: Flags, allowed: Flags, here: int) -> Flags:
    """Who is reached in its own row, over links and what is allowed in that row, from ``here`` on."""
    reached: Flags = np.zeros(allowed.shape, dtype=np.bool_)
    reached[:, here] = True
    weight = links.astype(np.float32)
    while True:
        after = reached | ((reached.astype(np.float32) @ weight > 0) & allowed)
        if np.array_equal(after, reached):
            return reached.diagonal()
        reached = after
