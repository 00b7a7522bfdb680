"""CBS: conflict-based search on a grid, from w9-pathfinding, leg by leg: start, the regions in turn, finish.

Conflict-based search supports neither formulas nor links. It therefore gets the visits that the requirements name, in
their order. In each region, the targets are adjacent cells around one drawn by the seed, assigned by the minimum sum of
distances; all agents wait until the last has arrived. The grid is as coarse as the speed limit allows, with four moves
from a cell. Cells near obstacles are omitted, so that moves between cells are free too. The resulting path is not
smooth.

Source:
    [clot] Table I, CBS.
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import linear_sum_assignment
from scipy.spatial.distance import cdist
from w9_pathfinding.envs import Grid
from w9_pathfinding.mapf import CBS

from missionc.base.trace import Array, Trace
from missionc.ir import Box, Mission
from missionc.ir.distances.signed_distance import signed_distance
from missionc.ir.kernel.nodes import Kernel
from table1.scene import Unsupported, legs, speed, together, trace


def plan(mission: Mission, kernel: Kernel, seed: int, limit: float) -> Trace | str:
    generator = np.random.default_rng(seed)
    count, radius = len(mission.agents), max(agent.radius for agent in mission.agents)
    pitch = speed(mission) * mission.step
    if pitch / np.sqrt(2) < 2 * radius + mission.separation:
        raise Unsupported("a step of the fastest is shorter than two bodies that turn a corner need")
    low, high = np.array(mission.world.low), np.array(mission.world.high)
    shape = np.floor((high - low) / pitch + 1e-9).astype(int) + 1
    centres = low + np.stack(np.meshgrid(*map(np.arange, shape), indexing="ij"), axis=-1) * pitch
    free = np.ones(shape, dtype=bool)
    for obstacle in mission.obstacles:
        free &= signed_distance(np, obstacle.shape, centres) >= radius + mission.clearance + pitch / 2
    grid = Grid(weights=np.where(free, 1.0, -1.0).T.tolist(), edge_collision=True)
    cells = np.argwhere(free)
    places = [_cells(cells, centres, area, count, generator) for area in legs(mission, kernel)]
    solver, path = CBS(grid), [[tuple(map(int, cell))] for cell in places[0]]
    for there in places[1:]:
        here = [each[-1] for each in path]
        _, to = linear_sum_assignment(cdist(here, there, "cityblock"))
        goals = [tuple(map(int, there[number])) for number in to]
        left = mission.steps + 1 - len(path[0])
        try:
            found = solver.mapf(here, goals, max_length=left, max_time=10 * limit)
        except RuntimeError:
            return "the limit came first"
        if not found:
            return "no paths in the steps there are"
        longest = max(map(len, found))
        for each, leg in zip(path, found, strict=True):
            each.extend([*leg[1:], *[leg[-1]] * (longest - len(leg))])
    if len(path[0]) > mission.steps + 1:
        return f"takes {len(path[0]) - 1} steps of {mission.steps}"
    cell = np.array([each + [each[-1]] * (mission.steps + 1 - len(each)) for each in path])
    return trace(mission, centres[cell[..., 0], cell[..., 1]])


def _cells(cells: Array, centres: Array, area: Box, count: int, generator: np.random.Generator) -> Array:
    where = centres[cells[:, 0], cells[:, 1]]
    within = cells[(where >= np.array(area.low)).all(axis=1) & (where <= np.array(area.high)).all(axis=1)]
    if len(within) < count:
        raise Unsupported(f"{count} agents do not fit {len(within)} cells")
    return together(within, count, generator)
