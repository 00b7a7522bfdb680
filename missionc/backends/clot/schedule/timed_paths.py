"""Paths in space and time among places that are closed to an agent for a time, by the earliest arrival.

    in   holds about an agent's own place, from one time to another
    out  earliest arrival at some cells, and positions at the times between

A place from which a requirement bars an agent for a while is *closed* then. Between two changes of what is closed,
paths are shortest paths on the open cells, from every cell at which the agent can be by then: it may wait anywhere.

Source:
    Phillips and Likhachev, SIPP: safe interval path planning for dynamic environments, 2011; here with one
    shortest-path search for each interval between changes.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import dijkstra

from missionc.backends.clot.schedule.goal_sets import GoalSets
from missionc.backends.clot.schedule.presence import attendance
from missionc.backends.clot.schedule.tasks import Hold
from missionc.backends.clot.settings import clot_settings
from missionc.base.late_dataclass import Record
from missionc.base.trace import Array, Flags, Indices
from missionc.geometry.dynamics import can_wait
from missionc.ir.kernel.nodes import Node

MOST_CLOSED = 0.5
"""Share of the free cells above which a condition is a place to visit, not a closed one."""


class Closure(Record):
    """Condition ``node`` on an agent's place from ``low`` to ``high``, seconds, that closes some of its cells."""

    node: Node
    low: float
    high: float


class Section(Record, eq=False):
    """Search between two changes: its begin, arrival time at each cell, and the cell before it; both (grid,).

    Times are in seconds; infinite without a path.
    """

    begin: float
    arrival: Array
    before: Indices


class TimedPath(Record, eq=False):
    """Waypoints, (points, dim), metres, with the times at which an agent is there, (points,), seconds.

    ``cell``: the target.
    """

    points: Array
    times: Array
    cell: int

    @property
    def arrival(self) -> float:
        """Seconds."""
        return float(self.times[-1])

    def at(self, times: Array) -> Array:
        """Positions at times, (times,) -> (times, dim), metres; the last one after the end."""
        return np.stack([np.interp(times, self.times, axis) for axis in self.points.T], axis=1)


