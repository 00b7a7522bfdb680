"""Obstacle bodies as convex pieces with known distances, to exclude boxes that have no room for an agent.

in   Mission, Agent
out  the boxes that contain a clear position of the agent's centre
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
"""Reduction of required distances between bodies and to obstacles, metres; it exceeds the verification tolerance."""

THIN = 1e-6
"""Thickness, metres, below which a part of an obstacle is ignored."""


def standing_room(obstacle: Obstacle, agent: Agent, mission: Mission, step: int, low: Array, high: Array) -> Flags:
    """Return true for each box that contains a position at which the agent is clear of the obstacle at a step.

    Shape: corners (..., dim) twice, metres -> (...), boolean.
    """
    time = step * mission.step
    by = displaced(obstacle, time, mission.dimension)
    away = agent.radius + mission.clearance + obstacle.grown(time)
    room: Flags = np.ones(low.shape[:-1], dtype=np.bool_)
    for body in bodies(obstacle.shape):
        needed = away if measured_outside(body) else 0.0
        room &= signed_distance_range(moved(body, by), low, high).high >= needed - SLACK
    return room


def must_be_apart(mission: Mission, first: int, second: int) -> float:
    """Required distance between the centres of two agents minus the slack, metres."""
    return mission.separation + mission.agents[first].radius + mission.agents[second].radius - SLACK


@lru_cache(maxsize=1024)
def bodies(shape: Shape) -> tuple[Shape, ...]:
    """Shapes whose union is an obstacle's body: plain shapes if possible, so that distances are exact."""
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
    """Convex piece as a plain shape if it is a single part, or an intersection of boxes and axis-aligned half spaces;
    None otherwise."""
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
