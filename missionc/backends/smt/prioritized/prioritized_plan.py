"""Plan by prioritized planning, and its improvement: preferences by weight, then the objective.

    in   roadmaps, the mission's goals
    out  a trace that satisfies every requirement, or requirements in conflict on these roadmaps, or nothing

A better plan is searched from the beginning with additional requirements, or one agent at a time. Bounds are known only
for single agents, not for the whole team.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from missionc.backends.api import Planned, Progress
from missionc.backends.run_account import MOVE_STEP
from missionc.backends.smt.prioritized.prioritized_planning import PrioritizedPlanner
from missionc.backends.smt.refine.problem import Setting
from missionc.backends.smt.roadmap.roadmap import Roadmap
from missionc.backends.smt.sat.solve import Solvers
from missionc.backends.smt.sat.solver_process import is_over
from missionc.backends.smt.settings import smt_settings
from missionc.backends.smt.shorten.improve import duration, rests_from
from missionc.base.trace import Indices, Trace
from missionc.ir import Objective
from missionc.ir.kernel.nodes import Kernel
from missionc.planning.progression.residuals import TooComplex


@dataclass(slots=True, eq=False)
class ShorterMakespan:
    """Search for a joint motion of shorter duration than a given motion.

    Args:
        planner_of: function from roadmaps and a work limit to a prioritized planner of the requirements.
        states: best motion found, (agents, steps + 1); ``planner`` found it.
    """

    setting: Setting
    planner_of: Callable[[tuple[Roadmap, ...], float], PrioritizedPlanner]
    roadmaps: tuple[Roadmap, ...]
    states: Indices
    planner: PrioritizedPlanner
    most: float = math.inf
    """Work limit on the run's account."""
    _planners: dict[int, PrioritizedPlanner] = field(default_factory=dict)

    @property
    def affordable(self) -> bool:
        """True if work and time are left."""
        setting = self.setting
        return setting.account.work < self.most and not is_over(setting.budget.deadline)

    @property
    def best(self) -> int:
        """Duration of the best motion: number of steps after which no agent moves."""
        return duration(self.states)

    def find(self) -> None:
        """Shorten the motion as far as possible, and record the known bounds."""
        settings = smt_settings(self.setting.mission).work
        account = self.setting.account
        made, before = account.work, self.best
        least = self.least(int(self.setting.budget.lower_bound(self.best)))
        self.most = account.work + max(settings.makespan, settings.makespan_share * made)
        self.descend(least)
        if self.affordable and self.best > least and self.attempt(self.best - 1, anew=True):
            self.descend(least)
        duration = f"duration {self.best} steps" + (f" (first plan: {before})" if self.best < before else "")
        fewest = self.best == least
        known = "optimal on this roadmap" if fewest else f"lower bound {least} on this roadmap"
        account.notes.append(f"{duration}, {known}")

    def descend(self, least: int) -> None:
        """Reduce the duration in strides that double after success, and are halved after failure."""
        vain, stride = least - 1, max(1, (self.best - least) // smt_settings(self.setting.mission).prioritized.strides)
        while self.affordable and self.best - vain > 1:
            target = max(self.best - stride, vain + 1)
            if self.attempt(target):
                stride *= 2
            else:
                vain, stride = target, max(1, (self.best - target) // 2)

    def attempt(self, steps: int, *, anew: bool = False) -> bool:
        """Search for a joint motion that ends after ``steps`` steps; if found, it becomes the best motion. Return true
        if found.

        Args:
            anew: True to plan all agents from scratch; False to preserve the paths of agents that are in time unless
                pushed.
        """
        settings = smt_settings(self.setting.mission).prioritized
        self.setting.budget.on_progress(Progress("improve", 0, f"{self.best} steps so far, trying {steps}"))
        late = frozenset(np.flatnonzero(rests_from(self.states) > steps).tolist())
        planner = self.planner_of(self.still(steps), self.most)
        planner.failures = settings.failures - settings.makespan_failures
        planner.together = not anew
        found = planner.plan(late) if anew else planner.plan_again(self.states, late, self.planner.by_solver)
        if found is None:
            return False
        self.states, self.planner = found, planner
        return True

    def still(self, steps: int) -> tuple[Roadmap, ...]:
        """Roadmaps without moves other than waiting after ``steps`` steps."""

        def still(roadmap: Roadmap) -> Roadmap:
            allowed = roadmap.allowed.copy()
            allowed[steps:, np.not_equal(*roadmap.moves.T)] = False
            return replace(roadmap, allowed=allowed)

        return tuple(map(still, self.roadmaps))

    def least(self, least: int) -> int:
        """Lower bound of the number of steps from single agents, at least ``least``."""
        own = rests_from(self.states)
        self.most = self.setting.account.work + smt_settings(self.setting.mission).work.makespan
        for agent in sorted(self.planner.everyone, key=lambda agent: (-int(own[agent]), agent)):
            if own[agent] <= least or not self.affordable or self.able(agent, least):
                continue
            low, high = least + 1, int(own[agent])
            while low < high and self.affordable:
                middle = (low + high) // 2
                low, high = (low, middle) if self.able(agent, middle) else (middle + 1, high)
            least = low
        return least

    def able(self, agent: int, steps: int) -> bool:
        """Return true if the agent alone may have a path that ends after ``steps`` steps."""
        if steps not in self._planners:
            self._planners[steps] = self.planner_of(self.still(steps), self.most)
        planner = self._planners[steps]
        search, before = planner.single_agent, planner.single_agent.work
        try:
            with suppress(TooComplex):
                return search.alone(agent, planner.own_parts(agent), shortest=False) is not None
            return True
        finally:
            self.setting.account.work += MOVE_STEP * (search.work - before)


def shorter(planner: PrioritizedPlanner, states: Indices) -> Indices:
    """Joint motion after replanning agents that were planned alone, one by one, for length only."""
    settings = smt_settings(planner.setting.mission).prioritized
    gain = 1e-6  # least saving of a new path, metres
    reservations = planner.reservations.emptied()
    everyone = sorted(planner.everyone)
    reservations.reserve(everyone, states)
    search = planner.search(haste=0.0)
    for number, agent in ((number, agent) for number in range(settings.shorter_rounds) for agent in everyone):
        if number and search.work > settings.shorter_work:
            break
        named = [part for part in planner.requirements.parts if agent in part.named]
        if any(len(part.named) > 1 for part in named) or search.work > planner.enough:
            continue
        reservations.release((agent,))
        changed = reservations.states.copy()
        metres = search.metres(agent, changed[agent])
        way = search.way(agent, planner.own_parts(agent), reservations, most=metres)
        if way is not None and search.metres(agent, way) < metres - gain:
            changed[agent] = way
        reservations.reserve((agent,), changed)
    better = reservations.states
    return better if planner.failing(planner.trace(better)) is None else states


def metres_alone(planner: PrioritizedPlanner) -> float | None:
    """Sum of the least path lengths of each agent alone, metres; None if unknown."""
    metres = 0.0
    search = planner.search(haste=0.0)
    for agent in sorted(planner.everyone):
        try:
            way = search.alone(agent, planner.own_parts(agent))
        except TooComplex:
            return None
        if way is None:
            return None
        metres += search.metres(agent, way)
    return metres


def path_length(planner: PrioritizedPlanner, states: Indices) -> float:
    """Total path length of all agents, metres, for roadmap states (agents, steps + 1)."""
    return sum(planner.single_agent.metres(agent, way) for agent, way in enumerate(states))


@dataclass(slots=True, eq=False)
class PrioritizedPlan:
    """Prioritized planning of a whole mission.

    Args:
        first: work limit on the run's account until there is a plan; ``most``: work limit afterwards.
        refused: requirements in conflict, if these roadmaps are known to contain no plan.
        planner: the last planner that found a plan, or the first planner tried.
    """

    setting: Setting
    kernel: Kernel
    roadmaps: tuple[Roadmap, ...]
    solvers: Solvers
    first: float = math.inf
    most: float = math.inf
    refused: tuple[str, ...] | None = None
    planner: PrioritizedPlanner | None = None

    def find(self) -> Trace | None:
        """Best plan found within the limits; None if none is found.

        Raises:
            TooLarge: the clauses would exceed their limit.
            Unexpressible: a predicate depends on too many agents at once.
        """
        mission, account = self.setting.mission, self.setting.account
        required = replace(self.kernel, preferences=())
        better = bool(self.kernel.preferences) or mission.objective is not Objective.NONE
        planner, states = self.first_of(required, choosing=not better)
        self.planner = planner
        if states is None:
            self.refused = planner.refused
            return None
        if better:
            self.setting.budget.on_incumbent(Planned(planner.trace(states), account.report()))
        for goal in sorted(self.kernel.preferences, key=lambda goal: -(goal.weight or 0.0)):
            self.setting.budget.on_progress(Progress("prefer", self.planner.rounds, f"`{goal.name}`"))
            more = replace(required, requirements=(*required.requirements, goal))
            found = self.again(more, self.roadmaps)
            if found is None:
                account.notes.append(f"preference `{goal.name}` not satisfied: the search ended early")
            else:
                states, required = found, more
                account.notes.append(f"preference `{goal.name}` satisfied")
        if mission.objective is Objective.DURATION:
            states = self.sooner(states, required)
        elif mission.objective is Objective.DISTANCE:
            with account.stage("calm"):
                states = self.shorter(states)
        return self.planner.trace(states)

    def first_of(self, required: Kernel, *, choosing: bool) -> tuple[PrioritizedPlanner, Indices | None]:
        """Last planner tried, with its joint motion, (agents, steps + 1), or None if it found none.

        Args:
            choosing: True to select steps for precedences; then there is no bound on the quality of plans.
        """
        shares = (0.0, 0.5, 1.0) if choosing else (None,)  # share of the remaining window for the awaited goal
        for later in shares:
            planner = self.planner_of(required, self.roadmaps, self.first, later)
            states = planner.plan()
            if states is not None or not planner.chosen or not self.affordable:
                break
        return planner, states

    @property
    def affordable(self) -> bool:
        """True if work for a search without a plan, and time, are left."""
        return self.setting.account.work < self.first and not is_over(self.setting.budget.deadline)

    def planner_of(
        self, required: Kernel, roadmaps: tuple[Roadmap, ...], most: float | None = None, later: float | None = None
    ) -> PrioritizedPlanner:
        most = self.most if most is None else most
        return PrioritizedPlanner(self.setting, required, roadmaps, self.solvers, most, later)

    def again(self, required: Kernel, roadmaps: tuple[Roadmap, ...]) -> Indices | None:
        """Joint motion, (agents, steps + 1), for other requirements or roadmaps; None if not found."""
        planner = self.planner_of(required, roadmaps)
        states = planner.plan()
        if states is not None:
            self.planner = planner
        return states

    def sooner(self, states: Indices, required: Kernel) -> Indices:
        """Joint motion of at most the duration of ``states``, as short as the search finds; the duration is recorded as
        a note."""
        assert self.planner is not None
        planner_of = partial(self.planner_of, required)
        search = ShorterMakespan(self.setting, planner_of, self.roadmaps, states, self.planner)
        search.find()
        self.planner = search.planner
        return search.states

    def shorter(self, states: Indices) -> Indices:
        """Joint motion of at most the total length of ``states``, as short as the search finds; the length is recorded
        as a note."""
        same = 1e-6  # metres
        assert self.planner is not None
        states = shorter(self.planner, states)
        metres, least = path_length(self.planner, states), metres_alone(self.planner)
        known = ""
        if least is not None and metres - least < same:
            known = ", optimal on this roadmap"
        elif least is not None:
            known = f", lower bound {least:.6g} m on this roadmap"
        self.setting.account.notes.append(f"distance {metres:.6g} m{known}")
        return states
