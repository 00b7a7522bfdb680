"""Lateral offsets, so that paths along the same segment lie beside each other as lines on a transit map do."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import TypeAlias

import numpy as np

from missionc.base.trace import Array

Segment: TypeAlias = tuple[tuple[float, ...], ...]

SAME = 6
"""Decimals, in metres, to which two places are the same."""


@dataclass(frozen=True, slots=True, eq=False)
class _Use:
    """A segment, in the direction of whoever came first (so that sides do not change along its way), and its users."""

    along: Array
    agents: list[int]


def lanes(paths: Array, gap: float) -> Array:
    """How far to shift each vertex of each path.

    Args:
        paths: (agents, steps + 1, 2), metres.
        gap: between two lines, metres.

    Returns:
        (agents, steps + 1, 2), metres; zero where no other agent goes the same way.
    """
    uses: dict[Segment, _Use] = {}
    for agent, path in enumerate(paths):
        for start, end in pairwise(path):
            use = uses.setdefault(_segment(start, end), _Use(end - start, []))
            if agent not in use.agents:
                use.agents.append(agent)
    shifts = np.zeros_like(paths)
    for agent, path in enumerate(paths):
        sides = [_side(uses[_segment(start, end)], agent, gap) for start, end in pairwise(path)]
        for vertex in range(len(path)):
            moving = [side for side in _around(sides, vertex) if side is not None]
            if moving:
                shifts[agent, vertex] = np.mean(moving, axis=0)
    return shifts


def _segment(start: Array, end: Array) -> Segment:
    """Either way round the same."""
    return tuple(sorted(tuple(point.tolist()) for point in (np.round(start, SAME) + 0.0, np.round(end, SAME) + 0.0)))


def _side(use: _Use, agent: int, gap: float) -> Array | None:
    """The shift along one segment; absent where the agent waits."""
    length = float(np.linalg.norm(use.along))
    if length < 10.0**-SAME:
        return None
    across = np.array([-use.along[1], use.along[0]]) / length
    return np.asarray(across * gap * (use.agents.index(agent) - (len(use.agents) - 1) / 2))


def _around(sides: list[Array | None], vertex: int) -> list[Array | None]:
    """Those of the segments before and after a vertex; past a wait, of the next one that moves."""
    before = next((side for side in reversed(sides[:vertex]) if side is not None), None)
    after = next((side for side in sides[vertex:] if side is not None), None)
    return [before, after]