@dataclass(slots=True)
class TimedPaths:
    """Paths of a mission's agents among closed places."""

    goals: GoalSets
    _closed: dict[object, Flags | None] = field(default_factory=dict)
    _moves: dict[object, sparse.csr_matrix] = field(default_factory=dict)
    _found: dict[object, TimedPath | None] = field(default_factory=dict)
    _lengths_from: dict[object, tuple[Array, Indices]] = field(default_factory=dict)
    _closing: dict[Hold, tuple[tuple[int, Closure], ...]] = field(default_factory=dict)

    def closures(self, agent: int, holds: Iterable[Hold]) -> tuple[Closure, ...]:
        """Closures of an agent by conditions at fixed steps, each from its first to its last step.

        None for an agent that cannot wait.
        """
        if not can_wait(self.goals.mission.agents[agent].dynamics):
            return ()
        return tuple(each for hold in holds for whose, each in self._of(hold) if whose == agent)

    def _of(self, hold: Hold) -> tuple[tuple[int, Closure], ...]:
        """Closures by a condition, each with its agent."""
        if hold not in self._closing:
            step = self.goals.mission.step
            asked = attendance(self.goals.mission, (hold,)).goals if hold.timeless else ()
            self._closing[hold] = tuple(
                (agent, Closure(node, hold.low * step, hold.high * step))
                for agent, nodes in asked
                for node in nodes
                if self._cells(agent, node) is not None
            )
        return self._closing[hold]

    def meets(self, agent: int, closures: Sequence[Closure], points: Array, times: Array) -> bool:
        """Return whether an agent at points, (points, dim), metres, at times, (points,), s, is in a closed region."""
        cells = np.array([self.goals._cell(point) for point in points], dtype=np.int64)
        for each in closures:
            closed = self._cells(agent, each.node)
            assert closed is not None
            if (closed[cells] & (times >= each.low) & (times <= each.high)).any():
                return True
        return False

    def path(
        self, agent: int, here: Array, begin: float, targets: Indices, closures: Sequence[Closure], pace: float
    ) -> TimedPath | None:
        """Path with the earliest arrival at a target; None without one.

        Args:
            here: position at the beginning, (dim,), metres.
            begin: seconds.
            targets: cells of the grid.
            pace: m/s.
        """
        roaming = self.goals.roaming(agent)
        first = int(roaming.nearest[self.goals._cell(here)])
        later = tuple(each for each in closures if each.high >= begin)
        key = self.goals._kind(agent), first, round(begin, 6), targets.tobytes(), later, pace
        if key not in self._found:
            self._found[key] = self._path(agent, here, first, begin, targets, later, pace)
        return self._found[key]

    def between(
        self, agent: int, here: Array, there: Array, when: tuple[float, float], closures: Sequence[Closure]
    ) -> TimedPath | None:
        """Path from one place to another, (dim,) each, metres, between two times, seconds, at the least sufficient
        speed; None without one.
        """
        settings = clot_settings(self.goals.mission).schedule
        targets = self.goals.roaming(agent).nearest[[self.goals._cell(there)]]
        for share in (settings.speed, settings.late_speed, 1.0):
            pace = share * float(self.goals.mission.agents[agent].dynamics.top_speed)
            path = self.path(agent, here, when[0], targets, closures, pace)
            if path is not None and path.arrival <= when[1]:
                return path
        return None

    def _path(
        self,
        agent: int,
        here: Array,
        first: int,
        begin: float,
        targets: Indices,
        closures: Sequence[Closure],
        pace: float,
    ) -> TimedPath | None:
        step = self.goals.mission.step
        changes = {time for each in closures for time in (each.low - step, each.high) if time > begin}
        bounds = [begin, *sorted(changes), math.inf]
        sections: list[Section] = []
        seeds = np.array([first])
        for low, high in pairwise(bounds):
            closed = self._together(agent, [each.node for each in closures if each.low - step <= low < each.high])
            seeds = seeds[~closed[seeds]]
            if not len(seeds):
                return None
            lengths, before = self._lengths(agent, closed, seeds)
            arrival = low + lengths / pace
            sections.append(Section(low, arrival, before))
            best = int(targets[arrival[targets].argmin()])
            if arrival[best] <= high and np.isfinite(arrival[best]):
                return self._traced(here, best, sections)
            seeds = np.flatnonzero(arrival <= high)
        return None

    def _traced(self, here: Array, last: int, sections: Sequence[Section]) -> TimedPath:
        """Waypoints from the searches between changes, with waits before each change."""
        cells, times = [last], [float(sections[-1].arrival[last])]
        for each in reversed(sections):
            if times[-1] > each.arrival[cells[-1]]:  # it waits there for the change
                cells.append(cells[-1])
                times.append(float(each.arrival[cells[-1]]))
            while each.before[cells[-1]] >= 0:
                cells.append(int(each.before[cells[-1]]))
                times.append(float(each.arrival[cells[-1]]))
        points = self.goals.places[cells[::-1]].copy()
        points[0] = here
        return TimedPath(points, np.array(times[::-1]), last)

    def _cells(self, agent: int, node: Node) -> Flags | None:
        """Cells, (grid,), at which a condition does not hold; None if there are none, or too many to be avoided."""
        key = self.goals._kind(agent), node
        if key not in self._closed:
            allowed = self.goals.roaming(agent).cells
            margin = self.goals.margin(agent, (node,), self.goals.places)
            closed = None if margin is None else np.broadcast_to(margin, len(allowed)) < 0
            share = 0.0 if closed is None else float(closed[allowed].mean())
            self._closed[key] = closed if 0 < share <= MOST_CLOSED else None
        return self._closed[key]

    def _together(self, agent: int, nodes: Iterable[Node]) -> Flags:
        closed = np.zeros(len(self.goals.places), dtype=np.bool_)
        for node in nodes:
            there = self._cells(agent, node)
            if there is not None:
                closed |= there
        return closed

    def _lengths(self, agent: int, closed: Flags, seeds: Indices) -> tuple[Array, Indices]:
        """Path length of an agent from the nearest of some cells to each cell, metres, and the cell before it, (grid,).

        Args:
            closed: closed cells, (grid,).
        """
        key = self.goals._kind(agent), closed.tobytes()
        if key not in self._moves:
            moves = self.goals.roaming(agent).moves
            if closed.any():
                inside = sparse.diags((~closed).astype(float))
                moves = (inside @ moves @ inside).tocsr()
                moves.eliminate_zeros()
            self._moves[key] = moves
        start = *key, seeds.tobytes()
        if start not in self._lengths_from:
            lengths, before, _ = dijkstra(self._moves[key], indices=seeds, min_only=True, return_predecessors=True)
            self._lengths_from[start] = lengths, before.astype(np.int64)
        return self._lengths_from[start]
