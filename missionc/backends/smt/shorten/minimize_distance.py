"""``minimize distance``: bounds on the metres that all agents travel together, closed in by SAT questions.

What each agent must travel whatever the others do is worked out (``cost_to_go``),
and only what a plan travels beyond that, its excess, is counted by clauses. It
is counted in units and rounded down, so that what is shown to be impossible is
impossible. How long a plan is, is measured and not counted.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from missionc.backends.api import Progress
from missionc.backends.smt.encode.clauses import TooLarge
from missionc.backends.smt.encode.lower_motion import Motion
from missionc.backends.smt.refine.conflict_limit import effort
from missionc.backends.smt.refine.lazy_constraints import JointMotion, LazyConstraints
from missionc.backends.smt.roadmap.roadmap import Indices
from missionc.backends.smt.sat.solve import Stopped, Unsatisfiable
from missionc.backends.smt.settings import smt_settings
from missionc.backends.smt.shorten.cost_to_go import CostToGo, cost_to_go, disjunctive_tasks, single_agent_tasks
from missionc.backends.smt.shorten.held_goals import Goals
from missionc.backends.smt.shorten.unary_totalizer import add_totalizer
from missionc.base.trace import Array
from missionc.geometry.dynamics import States, motion_of
from missionc.geometry.vectors import norm
from missionc.ir import Mission


def shorten_distance(
    plan: JointMotion,
    goals: Goals,
    required: tuple[int, ...],
    search: LazyConstraints,
    with_shorter_paths: Callable[[JointMotion], JointMotion],
    enough: Callable[[float], float],
) -> JointMotion:
    """Asks for a shorter plan until there is none, or it takes too much.

    Args:
        required: the literals of the goals.
        with_shorter_paths: a plan that is as good or better, near the one it is given.
        enough: as of a ``Budget``.
    """
    distance_search = DistanceSearch(goals, required, search, with_shorter_paths, plan)
    distance_search.bound = max(distance_search.bound, enough(distance_search.best))
    try:
        settings = smt_settings(search.mission).shortening
        for parts in (settings.units, settings.fine_units):
            if not distance_search.over and not distance_search.in_parts(parts):
                break
    except TooLarge:
        search.account.notes.append("too many clauses to look for a shorter plan")
    what = f"{distance_search.best:.6g} m in all"
    if not search.proves:
        search.account.notes.append(f"{what}, the least that was found on this roadmap")
    elif distance_search.over:
        search.account.notes.append(f"{what}, the least on this roadmap")
    else:
        gap = 1 - distance_search.bound / distance_search.best
        search.account.notes.append(
            f"{what}; no plan on this roadmap is shorter than {distance_search.bound:.6g} m (a gap of {gap:.1%})"
        )
    return distance_search.found


@dataclass(slots=True)
class DistanceSearch:
    """The search for the shortest plan: the best found, its metres, and a lower bound on those of any."""

    goals: Goals
    kept: tuple[int, ...]
    search: LazyConstraints
    with_shorter_paths: Callable[[JointMotion], JointMotion]
    found: JointMotion
    best: float = field(init=False)
    bound: float = field(init=False)
    alone: list[CostToGo] = field(init=False)
    """What each agent must travel by itself, and the metres of all together: ``floor``."""
    floor: float = field(init=False)
    metres: list[Array] = field(init=False)

    def __post_init__(self) -> None:
        motion, mission = self.goals.motion, self.goals.mission
        self.metres = [move_lengths(mission, motion, number) for number in range(len(motion.roadmaps))]
        self.best = self.travelled(self.found)
        known = single_agent_tasks(self.goals)
        self.alone = [
            cost_to_go(self.goals, agent, task, self.metres[motion.roadmap_of[agent]])
            for agent, task in enumerate(known)
        ]
        self.floor = sum(each.least for each in self.alone)
        self.bound = self.floor
        for options in disjunctive_tasks(self.goals):
            more = [
                cost_to_go(self.goals, agent, known[agent].and_also(task), self.metres[motion.roadmap_of[agent]]).least
                - self.alone[agent].least
                for agent, task in options
            ]
            self.bound = max(self.bound, self.floor + min(more))

    @property
    def over(self) -> bool:
        """Whether there is no shorter plan."""
        same = 1e-6  # metres: so little makes no plan shorter.
        return self.best - self.bound < same

    def in_parts(self, parts: int) -> bool:
        """Searches with the excess of the plan at hand in so many units; whether every question was answered."""
        search = self.search
        unit = (self.best - self.floor) / parts
        excess = add_totalizer(search.clauses, self.goals.motion, self.alone, self.metres, unit, parts)
        fewest, most = 0, parts
        while fewest < most and not self.over:
            hopeful = max(fewest, min(int((self.bound - self.floor) / unit), most - 1))
            target = most - max(1, (most - hopeful) // 3)
            search.listen(Progress("improve", search.rounds, f"{self.best:.4g} m, at least {self.bound:.4g} m"))
            result = search.find((*self.kept, -int(excess[target])), effort=effort(search.mission, search.clauses))
            match result:
                case JointMotion():
                    shorter = self.with_shorter_paths(result)
                    if self.travelled(shorter) < self.best:
                        self.found, self.best = shorter, self.travelled(shorter)
                    most = min(target, int((self.best - self.floor) / unit))
                case Unsatisfiable():
                    fewest = target + 1
                    self.bound = max(self.bound, self.floor + fewest * unit)
                case Stopped():
                    return False
        return True

    def travelled(self, plan: JointMotion) -> float:
        """Metres of all agents."""
        motion = self.goals.motion
        rows = enumerate(plan.states)
        return float(
            sum(self.metres[motion.roadmap_of[agent]][_taken(row, motion, agent)].sum() for agent, row in rows)
        )


def move_lengths(mission: Mission, motion: Motion, number: int) -> Array:
    """The length of each move of a roadmap: (moves,), metres."""
    roadmap = motion.roadmaps[number]
    states = States(roadmap.position, roadmap.velocity)
    source, target = roadmap.moves.T
    dynamics = mission.agents[roadmap.agents[0]].dynamics
    return travelled(motion_of(dynamics, states.take(source), states.take(target), mission.step), mission.step)


def travelled(motions: tuple[Array, Array, Array], step: float) -> Array:
    """The length of motions of one step, metres: position, velocity and acceleration, (motions, dim) -> (motions,)."""
    chords = 16  # a curved move is as long as so many straight pieces between its points.
    position, velocity, acceleration = motions
    moment = np.linspace(0.0, step, chords + 1)[:, None, None]
    points = position + velocity * moment + acceleration * (0.5 * moment**2)
    return np.asarray(norm(np.diff(points, axis=0)).sum(axis=0))


def _taken(row: Indices, motion: Motion, agent: int) -> Indices:
    """The numbers of the moves between an agent's states, (steps + 1,): (steps,)."""
    roadmap = motion.roadmap(agent)
    count = len(roadmap.position)
    keys = roadmap.moves[:, 0] * count + roadmap.moves[:, 1]
    return np.searchsorted(keys, row[:-1] * count + row[1:])
