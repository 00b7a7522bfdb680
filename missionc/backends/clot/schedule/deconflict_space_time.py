"""Deconfliction in space and time: agents avoid each other or wait, and teams avoid moving obstacles.

    in   a joint trajectory between two steps
    out  the same with fewer conflicts; for a team, its trajectory past moving or growing obstacles, or None

Both are trajectories of least effort through cells and layers of time (``space_time_search``).

*Agents among each other*, by prioritized planning: in a layer no agent moves further than the separation of bodies, and
cells are half as wide. One agent after the other, the longest path first, gets its trajectory around the earlier
agents. Agents with conflicts left get another trajectory around all others, for a few rounds. The local optimisation
resolves the rest.

*A team past obstacles*: its centre moves, and its members keep their offsets. No member touches a static obstacle, and
contacts with a moving obstacle at its position at that time are minimised.

Source:
    Erdmann and Lozano-Pérez, "On multiple moving objects", 1987.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

import numpy as np

from missionc.backends.clot.schedule.geodesics import Geodesics, cells_of, middles
from missionc.backends.clot.settings import clot_settings
from missionc.base.late_dataclass import Record
from missionc.base.trace import Array, Flags
from missionc.geometry.clearance import distance_to_obstacle
from missionc.geometry.polylines import at_lengths
from missionc.geometry.required_separation import SpacingTable
from missionc.ir import Mission
from missionc.planning.space_time_search import least_effort

ROOM = 0.05
"""Additional clearance of bodies, metres."""


def deconflict_space_time(
    mission: Mission, position: Array, begin: int, alone: Sequence[int], geodesics: Geodesics
) -> Array:
    """Joint trajectory after replanning single agents to avoid conflicts: (agents, steps + 1, dim), metres.

    Args:
        position: (agents, steps + 1, dim), metres, from step ``begin`` of the mission on; the first and last stay.
        alone: agents whose trajectory may change.
    """
    span = position.shape[1] - 1
    if span < 2 or len(alone) < 2:
        return position
    layers = _Layers.of(mission, position, alone)
    if layers is None:
        return position
    return _GiveWay(mission, position, begin, alone, geodesics, layers).moved()


class _Layers(Record):
    """Layers of time and the grid of positions.

    Args:
        apart: required horizontal distance of bodies' centres, metres.
        metric: factors on the axes of the difference of two centres, (dim,).
        share: time of each layer as a fraction of the time between the two steps, (layers,).
        cell: cell size, metres.
        low: centre of the first cell, (dim,), metres.
    """

    apart: float
    metric: Array
    share: Array
    cell: float
    low: Array
    shape: tuple[int, ...]

    @staticmethod
    def of(mission: Mission, position: Array, alone: Sequence[int]) -> _Layers | None:
        agents = [mission.agents[agent] for agent in alone]
        spacing = SpacingTable.of(mission)
        apart, metric = spacing.among(np.array(alone)) + ROOM, np.ones(position.shape[2])
        metric[2:] = spacing.flatness.min()
        speed = max(float(agent.dynamics.top_speed) for agent in agents)
        count = max(2, int(np.ceil((position.shape[1] - 1) * mission.step * speed / apart)))
        around = position[list(alone)]
        low = np.maximum(around.min(axis=(0, 1)) - 3 * apart, mission.world.low)
        high = np.minimum(around.max(axis=(0, 1)) + 3 * apart, mission.world.high)
        cell = apart / 2
        shape = tuple(int(each) + 1 for each in np.floor((high - low) / cell))
        if np.prod(shape) > clot_settings(mission).guess.grid:
            return None
        return _Layers(apart, metric, np.linspace(0.0, 1.0, count + 1), cell, low, shape)


class _GiveWay:
    def __init__(
        self,
        mission: Mission,
        position: Array,
        begin: int,
        alone: Sequence[int],
        geodesics: Geodesics,
        layers: _Layers,
    ) -> None:
        self.mission, self.position, self.alone, self.layers = mission, position, list(alone), layers
        steps = np.linspace(0.0, 1.0, position.shape[1])
        share = layers.share
        self.steps = steps
        self.way = np.stack([at_lengths(one, steps, share) for one in position])  # (agents, layers, dim)
        axes = [low + np.arange(count) * layers.cell for low, count in zip(layers.low, layers.shape, strict=True)]
        self.points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
        self.room = geodesics.room_at(self.points)
        duration = (position.shape[1] - 1) * mission.step
        self.seconds = duration / (len(share) - 1)
        reach = int(np.ceil(layers.apart / min(1.0, layers.metric.min()) / layers.cell)) + 1
        self.near = np.array(list(product(range(-reach, reach + 1), repeat=position.shape[2])))
        self.taken = self._of_movers(begin * mission.step + share * duration)

    def moved(self) -> Array:
        meeting = self._meeting()
        if not meeting:
            return self.position
        for agent in range(len(self.way)):
            if agent not in meeting:
                self._take(agent, 1.0)
        lengths = np.linalg.norm(np.diff(self.way, axis=1), axis=2).sum(axis=1)
        for agent in sorted(meeting, key=lambda each: (-lengths[each], each)):
            self._replan(agent)
            self._take(agent, 1.0)
        for _ in range(clot_settings(self.mission).guess.rounds):
            still = self._meeting()
            if not still:
                break
            for agent in sorted(still, key=lambda each: (-lengths[each], each)):
                self._take(agent, -1.0)
                self._replan(agent)
                self._take(agent, 1.0)
        made = self.position.copy()
        for agent in sorted(meeting):
            made[agent, 1:-1] = at_lengths(self.way[agent], self.layers.share, self.steps[1:-1])
        return made

    def _meeting(self) -> list[int]:
        """Agents that may be replanned and are in conflict with another agent."""
        found: set[int] = set()
        for layer in range(1, self.way.shape[1] - 1):
            points = self.way[:, layer]
            apart = np.linalg.norm((points[:, None] - points[None]) * self.layers.metric, axis=-1)
            np.fill_diagonal(apart, np.inf)
            found.update(np.flatnonzero((apart < self.layers.apart - 2 * ROOM).any(axis=1)).tolist())
        return [agent for agent in self.alone if agent in found]

    def _take(self, agent: int, sign: float) -> None:
        """Add (``sign`` 1) or remove (-1) an agent's occupation of the cells in each layer, larger for nearer cells."""
        way, cell = self.way[agent], self.layers.cell
        index = np.round((way - self.layers.low) / cell).astype(np.int64)[:, None] + self.near
        inside = ((index >= 0) & (index < np.array(self.layers.shape))).all(axis=2)
        apart = np.linalg.norm((self.layers.low + index * cell - way[:, None]) * self.layers.metric, axis=2)
        much = np.where(inside, np.maximum(0.0, 1.0 - apart / self.layers.apart), 0.0)
        layer, which = np.nonzero(much)
        np.add.at(self.taken, (layer, *index[layer, which].T), sign * much[layer, which])

    def _of_movers(self, times: Array) -> Array:
        """Occupation of each cell by moving or growing obstacles, (layers, *cells), for times (layers,), seconds."""
        taken = np.zeros((len(times), *self.layers.shape))
        radius = max(self.mission.agents[agent].radius for agent in self.alone) + self.mission.clearance + ROOM
        for obstacle in self.mission.obstacles:
            if obstacle.constant:
                continue
            for layer, time in enumerate(times):
                gap = distance_to_obstacle(obstacle, self.points, float(time))
                taken[layer] += np.maximum(0.0, radius - gap) / radius
        return taken

    def _replan(self, agent: int) -> None:
        """Replace an agent's trajectory by the least-effort trajectory around the others."""
        one, layers = self.mission.agents[agent], self.layers
        free: Flags = self.room >= one.radius + self.mission.clearance
        first, last = (self._cell(self.way[agent, end], free) for end in (0, -1))
        reach = float(one.dynamics.top_speed) * self.seconds / layers.cell
        cost = clot_settings(self.mission).guess.meeting * self.taken[:-1]
        cost[0] = 0.0
        cost[:, ~free] = np.inf
        cells = least_effort(cost, first, last, reach)
        if cells is None:
            return
        points = layers.low + cells * layers.cell
        points[0], points[-1] = self.way[agent, 0], self.way[agent, -1]
        self.way[agent] = points

    def _cell(self, point: Array, free: Flags) -> tuple[int, ...]:
        """Index of the free cell nearest to a point, (dim,), metres."""
        far = np.where(free, np.linalg.norm(self.points - point, axis=-1), np.inf)
        return tuple(int(each) for each in np.unravel_index(int(far.argmin()), far.shape))


