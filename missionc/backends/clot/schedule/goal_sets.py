"""Goal sets and their cost-to-go: grid cells at which a formula is true for an agent, and geodesics to them.

    in   Mission, a formula without temporal operators
    out  GoalSet

Every formula that one agent's position decides has a goal set: a region, a compared coordinate or distance, and their
combinations with *and*, *or* and *not*. Paths avoid static obstacles, and stay in the region that the agent must never
leave.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy import ndimage, sparse
from scipy.sparse.csgraph import dijkstra

from missionc.backends.clot.schedule.geodesics import Geodesics, slowed
from missionc.backends.clot.settings import clot_settings
from missionc.backends.speed_limits import PointMargins, slowness
from missionc.base.late_dataclass import Record
from missionc.base.trace import Array, Flags, Indices
from missionc.geometry.dynamics import speeds
from missionc.geometry.required_separation import SpacingTable
from missionc.geometry.vectors import norm
from missionc.ir import Mission, Predicate
from missionc.ir.kernel.evaluate import evaluate
from missionc.ir.kernel.nodes import Atom, Node

DETOUR = 0.1
"""Weight of a second of travel against a second of delay of the meeting, when a meeting point is chosen."""

BEYOND = 1.5
"""Assumed ratio of the path length to the straight line, if the grid has no path."""


class GoalSet(Record, eq=False):
    """Goal set of a formula for an agent, with the distance to it.

    Args:
        cells: flags of its cells, (grid,).
        points: target point of each of its cells, (cells, dim), metres.
        nearest: for each cell of the grid, the index of the nearest target point, (grid,).
        length: path length to the goal set, (grid,), metres; infinite without a path. A metre with a speed limit counts
            as the distance at top speed in that time.
        share: size as a fraction of the free cells.
        open: True if the formula can be true at an allowed position of the agent.
    """

    cells: Indices
    points: Array
    nearest: Indices
    length: Array
    share: float
    open: bool


@dataclass(slots=True)
class FreeCells:
    """Allowed cells of agents of one size, (grid,), moves between them, and for each cell the nearest allowed one,
    (grid,).

    ``slowness``: time per metre relative to that at top speed, (grid,); None for 1 everywhere.
    """

    cells: Flags
    moves: sparse.csr_matrix
    nearest: Indices
    slowness: Array | None
    lengths: dict[int, Array] = field(default_factory=dict)


class GoalSets:
    """Cache of the goal sets of a mission's formulas.

    Args:
        kept: requirements of each agent that apply at all times.
    """

    def __init__(self, mission: Mission, geodesics: Geodesics, kept: Sequence[Iterable[Node]]) -> None:
        self.mission, self.grid = mission, geodesics
        self.kept = [tuple(each) for each in kept]
        self._low: list[float] = geodesics.low.tolist()
        self.places = geodesics.points.reshape(-1, mission.dimension)
        self._roaming: dict[object, FreeCells] = {}
        self._sets: dict[object, GoalSet | None] = {}
        self._apart: dict[object, float] = {}
        self._met: dict[object, tuple[Array, Array]] = {}
        self._moved: dict[object, Array] = {}

    def of(self, agent: int, nodes: Sequence[Node]) -> GoalSet | None:
        """Goal set of the conjunction of formulas for an agent; None if positions do not decide it."""
        key = frozenset(nodes), self._kind(agent)
        if key not in self._sets:
            self._sets[key] = self._made(agent, nodes)
        return self._sets[key]

    def way(self, goal: GoalSet, agent: int, here: Array) -> tuple[Array, float, bool]:
        """Target point for an agent at ``here``, (dim,), metres, the path length to the point, metres, and true if a
        path is known."""
        roaming = self.roaming(agent)
        cell = int(roaming.nearest[self._cell(here)])
        there = goal.points[goal.nearest[cell]]
        straight = math.dist(there, here)
        if straight < self.grid.cell:
            return there, straight if roaming.slowness is None else straight * float(roaming.slowness[cell]), goal.open
        length = float(goal.length[cell])
        if not math.isfinite(length):
            return there, BEYOND * straight, False
        return there, max(straight, length), goal.open

    def lengths(self, agent: int, here: Array) -> Array:
        """Path length from a position, (dim,), to every cell, metres, (grid,); infinite without a path."""
        roaming = self.roaming(agent)
        cell = int(roaming.nearest[self._cell(here)])
        if cell not in roaming.lengths:
            roaming.lengths[cell] = dijkstra(roaming.moves, indices=np.array([cell]))[0]
        return roaming.lengths[cell]

    def meeting(
        self,
        agents: Sequence[int],
        here: Array,
        free: Array,
        pace: Array,
        reach: float,
        goals: Sequence[GoalSet | None],
        onward: Sequence[GoalSet | None],
    ) -> tuple[Array, Array]:
        """Meeting points of agents with the earliest last arrival, (members, dim), metres, and path lengths,
        (members,), metres.

        Args:
            here: current positions, (members, dim), metres.
            free: time at which each agent is free, after the earliest one, (members,), seconds.
            pace: speed of each agent, (members,), m/s.
            reach: greatest distance between any two agents, metres.
            goals: additional goal of each agent.
            onward: next goal of each agent.
        """
        key = (
            tuple(agents),
            here.tobytes(),
            tuple(np.round(free, 1).tolist()),
            reach,
            tuple(map(id, goals)),
            tuple(map(id, onward)),
        )
        if key in self._met:
            return self._met[key]
        within = clot_settings(self.mission).schedule.meeting * reach / 2
        side = 1 + 2 * int(within / self.grid.cell / math.sqrt(self.mission.dimension))
        ways, (last, about, sum_of_ways) = [], np.zeros((3, len(self.places)))
        for number, (agent, goal) in enumerate(zip(agents, goals, strict=True)):
            way = self.lengths(agent, here[number])
            if goal is not None:
                inside = np.full(len(way), np.inf)
                inside[goal.cells] = way[goal.cells]
                way = inside
            ways.append(way)
            low = ndimage.minimum_filter(way.reshape(self.grid.shape), side, mode="nearest").ravel()
            last = np.maximum(last, free[number] + low / pace[number])
            sum_of_ways += low / pace[number]
            later = onward[number]
            if later is not None:
                sum_of_ways += np.where(np.isfinite(later.length), later.length, 0.0) / pace[number]
        for number, (agent, way) in enumerate(zip(agents, ways, strict=True)):
            least = speeds(self.mission.agents[agent].dynamics)[0]
            if least > 0:  # an agent that cannot wait for the others circles until they arrive
                finite = np.where(np.isfinite(way), way, 0.0)
                about += np.maximum(last - free[number] - finite / least, 0.0)
        middle = self.places[int((last + about + DETOUR * sum_of_ways).argmin())]
        close = np.flatnonzero(norm(self.places - middle) <= max(within, self.grid.cell / 2))
        points, lengths = here.copy(), np.zeros(len(agents))
        for number, way in enumerate(ways):
            cell = int(close[way[close].argmin()])
            points[number] = self.places[cell]
            straight = float(np.linalg.norm(points[number] - here[number]))
            lengths[number] = way[cell] if np.isfinite(way[cell]) else BEYOND * straight
        self._met[key] = self._parted(agents, points, here, within), lengths
        return self._met[key]

    def moved_on(
        self, agents: Sequence[int], points: Array, seconds: float, pace: Array, goals: Sequence[GoalSet | None]
    ) -> Array:
        """Positions after a time of agents that stay near each other, (members, dim), metres.

        Args:
            points: current positions, (members, dim), metres.
            seconds: duration.
            pace: speed of each agent, (members,), m/s.
            goals: next goal of each agent; the furthest goals determine the direction.
        """
        key = tuple(agents), points.tobytes(), seconds, pace.tobytes(), tuple(map(id, goals))
        if key in self._moved:
            return self._moved[key]
        middle = points.mean(axis=0)
        gone = np.max([self.lengths(agent, middle) / pace[number] for number, agent in enumerate(agents)], axis=0)
        ahead = [goal.length / each for goal, each in zip(goals, pace, strict=True) if goal is not None]
        left = np.max(ahead, axis=0) + DETOUR * np.sum(ahead, axis=0) if ahead else np.zeros(len(gone))
        cells = np.flatnonzero(gone <= seconds)
        self._moved[key] = points
        if len(cells):
            cost = left[cells] - DETOUR * gone[cells]
            self._moved[key] = points + (self.places[cells[int(cost.argmin())]] - middle)
        return self._moved[key]

    def _parted(self, agents: Sequence[int], points: Array, here: Array, within: float) -> Array:
        """Meeting points, (members, dim), metres, with coinciding agents separated in the directions from which they
        arrive."""
        middle = points.mean(axis=0)
        needed = SpacingTable.of(self.mission).among(np.array(agents)) / 2
        parted = points.copy()
        for number, point in enumerate(points):
            if (
                np.linalg.norm(points - point, axis=1).min(initial=np.inf, where=np.arange(len(points)) != number)
                < 2 * needed
            ):
                aside = here[number] - middle
                length = float(np.linalg.norm(aside))
                parted[number] = middle + aside / max(length, 1e-9) * min(max(needed, within / 2), max(length, needed))
        return parted

    def roaming(self, agent: int) -> FreeCells:
        """Allowed cells of an agent, by its size and the requirements that apply at all times."""
        key = self._kind(agent)
        if key not in self._roaming:
            room = self.mission.agents[agent].radius + self.mission.clearance
            free = self.grid.room.ravel() >= room
            kept = self.margin(agent, self.kept[agent], self.places)
            cells = free if kept is None or not (free & (kept >= 0)).any() else free & (kept >= 0)
            moves = self.grid._graph(room)
            if (free & ~cells).any():
                inside = sparse.diags(cells.astype(float))
                moves = (inside @ moves @ inside).tocsr()
                moves.eliminate_zeros()
            slower = slowness(self.mission, agent, self.kept[agent], self.places)
            if slower is not None:
                moves = slowed(moves, slower)
            if not cells.any():
                cells = np.ones_like(free)
            outside = ~cells.reshape(self.grid.shape)
            nearest = ndimage.distance_transform_edt(outside, return_distances=False, return_indices=True)
            flat = np.ravel_multi_index(tuple(nearest), self.grid.shape).ravel()
            self._roaming[key] = FreeCells(cells, moves, flat, slower)
        return self._roaming[key]

    def margin(self, agent: int, nodes: Sequence[Node], points: Array) -> Array | None:
        """Least margin of formulas of an agent at points: (points, dim), metres -> (points,), metres; None if
        undecided."""
        values = evaluate(nodes, PointMargins(self.mission, agent, points))
        known = [value for node in nodes if (value := values[node]) is not None]
        return np.min(np.broadcast_arrays(*known), axis=0) if known else None

    def apart(self, agent: int, one: Predicate, other: Predicate) -> float:
        """Lower bound of an agent's distance between the goal sets of two predicates, metres; 0 if unknown.

        Halfway between the two sets, both margins are minus half of the distance, up to half of a cell.
        """
        key = self._kind(agent), one, other
        if key not in self._apart:
            margins = [self.margin(agent, (Atom(each),), self.places) for each in (one, other)]
            known = [each for each in margins if each is not None]
            both = float(np.minimum(*known).max()) if len(known) == len(margins) else 0.0
            self._apart[key] = -2 * both if both < -self.grid.cell * math.sqrt(self.mission.dimension) / 2 else 0.0
        return self._apart[key]

    def _kind(self, agent: int) -> object:
        """Key that is equal for agents with the same allowed positions."""
        each = self.mission.agents[agent]
        return each.radius, each.altitude, each.dynamics, frozenset(self.kept[agent])

    def _cell(self, point: Array) -> int:
        number = 0
        for low, count, here in zip(self._low, self.grid.shape, point.tolist(), strict=True):
            number = number * count + min(max(int((here - low) // self.grid.cell), 0), count - 1)
        return number

    def _made(self, agent: int, nodes: Sequence[Node]) -> GoalSet | None:
        settings = clot_settings(self.mission).schedule
        margin = self.margin(agent, nodes, self.places)
        if margin is None:
            return None
        roaming = self.roaming(agent)
        margin = np.where(roaming.cells, np.broadcast_to(margin, len(self.places)), -np.inf)
        best = float(margin.max())
        deep = np.flatnonzero(margin >= min(settings.inside, 0.5 * best))
        cells = deep if best > 0 else np.array([int(margin.argmax())])
        points = self.places[cells]
        if best <= settings.inside:  # it is smaller than a cell, or in no free cell
            points, best = self._finer(agent, [*nodes, *self.kept[agent]], points)
        length, _, source = dijkstra(roaming.moves, indices=cells, min_only=True, return_predecessors=True)
        number = np.zeros(len(self.places), dtype=np.int64)
        number[cells] = np.arange(len(cells))
        nearest = np.where(source >= 0, number[np.maximum(source, 0)], 0)
        return GoalSet(cells, points, nearest, length, len(cells) / max(1, int(roaming.cells.sum())), best >= 0)

    def _finer(self, agent: int, nodes: Sequence[Node], points: Array) -> tuple[Array, float]:
        """For each point, the nearby point with the best margin of the formulas, (cells, dim), metres, and the largest
        margin, metres."""
        finer = 7  # points along each side of a cell, if no cell centre satisfies the requirement
        dim = points.shape[1]
        line = (np.arange(finer) / (finer - 1) - 0.5) * self.grid.cell * 2
        around = np.stack(np.meshgrid(*[line] * dim, indexing="ij"), axis=-1).reshape(-1, dim)
        every = points[:, None] + around
        margin = self.margin(agent, nodes, every.reshape(-1, dim))
        assert margin is not None
        margins = np.broadcast_to(margin, every[..., 0].size).reshape(len(points), -1)
        return every[np.arange(len(points)), margins.argmax(axis=1)], float(margins.max())
