"""A plan by prioritized planning, and a better one: preferences by weight, then the objective.

    in   roadmaps, the mission's goals
    out  a trace in which every requirement holds, or the requirements that these roadmaps hold no plan for, or nothing

What is better is planned from the beginning with more asked of it, or one agent at a time; nothing
is proven of the whole team, only what each agent needs at least by itself.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import partial

from missionc.backends.api import Planned, Progress
from missionc.backends.smt.prioritized.prioritized_planning import PrioritizedPlanner
from missionc.backends.smt.prioritized.shorter_makespan import ShorterMakespan
from missionc.backends.smt.prioritized.shorter_ways import metres_alone, path_length, shorter
from missionc.backends.smt.refine.problem import Setting
from missionc.backends.smt.roadmap.roadmap import Indices, Roadmap
from missionc.backends.smt.sat.solve import Solvers
from missionc.backends.smt.sat.wait_for_process import is_over
from missionc.base.trace import Trace
from missionc.ir import Objective
from missionc.ir.kernel.nodes import Kernel


@dataclass(slots=True, eq=False)
class PrioritizedPlan:
    """Prioritized planning of a whole mission.

    ``refused``: requirements in conflict, where it was found out that these roadmaps hold no plan.
    ``first``: units of ``work`` of the run's account that it may come to without a plan; ``most``: with one.
    ``planner``: the last that found a plan, or that was asked for the first one.
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
        """A plan, the best that is found.

        Raises:
            TooLarge: the clauses would pass their limit.
            Unexpressible: a predicate is about too many agents at once.
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
            self.setting.budget.found(Planned(planner.trace(states), account.report()))
        for goal in sorted(self.kernel.preferences, key=lambda goal: -(goal.weight or 0.0)):
            self.setting.budget.listen(Progress("prefer", self.planner.rounds, f"`{goal.name}`"))
            more = replace(required, requirements=(*required.requirements, goal))
            found = self.again(more, self.roadmaps)
            if found is None:
                account.notes.append(f"`{goal.name}` is not kept: the search ended first")
            else:
                states, required = found, more
                account.notes.append(f"`{goal.name}` is kept")
        if mission.objective is Objective.DURATION:
            states = self.sooner(states, required)
        elif mission.objective is Objective.DISTANCE:
            with account.stage("calm"):
                states = self.shorter(states)
        return self.planner.trace(states)

    def first_of(self, required: Kernel, *, choosing: bool) -> tuple[PrioritizedPlanner, Indices | None]:
        """The last planner asked, and its joint motion, (agents, steps + 1), if there is one.

        Args:
            choosing: choose steps of what some wait for others with; then nothing tells how good a plan can be.
        """
        shares = (0.0, 0.5, 1.0) if choosing else (None,)  # of the time left in the window for the goal waited for
        for later in shares:
            planner = self.planner_of(required, self.roadmaps, self.first, later)
            states = planner.plan()
            if states is not None or not planner.chosen or not self.affordable:
                break
        return planner, states

    @property
    def affordable(self) -> bool:
        """Whether there was work left to do without a plan, and time."""
        return self.setting.account.work < self.first and not is_over(self.setting.budget.deadline)

    def planner_of(
        self, required: Kernel, roadmaps: tuple[Roadmap, ...], most: float | None = None, later: float | None = None
    ) -> PrioritizedPlanner:
        most = self.most if most is None else most
        return PrioritizedPlanner(self.setting, required, roadmaps, self.solvers, most, later)

    def again(self, required: Kernel, roadmaps: tuple[Roadmap, ...]) -> Indices | None:
        """A joint motion, (agents, steps + 1), on these roadmaps, if it is found."""
        planner = self.planner_of(required, roadmaps)
        states = planner.plan()
        if states is not None:
            self.planner = planner
        return states

    def sooner(self, states: Indices, required: Kernel) -> Indices:
        """A joint motion after whose last move there is less to wait for; what it lasts is noted."""
        assert self.planner is not None
        planner_of = partial(self.planner_of, required)
        search = ShorterMakespan(self.setting, planner_of, self.roadmaps, states, self.planner)
        search.find()
        self.planner = search.planner
        return search.states

    def shorter(self, states: Indices) -> Indices:
        """A joint motion of fewer metres in all; how many they are is noted."""
        same = 1e-6  # metres
        assert self.planner is not None
        states = shorter(self.planner, states)
        metres, least = path_length(self.planner, states), metres_alone(self.planner)
        known = ""
        if least is not None and metres - least < same:
            known = ", the least on this roadmap"
        elif least is not None:
            known = f"; on this roadmap the agents travel {least:.6g} m at least"
        self.setting.account.notes.append(f"{metres:.6g} m in all{known}")
        return states
