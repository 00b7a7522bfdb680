"""Space-time search (dynamic programming) for a team that goes as one, past obstacles that move or grow.

    in   where the team is to its middle at each step, where the middle begins and ends
    out  where the middle is at each step, or None where there is no way

Time goes in layers, space in cells. Dynamic programming gives the motion of least effort, the sum of squared moves, in
which nobody of the team meets what stands and as few as can be meet what moves, where it is at that time.

Source:
    Erdmann and Lozano-Pérez, "On multiple moving objects", 1987.
"""

from __future__ import annotations

from itertools import product

import numpy as np
from numpy.typing import NDArray

from missionc.backends.clot.schedule.geodesics import Geodesics, cells_of, middles
from missionc.backends.clot.settings import clot_settings
from missionc.base.trace import Array
from missionc.geometry.displacement import displaced
from missionc.ir import Mission
from missionc.ir.distances.signed_distance import signed_distance


def avoid_moving_obstacles(
    mission: Mission, team: list[int], around: Array, times: Array, start: Array, end: Array, geodesics: Geodesics
) -> Array | None:
    """Where a team's middle is at each step, (steps, dim), metres.

    Args:
        around: where its members are to the middle, (members, steps, dim), metres.
        times: of the steps, (steps,), seconds; the first one is a step after ``start``.
        start, end: of the middle, (dim,), metres.
    """
    ahead = 2.0  # cells that a team moves in one layer
    hurry = 1.25  # length of a path on the grid over that of a motion
    radius = max(mission.agents[agent].radius for agent in team) + mission.clearance
    speed = min(float(mission.agents[agent].dynamics.top_speed) for agent in team)
    size = np.array(mission.world.high) - geodesics.low
    cell = max(geodesics.cell, float((np.prod(size) / clot_settings(mission).guess.moving_grid) ** (1 / len(size))))
    count = int(np.clip(len(times) * mission.step * speed / (ahead * cell), 1, len(times)))
    layers = np.unique(np.linspace(0, len(times) - 1, count + 1).astype(np.int64))
    if len(layers) < 2:
        return None
    reach = hurry * speed * mission.step * float(np.diff(layers).max()) / cell
    shape = tuple(int(each) for each in np.maximum(np.ceil(size / cell), 1))
    points = middles(geodesics.low, cell, shape)
    cost = _costs(mission, points, around[:, layers], times[layers], radius, geodesics)
    first, last = (tuple(cells_of(point, geodesics.low, cell, shape).tolist()) for point in (start, end))
    cells = _least(cost, first, last, reach)
    if cells is None:
        return None
    corners = geodesics.low + (cells + 0.5) * cell
    corners[0], corners[-1] = start, end
    knots = np.r_[-1, layers]
    return np.stack([np.interp(np.arange(len(times)), knots, axis) for axis in corners.T], axis=1)


def _costs(mission: Mission, points: Array, around: Array, times: Array, radius: float, geodesics: Geodesics) -> Array:
    """What it costs that the middle is in a cell at a layer, (layers, *cells); infinite where somebody meets a wall."""
    room = 0.05  # metres beyond what bodies need
    cost = np.zeros((len(times), *points.shape[:-1]))
    movers = [obstacle for obstacle in mission.obstacles if not obstacle.constant]
    for layer, time in enumerate(times.tolist()):
        for beside in around[:, layer]:
            there = points + beside
            cost[layer][geodesics.room_near(there) < radius] = np.inf
            for mover in movers:
                moved = there - displaced(mover, time, points.shape[-1])
                gap = np.asarray(signed_distance(np, mover.shape, moved)) - mover.grown(time)
                cost[layer] += clot_settings(mission).guess.meeting * np.maximum(0.0, radius + room - gap) / radius
    return cost


def _least(cost: Array, first: tuple[int, ...], last: tuple[int, ...], reach: float) -> NDArray[np.int64] | None:
    """The cells, (1 + layers, dim), of least effort and cost from one cell to another; the ends may be anywhere."""
    shape, span = cost.shape[1:], int(reach)
    moves = [move for move in product(range(-span, span + 1), repeat=len(shape)) if np.linalg.norm(move) <= reach]
    moves.sort(key=lambda move: float(np.linalg.norm(move)))
    ahead = np.full(shape, np.inf)
    ahead[last] = 0.0
    chosen = np.zeros(cost.shape, dtype=np.int16)
    for layer in range(len(cost) - 1, -1, -1):
        padded = np.pad(ahead, span, constant_values=np.inf)
        best = np.full(shape, np.inf)
        for number, move in enumerate(moves):
            there = padded[tuple(slice(span + by, span + by + size) for by, size in zip(move, shape, strict=True))]
            effort = there + float(np.dot(move, move))
            better = effort < best
            best[better] = effort[better]
            chosen[layer][better] = number
        ahead = best + (cost[layer - 1] if layer else 0.0)
    if not np.isfinite(ahead[first]):
        return None
    cells = [np.array(first)]
    for layer in range(len(cost)):
        cells.append(cells[-1] + np.array(moves[int(chosen[(layer, *cells[-1])])]))
    return np.array(cells)