def avoid_moving_obstacles(
    mission: Mission, team: list[int], around: Array, times: Array, start: Array, end: Array, geodesics: Geodesics
) -> Array | None:
    """Positions of a team's centre at each step, (steps, dim), metres, that avoid moving obstacles; None if none are
    found.

    Args:
        around: offsets of its members from the centre, (members, steps, dim), metres.
        times: times of the steps, (steps,), seconds; the first is one step after ``start``.
        start, end: positions of the centre, (dim,), metres.
    """
    ahead = 2.0  # cells that a team moves in one layer
    hurry = 1.25  # length of a path on the grid relative to that of a motion
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
    cells = least_effort(cost, first, last, reach)
    if cells is None:
        return None
    corners = geodesics.low + (cells + 0.5) * cell
    corners[0], corners[-1] = start, end
    return at_lengths(corners, np.r_[-1, layers], np.arange(len(times), dtype=np.float64))


def _costs(mission: Mission, points: Array, around: Array, times: Array, radius: float, geodesics: Geodesics) -> Array:
    """Cost of the team's centre being in a cell before each layer, (layers, *cells).

    The cost is infinite for contact with static obstacles, and 0 before the first layer. Lengths are in metres.
    """
    room = 0.05  # metres beyond a body's need
    cost = np.zeros((len(times), *points.shape[:-1]))
    movers = [obstacle for obstacle in mission.obstacles if not obstacle.constant]
    for layer, time in enumerate(times[:-1].tolist()):
        for beside in around[:, layer]:
            there = points + beside
            cost[layer + 1][geodesics.room_near(there) < radius] = np.inf
            for mover in movers:
                gap = distance_to_obstacle(mover, there, time)
                cost[layer + 1] += clot_settings(mission).guess.meeting * np.maximum(0.0, radius + room - gap) / radius
    return cost
