"""Anytime improvement of a plan: preferences by weight, then the objective, then paths without detours.

*Duration*: bisection between the shortest plan and the number of steps known to be insufficient.

*Distance*: SAT queries narrow the total length. Each agent has a least length independent of the others
(``cost_to_go``); clauses count only a plan's excess over these lengths. The excess is counted in units and rounded
down, so that refusals are valid. The length of a plan itself is measured exactly.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from missionc.backends.api import Progress, no_bound
from missionc.backends.smt.encode.clauses import FALSE, Clauses, Literals, TooLarge
from missionc.backends.smt.encode.lower import deep
from missionc.backends.smt.encode.lower_motion import Motion
from missionc.backends.smt.refine.lazy_constraints import JointMotion, LazyConstraints
from missionc.backends.smt.refine.problem import effort
from missionc.backends.smt.roadmap.labels import Labels
from missionc.backends.smt.sat.solve import Stopped, Unsatisfiable
from missionc.backends.smt.settings import smt_settings
from missionc.backends.smt.shorten.shorten_paths import shorten_paths
from missionc.backends.smt.shorten.slack import (
    CostToGo,
    Goals,
    add_totalizer,
    cost_to_go,
    disjunctive_tasks,
    single_agent_tasks,
)
from missionc.base.trace import Array, Indices
from missionc.ir import Objective
from missionc.ir.kernel.nodes import Kernel


def shorten_duration(
    plan: JointMotion, required: tuple[int, ...], search: LazyConstraints, enough: Callable[[float], float]
) -> JointMotion:
    """Plan of the shortest duration found, by bisection between the shortest plan and the lower bound.

    Args:
        enough: lower bound function, as ``Budget.lower_bound``.
    """
    best, stops = duration(plan.states), 0
    impossible = vain = int(enough(best)) - 1
    try:
        still = add_stillness(search.clauses, search.motion)
    except TooLarge:
        search.account.notes.append(f"duration {best} steps; too many clauses to search for fewer")
        return plan
    while best - vain > 1 and stops < smt_settings(search.mission).shortening.undecided:
        target = (best + vain) // 2
        search.listen(Progress("improve", search.rounds, f"{best} steps so far, trying {target}"))
        result = search.find((*required, *still[target:].tolist()), effort=effort(search.mission, search.clauses))
        match result:
            case JointMotion(states):
                plan, best = result, duration(states)
            case Unsatisfiable():
                impossible = vain = target
            case Stopped():
                vain, stops = target, stops + 1
    if not search.proves:
        known = ", the fewest found on this roadmap"
    elif best - impossible <= 1:
        known = ", optimal on this roadmap"
    else:
        known = f", lower bound {impossible + 1} on this roadmap" if impossible >= 0 else ""
        known += f"; {vain} steps not decided"
    search.account.notes.append(f"duration {best} steps{known}")
    return plan


def duration(states: Indices) -> int:
    """Number of steps after which no agent changes its state, from states (agents, steps + 1)."""
    return int(rests_from(states).max(initial=0))


def rests_from(states: Indices) -> Indices:
    """Number of steps after which each agent no longer changes its state: (agents, steps + 1) -> (agents,)."""
    changes = states[:, 1:] != states[:, :-1]
    last = changes.shape[1] - np.argmax(changes[:, ::-1], axis=1)
    return np.where(changes.any(axis=1), last, 0)


def add_stillness(clauses: Clauses, motion: Motion) -> Literals:
    """Literals, one per step (steps,), that imply that no agent changes its state from the step to the next.

    Raises:
        TooLarge: the clauses would exceed their limit.
    """
    still = clauses.fresh(motion.steps)
    for states in motion.states:
        step, state = np.nonzero(states[:-1] != FALSE)
        clauses.add(-still[step], -states[step, state], states[step + 1, state])
    return still


def shorten_distance(
    plan: JointMotion,
    goals: Goals,
    required: tuple[int, ...],
    search: LazyConstraints,
    with_shorter_paths: Callable[[JointMotion], JointMotion],
    enough: Callable[[float], float],
) -> JointMotion:
    """Plan of the shortest distance found, until no plan is shorter, or the effort is used up.

    Args:
        required: literals of the goals.
        with_shorter_paths: function to an equal or better plan near the given plan.
        enough: lower bound function, as ``Budget.lower_bound``.
    """
    distance_search = DistanceSearch(goals, required, search, with_shorter_paths, plan)
    distance_search.bound = max(distance_search.bound, enough(distance_search.best))
    try:
        settings = smt_settings(search.mission).shortening
        for parts in (settings.units, settings.fine_units):
            if not distance_search.over and not distance_search.in_parts(parts):
                break
    except TooLarge:
        search.account.notes.append("too many clauses to search for a shorter plan")
    what = f"distance {distance_search.best:.6g} m"
    if not search.proves:
        search.account.notes.append(f"{what}, the shortest found on this roadmap")
    elif distance_search.over:
        search.account.notes.append(f"{what}, optimal on this roadmap")
    else:
        gap = 1 - distance_search.bound / distance_search.best
        search.account.notes.append(
            f"{what}, lower bound {distance_search.bound:.6g} m on this roadmap, optimality gap {100 * gap:.3g} %"
        )
    return distance_search.found


@dataclass(slots=True)
class DistanceSearch:
    """Search for the shortest plan: the best plan found, its length, and a lower bound for all plans, metres."""

    goals: Goals
    kept: tuple[int, ...]
    search: LazyConstraints
    with_shorter_paths: Callable[[JointMotion], JointMotion]
    found: JointMotion
    best: float = field(init=False)
    bound: float = field(init=False)
    alone: list[CostToGo] = field(init=False)
    """Cost-to-go of each agent; ``floor`` is the sum of their least path lengths, metres."""
    floor: float = field(init=False)
    metres: list[Array] = field(init=False)

    def __post_init__(self) -> None:
        motion, mission = self.goals.motion, self.goals.mission
        self.metres = [roadmap.lengths(mission) for roadmap in motion.roadmaps]
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
        """True if no plan is shorter than the best plan found."""
        same = 1e-6  # metres: smaller savings do not count
        return self.best - self.bound < same

    def in_parts(self, parts: int) -> bool:
        """Search for shorter plans with the current plan's excess divided into ``parts`` units; return true if every
        query was answered."""
        search = self.search
        unit = (self.best - self.floor) / parts
        excess = add_totalizer(search.clauses, self.goals.motion, self.alone, self.metres, unit, parts)
        fewest, most = 0, parts
        while fewest < most and not self.over:
            hopeful = max(fewest, min(int((self.bound - self.floor) / unit), most - 1))
            target = most - max(1, (most - hopeful) // 3)
            search.listen(Progress("improve", search.rounds, f"{self.best:.4g} m, lower bound {self.bound:.4g} m"))
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
        """Total path length of all agents, metres."""
        motion = self.goals.motion
        return float(
            sum(
                self.metres[motion.roadmap_of[agent]][motion.roadmap(agent).moves_of(row)].sum()
                for agent, row in enumerate(plan.states)
            )
        )


def improve(
    plan: JointMotion,
    kernel: Kernel,
    literals: tuple[int, ...],
    search: LazyConstraints,
    enough: Callable[[float], float] = no_bound,
) -> JointMotion:
    """Plan improved by preferences and objective, or the given plan; results and undecided queries are recorded as
    notes.

    Args:
        literals: literals of each requirement, then of each preference.
        enough: lower bound function, as ``Budget.lower_bound``.
    """
    required = literals[: len(kernel.requirements)]
    formulas = [goal.formula for goal in kernel.requirements]
    wishes = zip(kernel.preferences, literals[len(required) :], strict=True)
    for goal, literal in sorted(wishes, key=lambda wish: -(wish[0].weight or 0.0)):
        search.listen(Progress("prefer", search.rounds, f"`{goal.name}`"))
        result = search.find((*required, literal), effort=effort(search.mission, search.clauses))
        match result:
            case JointMotion():
                plan, required = result, (*required, literal)
                formulas.append(goal.formula)
                search.account.notes.append(f"preference `{goal.name}` satisfied")
            case Unsatisfiable():
                why = "no plan on this roadmap satisfies it" if search.proves else "no plan that satisfies it was found"
                search.account.notes.append(f"preference `{goal.name}` not satisfied: {why}")
            case Stopped():
                search.account.notes.append(f"preference `{goal.name}` not satisfied: the search ended early")

    def with_shorter_paths(plan: JointMotion, still_from: int | None = None) -> JointMotion:
        with search.account.stage("calm"):
            agents = range(search.motion.agents)
            return JointMotion(shorten_paths(plan.states, agents, formulas, search.motion, search.mission, still_from))

    match search.mission.objective:
        case Objective.DISTANCE:
            labels = Labels(search.mission, search.motion.roadmaps)
            goals = Goals(tuple(formulas), search.mission, search.motion, labels)
            with deep():
                return shorten_distance(with_shorter_paths(plan), goals, required, search, with_shorter_paths, enough)
        case Objective.DURATION:
            plan = shorten_duration(plan, required, search, enough)
            return with_shorter_paths(plan, duration(plan.states))
        case _:
            return with_shorter_paths(plan)
