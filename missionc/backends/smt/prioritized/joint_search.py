"""Joint search: exact joint motion of two or three agents, if one of them has no path around the others.

    in   the task of each agent, the reservations of all others
    out  a joint motion without conflict; or the proof that their roadmaps contain none, for any motion of others

The untimed product of their roadmaps and relaxed residuals (``progression``) gives the distance to go of each joint
state. A joint state without connection to an end has no joint motion. With this bound, the joint time-expanded roadmap
is searched, like ``single_agent_search`` for one agent.

Source:
    Standley, "Finding optimal solutions to cooperative pathfinding problems", 2010: agents one by one within a step,
    and only agents that cannot be planned separately.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import reduce

import numpy as np
from scipy.sparse.csgraph import dijkstra

from missionc.backends.smt.prioritized.label_setting import FAR, Mover
from missionc.backends.smt.prioritized.reservations import ReservationTable
from missionc.backends.smt.settings import smt_settings
from missionc.base.trace import Array, Flags, Indices
from missionc.planning.distance_to_go import NO_WAY, ProductGraph, reversed_to_ends
from missionc.planning.progression.residuals import TooComplex


class JointSearch:
    """Search for a joint motion of a few agents.

    Args:
        apart: required horizontal distance of centres, (agents, agents), metres.
        metric: factors on the axes of their difference, (agents, agents, dim), as for ``closest_approach``.
    """

    def __init__(self, movers: Sequence[Mover], apart: Array, metric: Array | None) -> None:
        self.movers = movers
        self._settings = smt_settings(movers[0].table.mission).search
        self._haste = self._settings.haste * max(mover.table.longest for mover in movers)
        self._pairs = [(one, other) for other in range(len(movers)) for one in range(other)]
        self._clear = {
            (one, other): self._clear_moves(
                movers[one].table,
                movers[other].table,
                float(apart[one, other]),
                None if metric is None else metric[one, other],
            )
            for one, other in self._pairs
        }
        self._untimed = [self._product(mover) for mover in movers]
        self._spots = [len(each.ends) for each in self._untimed]
        self._to_go = self._distances()
        """Lower bound of the remaining distance of all agents, (joint spots,), metres; infinite without a path."""

    def _product(self, mover: Mover) -> ProductGraph:
        """Product of an agent's roadmap and its relaxed residuals, independent of time."""
        task, moves = mover.task, mover.table.roadmap.moves
        usable = mover.table.roadmap.allowed.any(axis=0) & np.asarray(mover.may.any(axis=0))[moves].all(axis=1)
        return ProductGraph.of(
            task.relaxation.of(task.begin),
            task.relaxation,
            task.own_letters,
            task.own_places,
            task.finish,
            moves,
            self._settings.joint_phases,
            np.asarray(usable),
        )

    def _clear_moves(
        self, one: ReservationTable, other: ReservationTable, least: float, factors: Array | None
    ) -> Flags:
        """Return true for each pair of moves, (moves, moves), during which the agents stay at least ``least`` metres
        apart.

        ``factors`` are the factors on the axes, (dim,).

        Raises:
            TooComplex: there are too many pairs of moves.
        """
        if len(one.length) * len(other.length) > self._settings.joint_edges:
            raise TooComplex
        clear = np.ones((len(one.length), len(other.length)), dtype=np.bool_)
        first, second = other.too_near(one.moves, least, factors)
        clear[first, second] = False
        return clear

    def _distances(self) -> Array:
        untimed = self._untimed
        if np.prod([len(each.tail) for each in untimed], dtype=float) > self._settings.joint_edges:
            raise TooComplex
        rows: list[Indices] = [np.arange(len(untimed[0].tail))]
        for agent in range(1, len(untimed)):
            size = len(untimed[agent].tail)
            before = len(rows[0])
            rows = [np.repeat(row, size) for row in rows] + [np.tile(np.arange(size), before)]
            clear = [
                self._clear[one, agent][untimed[one].move[rows[one]], untimed[agent].move[rows[agent]]]
                for one in range(agent)
            ]
            kept = np.flatnonzero(reduce(np.logical_and, clear))
            rows = [row[kept] for row in rows]
        tail = self._joint([each.tail[row] for each, row in zip(untimed, rows, strict=True)])
        head = self._joint([each.head[row] for each, row in zip(untimed, rows, strict=True)])
        length = sum(
            mover.table.length[each.move[row]] for mover, each, row in zip(self.movers, untimed, rows, strict=True)
        )
        ends = reduce(np.logical_and.outer, [each.ends for each in untimed]).reshape(-1)
        left = np.where(ends, NO_WAY, np.inf)
        # There are no parallel edges: a spot and its move determine the next.
        graph = reversed_to_ends(tail, head, np.asarray(length + self._haste), left)
        return np.asarray(dijkstra(graph, indices=[len(ends)]))[0, :-1]

    def _joint(self, spots: Sequence[Indices]) -> Indices:
        """Index of the joint spot from the spots of all agents, (rows,) each -> (rows,)."""
        joint = spots[0]
        for each, count in zip(spots[1:], self._spots[1:], strict=True):
            joint = joint * count + each
        return joint

    @property
    def refused(self) -> bool:
        """True if there is no joint motion for any time and any other agents."""
        grid = np.meshgrid(*(mover.starts for mover in self.movers), indexing="ij")  # the first phase is 0
        return not np.isfinite(self._to_go[self._joint([each.ravel() for each in grid])]).any()

    def find(self) -> Indices | None:
        """Short joint motion, states (agents, steps + 1); None if none is found in time.

        Raises:
            TooComplex: the search takes too much work, or a formula reads the past.
        """
        settings = self._settings
        if any(mover.task.memory is not None for mover in self.movers):
            raise TooComplex
        self._work = 0
        longest = max(mover.table.longest for mover in self.movers)
        for attempt in range(settings.joint_bounds + 1):
            more = longest * settings.joint_widening**attempt if attempt < settings.joint_bounds else np.inf
            found = self._within(more)
            if found is not None:
                return found
        return None

    def _within(self, more: float) -> Indices | None:
        """Shortest joint motion, states (agents, steps + 1), whose cost exceeds the untimed lower bound by at most
        ``more``; None without such a motion."""
        movers = self.movers
        steps = len(movers[0].table.roadmap.allowed)
        grid = np.meshgrid(*(mover.starts for mover in movers), indexing="ij")
        states = [each.ravel() for each in grid]
        left = [np.full(states[0].shape, mover.task.number(mover.task.begin)) for mover in movers]
        cost = np.zeros(len(states[0]))
        to_go = self._left(left, states)
        bound, goes = float(to_go.min(initial=np.inf)) + more, to_go > FAR
        if not np.isfinite(to_go).any():
            return None
        trail: list[tuple[list[Indices], Indices]] = [(states, np.arange(len(cost)))]
        for step in range(steps):
            row = np.arange(len(cost))
            moves: list[Indices] = []
            after: list[Indices] = []
            for agent, mover in enumerate(movers):
                table, task = mover.table, mover.task
                again, move = table.onward(states[agent][row])
                self._work += len(move)
                if self._work > self._settings.joint_work:
                    raise TooComplex
                there = table.roadmap.moves[move, 1]
                free = mover.may[step + 1, there] & table.free(step, move, pushing=False)
                for one in range(agent):
                    free &= self._clear[one, agent][moves[one][again], move]
                again, move = again[free], move[free]
                now = row[again]
                places = task.place(step, states[agent][now])
                residual = task.after(step, left[agent][now], places, task.moves[move])
                if step == steps - 1:
                    target = table.roadmap.moves[move, 1]
                    ending = np.flatnonzero((residual >= 0) & task.finish[target])
                    again, move = again[ending], move[ending]
                    place = task.place(steps, target[ending])
                    residual = task.after(steps, residual[ending], place, task.ends[move])
                    residual[residual != task.number(True)] = -1
                alive = np.flatnonzero(residual >= 0)
                again, move, residual = again[alive], move[alive], residual[alive]
                row = row[again]
                moves = [*(each[again] for each in moves), move]
                after = [*(each[again] for each in after), residual]
            if not len(row):
                return None
            heads = [mover.table.roadmap.moves[move, 1] for mover, move in zip(movers, moves, strict=True)]
            whole = cost[row] + sum(mover.table.length[move] for mover, move in zip(movers, moves, strict=True))
            whole += self._haste * goes[row]
            to_go = self._left(after, heads)
            near = np.flatnonzero(whole + to_go <= bound)
            order = near[np.lexsort((whole[near], *(each[near] for each in (*after, *heads))))]
            changes = np.zeros(len(order), dtype=np.bool_)
            changes[:1] = True
            for each in (*after, *heads):
                changes[1:] |= np.diff(each[order]) != 0
            order = order[changes]
            if not len(order):
                return None
            goes = to_go[order] > FAR
            states, left, cost = [each[order] for each in heads], [each[order] for each in after], whole[order]
            trail.append((states, row[order]))
        best = int(np.argmin(cost))
        way = np.empty((len(movers), steps + 1), dtype=np.int64)
        for step in range(steps, -1, -1):
            reached, parent = trail[step]
            way[:, step] = [each[best] for each in reached]
            best = int(parent[best])
        return way

    def _left(self, residuals: Sequence[Indices], states: Sequence[Indices]) -> Array:
        """Lower bound of the remaining distance of all agents together, (rows,), metres."""
        spots, known = [], np.ones(len(states[0]), dtype=np.bool_)
        for mover, untimed, residual, state in zip(self.movers, self._untimed, residuals, states, strict=True):
            kinds, row = np.unique(residual, return_inverse=True)
            relaxed = [mover.task.relaxation.of(mover.task.residuals[kind]) for kind in kinds.tolist()]
            phase = np.array([untimed.phases.get(each, -1) for each in relaxed], dtype=np.int64)[row]
            known &= phase >= 0
            spots.append(np.maximum(phase, 0) * len(mover.task.finish) + state)
        apart = sum(
            mover.task.to_go(residual, state)
            for mover, residual, state in zip(self.movers, residuals, states, strict=True)
        )
        return np.where(known, self._to_go[self._joint(spots)], apart)
