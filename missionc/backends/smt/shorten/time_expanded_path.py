"""Shortest path of one agent on the time-expanded roadmap, within given states and clear of all others."""

from __future__ import annotations

import numpy as np

from missionc.backends.smt.encode.lower_motion import Motion
from missionc.backends.smt.refine.collisions import each_step, kinematics, metric, needed
from missionc.backends.smt.roadmap.roadmap import Indices
from missionc.backends.smt.shorten.minimize_distance import move_lengths
from missionc.base.trace import Array, Flags
from missionc.geometry.dynamics import States, motion_of
from missionc.geometry.relative_motion import closest_approach
from missionc.ir import Mission


class TimeExpandedRoadmap:
    """The time-expanded roadmap: the moves of one roadmap at each step, by where they lead.

    ``cost``, (steps, moves), is their length in metres and a little for not
    waiting, ever more of it: of ways of one length the one is best that is the
    least restless, then the one that is over soonest.
    """

    def __init__(self, mission: Mission, motion: Motion, number: int) -> None:
        motion_cost = 1e-6  # metres added to each step in motion, later steps up to twice as much
        roadmap = motion.roadmaps[number]
        order = np.lexsort((roadmap.moves[:, 0], roadmap.moves[:, 1]))
        self.source, self.target = roadmap.moves[order].T
        self.allowed = roadmap.allowed[:, order]
        self.length = move_lengths(mission, motion, number)[order]
        restless = motion_cost * (1 + np.arange(motion.steps) / (1 + motion.steps))
        self.cost = self.length + restless[:, None] * (self.source != self.target)
        states = States(roadmap.position, roadmap.velocity)
        dynamics = mission.agents[roadmap.agents[0]].dynamics
        self.moves = motion_of(dynamics, states.take(self.source), states.take(self.target), mission.step)
        self._count = len(roadmap.position)
        self._into = np.searchsorted(self.target, np.arange(self._count + 1))
        self._reached = np.flatnonzero(np.diff(self._into))
        self._begins = self._into[self._reached]

    def taken(self, way: Indices) -> Indices:
        """The moves of a way, (steps + 1,): (steps,)."""
        return np.searchsorted(self.target * self._count + self.source, way[1:] * self._count + way[:-1])

    def cost_of(self, way: Indices) -> float:
        return float(self.cost[np.arange(len(way) - 1), self.taken(way)].sum())

    def shortest(self, room: Flags, free: Flags) -> Indices | None:
        """The way of least cost, (steps + 1,).

        Args:
            room: (steps + 1, states), where it may lead.
            free: (steps, moves), what it may take.
        """
        steps = len(free)
        able = free & room[1:, self.target] & room[:-1, self.source]
        cost = np.where(able, self.cost, np.inf)
        least = np.full((steps + 1, self._count), np.inf)
        least[0, room[0]] = 0.0
        for step in range(steps):
            whole = least[step, self.source] + cost[step]
            least[step + 1, self._reached] = np.minimum.reduceat(whole, self._begins)
        way = np.empty(steps + 1, dtype=np.int64)
        way[-1] = np.argmin(least[-1])
        if not np.isfinite(least[-1, way[-1]]):
            return None
        for step in range(steps - 1, -1, -1):
            into = slice(self._into[way[step + 1]], self._into[way[step + 1] + 1])
            way[step] = self.source[into][np.argmin(least[step, self.source[into]] + cost[step, into])]
        return way


class JointPaths:
    """The paths of all agents, (agents, steps + 1), clear of each other, and the search for a shorter one of them."""

    def __init__(self, states: Indices, motion: Motion, mission: Mission) -> None:
        self.states, self.motion, self.mission = states.copy(), motion, mission
        everyone = np.arange(motion.agents)
        self.expanded = [TimeExpandedRoadmap(mission, motion, number) for number in range(len(motion.roadmaps))]
        self.tracks = kinematics(self.states, everyone, motion, mission)
        pairs = [(np.full(motion.agents, agent), everyone, mission) for agent in everyone.tolist()]
        self.apart, self.metric = [needed(*pair) for pair in pairs], [each_step(metric(*pair)) for pair in pairs]

    def cost(self, agent: int) -> float:
        """The cost of the agent's path as it is now, metres."""
        expanded = self.expanded_of(agent)
        return expanded.cost_of(self.states[agent])

    def expanded_of(self, agent: int) -> TimeExpandedRoadmap:
        return self.expanded[int(self.motion.roadmap_of[agent])]

    def shorter_path(self, agent: int, room: Flags, still_from: int, gain: float) -> Indices | None:
        """A way that costs less than its own by more than ``gain``, clear of all others; the best there is.

        Only moves that lead into somebody are shut, as they are met: what is
        found before all are shut costs no more than what is found then.

        Args:
            room: (steps + 1, states), where it may lead.
            still_from: from this step on it stays where it is.
        """
        expanded, least, factors = self.expanded_of(agent), self.apart[agent], self.metric[agent]
        free = expanded.allowed.copy()
        free[still_from:, expanded.source != expanded.target] = False
        enough = self.cost(agent) - gain
        while (way := expanded.shortest(room, free)) is not None:
            taken = expanded.taken(way)
            if expanded.cost_of(way) >= enough:
                return None
            nearest = self._nearest(tuple(part[taken] for part in expanded.moves), self.tracks, factors)
            nearest[agent] = np.inf
            met, step = np.nonzero(nearest < least[:, None])
            if not met.size:
                return way
            theirs = tuple(part[met, step][:, None] for part in self.tracks)
            others = None if factors is None else factors[met]
            clear = self._nearest(expanded.moves, theirs, others) >= least[met][:, None]
            for moment, moves in zip(step.tolist(), clear, strict=True):
                free[moment] &= moves
        return None

    def _nearest(self, one: tuple[Array, ...], other: tuple[Array, ...], factors: Array | None) -> Array:
        """Least distance of motions of one step, as position, velocity, acceleration: (..., dim) thrice -> (...), m."""
        return closest_approach(one[0], one[1], one[2], other[0], other[1], other[2], self.mission.step, factors)

    def take(self, agent: int, way: Indices) -> None:
        """The agent goes another way."""
        self.states[agent] = way
        track = kinematics(way[None], np.array([agent]), self.motion, self.mission)
        for part, row in zip(self.tracks, track, strict=True):
            part[agent] = row[0]
