"""Reservations of fixed trajectories: agents that are settled, and the moves that are left free to the others.

Whom nobody needs takes the way along its roadmap, by the clock, that is shortest
among those that keep clear of all before it.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from copy import copy
from dataclasses import replace

import numpy as np

from missionc.backends.smt.encode.lower_motion import Motion
from missionc.backends.smt.refine.collisions import kinematics, needed
from missionc.backends.smt.roadmap.roadmap import Indices, Roadmap
from missionc.base.trace import Array, Flags
from missionc.ir import Mission
from missionc.world.dynamics import States, motion_of
from missionc.world.relative_motion import closest_approach

PUSH = 10.0
"""To come too near one who can be moved counts as so many of the longest moves."""


class Reservations:
    """Reserved trajectories: a joint motion of some agents, in the order in which they were settled.

    ``states``, (agents, steps + 1), says what they do; of the others it says
    nothing. Those in ``alone`` were settled one by one and may be moved so again.
    """

    def __init__(self, motion: Motion, mission: Mission) -> None:
        self.motion, self.mission = motion, mission
        self.agents: list[int] = []
        self.alone: set[int] = set()
        self.states = np.zeros((motion.agents, motion.steps + 1), dtype=np.int64)
        self.moved = np.zeros(motion.agents, dtype=np.int64)
        """How often each has had to make way, (agents,)."""
        self._tables = [ReservationTable(roadmap, mission) for roadmap in motion.roadmaps]

    def reserve(self, agents: Iterable[int], states: Indices, *, alone: bool = False) -> None:
        """These agents do what ``states``, (agents of the mission, steps + 1), say; all others keep clear of them."""
        for agent in agents:
            self.agents.append(agent)
            self.states[agent] = states[agent]
            if alone:
                self.alone.add(agent)
            for kind in self._tables:
                kind.keep_clear_of(agent, self.states, self.motion, float(1 + self.moved[agent]) if alone else np.inf)

    def release(self, agents: Iterable[int]) -> None:
        """The reservations of these agents count no more."""
        for agent in agents:
            self.agents.remove(agent)
            self.alone.discard(agent)
            for kind in self._tables:
                kind.release(agent)

    def copy(self) -> Reservations:
        other = Reservations(self.motion, self.mission)
        other.agents, other.alone = list(self.agents), set(self.alone)
        other.states, other.moved = self.states.copy(), self.moved.copy()
        other._tables = [kind.copy() for kind in self._tables]
        return other

    def in_the_way(self, agent: int, way: Indices) -> list[int]:
        """The agents that come too near the agent on this way, (steps + 1,)."""
        return self._tables[int(self.motion.roadmap_of[agent])].in_the_way(way)

    def with_bystanders(self, ways: tuple[Flags, ...]) -> Reservations | int:
        """All agents: who is not settled takes the shortest way; or the first agent that finds none.

        Args:
            ways: for each agent where it may be, (steps + 1, states).
        """
        everyone = self.copy()
        for agent in range(self.motion.agents):
            if agent not in self.agents:
                way = everyone.shortest(agent, ways[agent])
                if way is None:
                    return agent
                everyone.reserve((agent,), np.broadcast_to(way, self.states.shape))
        return everyone

    def shortest(
        self, agent: int, ways: Flags, errands: Sequence[Flags] = (), *, pushing: bool = False
    ) -> Indices | None:
        """The agent's shortest way clear of all others, as ``ReservationTable.shortest`` finds it."""
        return self._tables[int(self.motion.roadmap_of[agent])].shortest(ways, errands, pushing=pushing)

    def each_alone(self, ways: tuple[Flags, ...]) -> Indices | None:
        """The shortest way of each agent, (agents, steps + 1), as if it were the only one; None where one has none."""
        paths: dict[tuple[int, bytes], Indices | None] = {}
        states = self.states.copy()
        for agent, number in enumerate(self.motion.roadmap_of.tolist()):
            key = number, ways[agent].tobytes()
            if key not in paths:
                paths[key] = ReservationTable(self.motion.roadmaps[number], self.mission).shortest(ways[agent])
            way = paths[key]
            if way is None:
                return None
            states[agent] = way
        return states

    def fixed(self, ways: tuple[Flags, ...]) -> tuple[Flags, ...]:
        """The ways of all agents, (steps + 1, states) each, with those who are settled where they are."""
        fixed = list(ways)
        for agent in self.agents:
            fixed[agent] = np.zeros_like(ways[agent])
            fixed[agent][np.arange(len(ways[agent])), self.states[agent]] = True
        return tuple(fixed)

    def open_roadmaps(self) -> tuple[Roadmap, ...]:
        """The roadmaps with only those moves allowed that keep clear of all who are settled."""
        return tuple(kind.open_roadmap() for kind in self._tables)


