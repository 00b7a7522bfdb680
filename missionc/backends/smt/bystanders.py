"""Agents that nobody needs, planned one after the other around those whose motion is settled.

Each takes the way along its roadmap, by the clock, that is shortest among those
that keep clear of all before it.
"""

from __future__ import annotations

import numpy as np

from missionc.backends.smt.collisions import kinematics, needed
from missionc.backends.smt.lower_motion import Motion
from missionc.backends.smt.roadmap import Indices, Roadmap
from missionc.ir import Mission
from missionc.plan import Array, Flags
from missionc.world.dynamics import States, motion_of
from missionc.world.motion import closest_approach


def settle(states: Indices, cast: frozenset[int], motion: Motion, mission: Mission) -> Indices | None:
    """The joint motion with the others in it, (agents, steps + 1); None where one of them finds no way.

    Args:
        states: (agents, steps + 1); of the cast, what they do.
    """
    states = states.copy()
    kinds = [Kind(roadmap, mission) for roadmap in motion.roadmaps]
    for agent in sorted(cast):
        for kind in kinds:
            kind.keep_clear_of(agent, states, motion)
    for agent in range(motion.agents):
        if agent not in cast:
            way = kinds[int(motion.roadmap_of[agent])].shortest(motion.ways[agent])
            if way is None:
                return None
            states[agent] = way
            for kind in kinds:
                kind.keep_clear_of(agent, states, motion)
    return states


class Kind:
    """The agents of one roadmap: which of its moves are still free at each step."""

    def __init__(self, roadmap: Roadmap, mission: Mission) -> None:
        self.roadmap, self.mission = roadmap, mission
        states = States(roadmap.position, roadmap.velocity)
        by_target = np.lexsort((roadmap.moves[:, 0], roadmap.moves[:, 1]))
        self.source, self.target = roadmap.moves[by_target].T
        self.free = roadmap.allowed[:, by_target]
        dynamics = mission.agents[roadmap.agents[0]].dynamics
        self.moves = motion_of(dynamics, states.take(self.source), states.take(self.target), mission.step)
        self.middle, self.reach = _disc(*self.moves, mission.step)
        self.length = np.linalg.norm(roadmap.position[self.target] - roadmap.position[self.source], axis=-1)

    def keep_clear_of(self, agent: int, states: Indices, motion: Motion) -> None:
        """No move is free any more that comes too near the agent, who moves as ``states`` say."""
        track = kinematics(states[agent : agent + 1], np.array([agent]), motion, self.mission)
        position, velocity, acceleration = (each[0] for each in track)
        least = float(needed(np.array([self.roadmap.agents[0]]), np.array([agent]), self.mission)[0])
        middle, reach = _disc(position, velocity, acceleration, self.mission.step)
        apart = np.linalg.norm(self.middle - middle[:, None], axis=-1)
        step, move = np.nonzero((apart < self.reach + reach[:, None] + least) & self.free)
        mine, its_velocity, its_acceleration = self.moves
        nearest = closest_approach(
            mine[move],
            its_velocity[move],
            its_acceleration[move],
            position[step],
            velocity[step],
            acceleration[step],
            self.mission.step,
        )
        near = nearest < least
        self.free[step[near], move[near]] = False

    def shortest(self, ways: Flags) -> Indices | None:
        """The shortest way, (steps + 1,), over states that are open, (steps + 1, states), and moves that are free."""
        steps, count = len(self.free), len(self.roadmap.position)
        begins = np.flatnonzero(np.diff(self.target, prepend=-1))
        sizes = np.diff(np.append(begins, len(self.target)))
        cost = np.where(ways[0], 0.0, np.inf)
        came_from = np.zeros((steps, count), dtype=np.int64)
        for step in range(steps):
            total = np.where(self.free[step] & ways[step + 1, self.target], cost[self.source] + self.length, np.inf)
            least = np.minimum.reduceat(total, begins)
            best = np.flatnonzero(total == np.repeat(least, sizes))
            cost = np.full(count, np.inf)
            cost[self.target[begins]] = least
            came_from[step, self.target[best]] = self.source[best]
        if not np.isfinite(cost).any():
            return None
        way = np.empty(steps + 1, dtype=np.int64)
        way[-1] = int(np.argmin(cost))
        for step in range(steps - 1, -1, -1):
            way[step] = came_from[step, way[step + 1]]
        return way


def _disc(position: Array, velocity: Array, acceleration: Array, step: float) -> tuple[Array, Array]:
    """Centres and radii of discs that hold motions of one step: (..., dim) each -> (..., dim) and (...)."""
    middle = position + velocity * (step / 2) + acceleration * (step**2 / 8)
    reach = np.linalg.norm(velocity, axis=-1) * (step / 2) + np.linalg.norm(acceleration, axis=-1) * (step**2 / 2)
    return middle, reach
