"""Bodies of obstacles: convex pieces whose distance is known, so that boxes with no room for an agent are left out.

in   Mission, Agent
out  which boxes hold a place where its centre is clear of what stands there
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from missionc.base.trace import Array, Flags
from missionc.geometry.displacement import displaced, moved
from missionc.geometry.distance_ranges import signed_distance_range
from missionc.ir import Agent, Ball, Box, Disc, Mission, Obstacle, Polygon, Shape
from missionc.ir.distances.convex_pieces import HalfSpace, Piece, pieces
from missionc.ir.distances.signed_distance import measured_outside

SLACK = 1e-4
"""Metres by which bodies may be nearer to others and to obstacles than they must: more than verification lets pass."""

THIN = 1e-6
"""Metres: what is thinner is no body."""


def standing_room(obstacle: Obstacle, agent: Agent, mission: Mission, step: int, low: Array, high: Array) -> Flags:
    """Which boxes, (..., dim) corners, hold a point where an agent is clear of an obstacle at a step: (...)."""
    time = step * mission.step
    by = displaced(obstacle, time, mission.dimension)
    away = agent.radius + mission.clearance + obstacle.grown(time)
    room: Flags = np.ones(low.shape[:-1], dtype=np.bool_)
    for body in bodies(obstacle.shape):
        needed = away if measured_outside(body) else 0.0
        room &= signed_distance_range(moved(body, by), low, high).high >= needed - SLACK
    return room


def must_be_apart(mission: Mission, first: int, second: int) -> float:
    """Metres between the centres of two agents, less the slack."""
    return mission.separation + mission.agents[first].radius + mission.agents[second].radius - SLACK


@lru_cache(maxsize=1024)
def bodies(shape: Shape) -> tuple[Shape, ...]:
    """Shapes that lie in a body and fill it: plain ones where that is possible, so that distances are true ones."""
    found: list[Shape] = []
    for piece in pieces(shape):
        plain = _plain(piece)
        if plain is None:
            return (shape,)
        if not isinstance(plain, Box) or all(
            high - low > THIN for low, high in zip(plain.low, plain.high, strict=True)
        ):
            found.append(plain)
    return tuple(found)


def _plain(piece: Piece) -> Shape | None:
    """A piece as a plain shape: one that is alone, or the box common to boxes and half spaces along axes."""
    match piece:
        case (Box() | Disc() | Ball() | Polygon() as alone,):
            return alone
        case _:
            pass
    boxes = [part for part in piece if isinstance(part, Box)]
    spaces = [part for part in piece if isinstance(part, HalfSpace)]
    if not boxes or len(boxes) + len(spaces) < len(piece):
        return None
    low, high = np.max([box.low for box in boxes], axis=0), np.min([box.high for box in boxes], axis=0)
    for space in spaces:
        axes = [axis for axis, share in enumerate(space.normal) if share]
        if len(axes) != 1 or abs(space.normal[axes[0]]) != 1.0:
            return None
        (axis,) = axes
        if space.normal[axis] > 0:
            high[axis] = min(high[axis], space.offset)
        else:
            low[axis] = max(low[axis], -space.offset)
    return Box(tuple(map(float, low)), tuple(map(float, high)))
