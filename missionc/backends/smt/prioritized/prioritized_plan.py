"""A plan by prioritized planning, and a better one: preferences by weight, then the objective.

    in   roadmaps, the mission's goals
    out  a trace in which every requirement holds, or the requirements that these roadmaps hold no plan for, or nothing

What is better is planned from the beginning with more asked of it, or one agent at a time; nothing
is proven of the whole team, only what each agent needs at least by itself.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from missionc.backends.api import Planned, Progress
from missionc.backends.smt.prioritized.precedence import LATER
from missionc.backends.smt.prioritized.prioritized_planning import PrioritizedPlanner
from missionc.backends.smt.prioritized.shorter_ways import all_able, metres_alone, shorter, travelled
from missionc.backends.smt.refine.problem import Setting
from missionc.backends.smt.roadmap.roadmap import Indices, Roadmap
from missionc.backends.smt.sat.solve import Solvers
from missionc.backends.smt.sat.wait_for_process import is_over
from missionc.backends.smt.shorten.minimize_duration import duration
from missionc.base.trace import Trace
from missionc.ir import Objective
from missionc.kernel.nodes import Kernel

TRIES = 4
"""So often a shorter duration is asked for."""

SAME = 1e-6
"""Metres: so little makes no plan shorter."""


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
        for later in LATER if choosing else (None,):
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
        least = _first(duration(states), lambda steps: self._able(required, steps))
        best, too_few = duration(states), least - 1
        for attempt in range(TRIES):
            if best <= least:
                break
            target = least if attempt == 0 else (best + too_few + 1) // 2
            if not too_few < target < best:
                break
            self.setting.budget.listen(Progress("improve", attempt, f"{best} steps; are {target} enough?"))
            found = self.again(required, self._still(target))
            if found is None:
                too_few = target
            else:
                states, best = found, duration(found)
        known = "the fewest on this roadmap" if best <= least else f"on this roadmap an agent needs {least} by itself"
        self.setting.account.notes.append(f"lasts {best} steps; {known}")
        return states

    def _able(self, required: Kernel, steps: int) -> bool:
        """Whether each agent by itself can do what is asked of it and stand still after so many steps."""
        planner = self.planner_of(required, self._still(steps))
        return all_able(planner)

    def _still(self, steps: int) -> tuple[Roadmap, ...]:
        """The roadmaps without moves that lead on after so many steps."""

        def still(roadmap: Roadmap) -> Roadmap:
            allowed = roadmap.allowed.copy()
            allowed[steps:, np.not_equal(*roadmap.moves.T)] = False
            return replace(roadmap, allowed=allowed)

        return tuple(map(still, self.roadmaps))

    def shorter(self, states: Indices) -> Indices:
        """A joint motion of fewer metres in all; how many they are is noted."""
        assert self.planner is not None
        states = shorter(self.planner, states)
        metres, least = travelled(self.planner, states), metres_alone(self.planner)
        known = ""
        if least is not None and metres - least < SAME:
            known = ", the least on this roadmap"
        elif least is not None:
            known = f"; on this roadmap the agents travel {least:.6g} m at least"
        self.setting.account.notes.append(f"{metres:.6g} m in all{known}")
        return states


def _first(most: int, able: Callable[[int], bool]) -> int:
    """The least number up to the most of which this is so; it is so of all after it."""
    low, high = 0, most
    while low < high:
        middle = (low + high) // 2
        low, high = (low, middle) if able(middle) else (middle + 1, high)
    return high
