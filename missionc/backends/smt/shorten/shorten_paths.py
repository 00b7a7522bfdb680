"""Local search that replaces one agent's path at a time by a shorter one, with every goal satisfied.

Models of the clauses are not tidy: an agent without a task moves at random. The states and steps on which the goals
depend are preserved (``slack``). Within these, and clear of all others, an agent takes the shortest path on the
time-expanded roadmap.

Unlike ``label_setting``, this search reads no formulas and has no reservations. It is one dense pass over all states of
all steps, since the slack already limits the states. Conflicts with other agents are found lazily.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable

import numpy as np

from missionc.backends.smt.encode.lower import deep
from missionc.backends.smt.encode.lower_motion import Motion
from missionc.backends.smt.refine.lazy_constraints import each_step, kinematics, metric, needed
from missionc.backends.smt.roadmap.labels import Labels
from missionc.backends.smt.settings import smt_settings
from missionc.backends.smt.shorten.slack import EvaluatedMotion, Goals, slack
from missionc.base.trace import Flags, Indices
from missionc.geometry.relative_motion import closest_approach
from missionc.ir import Mission
from missionc.ir.kernel.analysis import remembering
from missionc.ir.kernel.nodes import Node


class TimeExpandedRoadmap:
    """Time-expanded roadmap: the moves of one roadmap at each step, sorted by target.

    ``cost``, (steps, moves), is their length in metres plus a small, increasing cost for not waiting. Of equally long
    paths, the path with the fewest motions is selected, then the earliest.
    """

    def __init__(self, mission: Mission, motion: Motion, number: int) -> None:
        motion_cost = 1e-6  # metres added to each step in motion, up to twice as much for later steps
        roadmap = motion.roadmaps[number]
        order = np.lexsort((roadmap.moves[:, 0], roadmap.moves[:, 1]))
        self.source, self.target = roadmap.moves[order].T
        self.allowed = roadmap.allowed[:, order]
        self.moves = roadmap.motions(mission).take(order)
        self.length = self.moves.lengths(mission.step)
        restless = motion_cost * (1 + np.arange(motion.steps) / (1 + motion.steps))
        self.cost = self.length + restless[:, None] * (self.source != self.target)
        self._count = len(roadmap.position)
        self._into = np.searchsorted(self.target, np.arange(self._count + 1))
        self._reached = np.flatnonzero(np.diff(self._into))
        self._begins = self._into[self._reached]

    def taken(self, way: Indices) -> Indices:
        """Moves of a path, from its states: (steps + 1,) -> (steps,)."""
        return np.searchsorted(self.target * self._count + self.source, way[1:] * self._count + way[:-1])

    def cost_of(self, way: Indices) -> float:
        return float(self.cost[np.arange(len(way) - 1), self.taken(way)].sum())

    def shortest(self, room: Flags, free: Flags) -> Indices | None:
        """Path of least cost, states (steps + 1,); None without a path.

        Args:
            room: (steps + 1, states), True for allowed states.
            free: (steps, moves), True for allowed moves.
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
    """Conflict-free paths of all agents, states (agents, steps + 1), and the search for shorter paths."""

    def __init__(self, states: Indices, motion: Motion, mission: Mission) -> None:
        self.states, self.motion, self.mission = states.copy(), motion, mission
        everyone = np.arange(motion.agents)
        self.expanded = [TimeExpandedRoadmap(mission, motion, number) for number in range(len(motion.roadmaps))]
        self.tracks = kinematics(self.states, everyone, motion, mission)
        pairs = [(np.full(motion.agents, agent), everyone, mission) for agent in everyone.tolist()]
        self.apart, self.metric = [needed(*pair) for pair in pairs], [each_step(metric(*pair)) for pair in pairs]

    def cost(self, agent: int) -> float:
        """Cost of the agent's current path, metres."""
        expanded = self.expanded_of(agent)
        return expanded.cost_of(self.states[agent])

    def expanded_of(self, agent: int) -> TimeExpandedRoadmap:
        return self.expanded[int(self.motion.roadmap_of[agent])]

    def shorter_path(self, agent: int, room: Flags, still_from: int, gain: float) -> Indices | None:
        """Best path of an agent, states (steps + 1,), that is cheaper than the current path by more than ``gain`` and
        has no conflict; None without such a path.

        Conflicting moves are blocked lazily: a result before all are blocked costs at most as much as afterwards.

        Args:
            room: (steps + 1, states), True for allowed states.
            still_from: step from which on the agent does not move.
            gain: metres.
        """
        expanded, least, factors = self.expanded_of(agent), self.apart[agent], self.metric[agent]
        free = expanded.allowed.copy()
        free[still_from:, expanded.source != expanded.target] = False
        enough = self.cost(agent) - gain
        while (way := expanded.shortest(room, free)) is not None:
            taken = expanded.taken(way)
            if expanded.cost_of(way) >= enough:
                return None
            nearest = closest_approach(expanded.moves.take(taken), self.tracks, self.mission.step, factors)
            nearest[agent] = np.inf
            met, step = np.nonzero(nearest < least[:, None])
            if not met.size:
                return way
            theirs = self.tracks.take(met[:, None], step[:, None])
            others = None if factors is None else factors[met]
            clear = closest_approach(expanded.moves, theirs, self.mission.step, others) >= least[met][:, None]
            for moment, moves in zip(step.tolist(), clear, strict=True):
                free[moment] &= moves
        return None

    def take(self, agent: int, way: Indices) -> None:
        """Replace the agent's path by ``way``, states (steps + 1,)."""
        self.states[agent] = way
        own = kinematics(way[None], np.array([agent]), self.motion, self.mission)
        self.tracks.put(agent, own.take(0))


def shorten_paths(
    states: Indices,
    agents: Iterable[int],
    formulas: Iterable[Node],
    motion: Motion,
    mission: Mission,
    still_from: int | None = None,
) -> Indices:
    """Joint motion, (agents, steps + 1), with shorter or equal paths of some of the agents.

    The result satisfies the same formulas, and collision freedom is preserved. Agents with formulas about the past keep
    their paths, since each step affects later steps. An agent is tried again only after another path has changed.

    Args:
        still_from: step from which on agents with a new path do not move; None for no such step.
    """
    settings = smt_settings(mission).shortening
    gain = 1e-6  # a smaller saving, in metres, does not replace a path
    formulas = tuple(formulas)
    everyone = sorted(set(agents) - remembering(formulas))
    if motion.steps == 0 or not everyone:
        return states
    goals = Goals(formulas, mission, motion, Labels(mission, motion.roadmaps))
    evaluated = EvaluatedMotion.of(goals, states)
    if not evaluated.good:
        return states
    paths = JointPaths(states, motion, mission)
    still_from = motion.steps if still_from is None else still_from
    waiting = deque(everyone)
    left = settings.rounds * len(waiting)
    while waiting and left and goals.work < settings.work:
        left -= 1
        agent = waiting.popleft()
        before = paths.states[agent].copy()
        with deep():
            room = slack(goals, agent, evaluated)
        way = paths.shorter_path(agent, room, still_from, gain)
        if way is None:
            continue
        paths.take(agent, way)
        after = EvaluatedMotion.of(goals, paths.states)
        if not after.good:
            paths.take(agent, before)
            continue
        evaluated = after
        waiting.extend(other for other in everyone if other != agent and other not in waiting)
    return paths.states