class ReservationTable:
    """The reservation table of one roadmap: the moves that are still free at each step."""

    def __init__(self, roadmap: Roadmap, mission: Mission) -> None:
        self.roadmap, self.mission = roadmap, mission
        states = States(roadmap.position, roadmap.velocity)
        self.by_target = np.lexsort((roadmap.moves[:, 0], roadmap.moves[:, 1]))
        self.source, self.target = roadmap.moves[self.by_target].T
        self.allowed = roadmap.allowed[:, self.by_target]
        self.price = np.where(self.allowed, 0.0, np.inf)
        """The price of each move, (steps, moves): what those it comes too near weigh; 0 where it is free."""
        self.near: dict[int, tuple[Indices, Indices, float]] = {}
        """The steps and moves that come too near each settled agent, and what it weighs."""
        dynamics = mission.agents[roadmap.agents[0]].dynamics
        self.moves = motion_of(dynamics, states.take(self.source), states.take(self.target), mission.step)
        self.middle, self.reach = _disc(*self.moves, mission.step)
        self.length = np.linalg.norm(roadmap.position[self.target] - roadmap.position[self.source], axis=-1)

    def copy(self) -> ReservationTable:
        other = copy(self)
        other.price, other.near = self.price.copy(), dict(self.near)
        return other

    def keep_clear_of(self, agent: int, states: Indices, motion: Motion, weight: float) -> None:
        """No move is free any more that comes too near the agent, who moves as ``states``, (agents, steps + 1), say."""
        track = kinematics(states[agent : agent + 1], np.array([agent]), motion, self.mission)
        position, velocity, acceleration = (each[0] for each in track)
        least = float(needed(np.array([self.roadmap.agents[0]]), np.array([agent]), self.mission)[0])
        middle, reach = _disc(position, velocity, acceleration, self.mission.step)
        apart = np.linalg.norm(self.middle - middle[:, None], axis=-1)
        step, move = np.nonzero((apart < self.reach + reach[:, None] + least) & self.allowed)
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
        step, move = step[nearest < least], move[nearest < least]
        self.near[agent] = step, move, weight
        self.price[step, move] += weight

    def release(self, agent: int) -> None:
        step, move, _ = self.near.pop(agent)
        self.price[step, move] = 0.0
        touched = np.zeros_like(self.allowed)
        touched[step, move] = True
        for step, move, weight in self.near.values():
            shared = touched[step, move]
            self.price[step[shared], move[shared]] += weight

    def in_the_way(self, way: Indices) -> list[int]:
        """The agents that the moves of this way, (steps + 1,), come too near."""
        made = (self.source == way[:-1, None]) & (self.target == way[1:, None])
        return [agent for agent, (step, move, _) in self.near.items() if made[step, move].any()]

    def open_roadmap(self) -> Roadmap:
        allowed = np.empty_like(self.allowed)
        allowed[:, self.by_target] = self.price == 0
        return replace(self.roadmap, allowed=allowed)

    def shortest(self, ways: Flags, errands: Sequence[Flags] = (), *, pushing: bool = False) -> Indices | None:
        """The shortest way, (steps + 1,), over states that are open and moves that are free; None if there is none.

        Args:
            ways: (steps + 1, states): where it may lead.
            errands: where it must have been once, each (steps + 1, states). A
                way is looked for in each state of which of them are done. Others
                may have to be there too: each step there counts as the longest move.
            pushing: moves that come too near some who can be moved are dear, not forbidden.
        """
        steps, count, done = len(self.allowed), len(self.roadmap.position), 1 << len(errands)
        longest = float(self.length.max(initial=0.0))
        doing = np.zeros(ways.shape, dtype=np.int64)  # the errands done by being there, as bits
        for number, errand in enumerate(errands):
            doing |= errand.astype(np.int64) << number
        toll = np.where(doing > 0, longest, 0.0)
        begins = np.flatnonzero(np.diff(self.target, prepend=-1))
        sizes = np.diff(np.append(begins, len(self.target)))
        states = np.arange(count)
        cost = np.full((done, count), np.inf)
        cost[doing[0, ways[0]], states[ways[0]]] = 0.0
        came_from = np.zeros((steps, done, count), dtype=np.int64)  # a state, and what was done there
        for step in range(steps):
            free = ways[step + 1, self.target] & (self.price[step] < (np.inf if pushing else 1.0))
            length = self.length + toll[step + 1, self.target] + PUSH * longest * self.price[step]
            after = np.full((done, count), np.inf)
            for before in range(done):
                total = np.where(free, cost[before, self.source] + length, np.inf)
                least = np.minimum.reduceat(total, begins)
                best = np.flatnonzero((total == np.repeat(least, sizes)) & np.isfinite(total))
                target = self.target[best]
                now = doing[step + 1, target] | before
                better = total[best] < after[now, target]
                best, target, now = best[better], target[better], now[better]
                after[now, target] = total[best]
                came_from[step, now, target] = self.source[best] * done + before
            cost = after
        if not np.isfinite(cost[-1]).any():
            return None
        way = np.empty(steps + 1, dtype=np.int64)
        way[-1], at = int(np.argmin(cost[-1])), done - 1
        for step in range(steps - 1, -1, -1):
            way[step], at = divmod(int(came_from[step, at, way[step + 1]]), done)
        return way


def _disc(position: Array, velocity: Array, acceleration: Array, step: float) -> tuple[Array, Array]:
    """Centres and radii of discs that hold motions of one step: (..., dim) each -> (..., dim) and (...)."""
    middle = position + velocity * (step / 2) + acceleration * (step**2 / 8)
    reach = np.linalg.norm(velocity, axis=-1) * (step / 2) + np.linalg.norm(acceleration, axis=-1) * (step**2 / 2)
    return middle, reach
