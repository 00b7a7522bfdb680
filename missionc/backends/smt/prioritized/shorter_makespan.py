"""A shorter makespan of a joint motion that was planned agent by agent: who is late is planned again with less time.

    in   a joint motion, what is required of it
    out  one that is over sooner, if that comes off; a lower bound, from what each agent needs by itself

It goes down in strides that double as long as they come off. Who is late is planned again while the others go as they
did, unless they are pushed, and by the solver where no way is found otherwise; at last all are planned from the
beginning, the late first. What that may take is counted in work.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field, replace

import numpy as np

from missionc.backends.api import Progress
from missionc.backends.smt.prioritized.prioritized_planning import PrioritizedPlanner
from missionc.backends.smt.prioritized.progression import TooComplex
from missionc.backends.smt.refine.problem import Setting
from missionc.backends.smt.roadmap.roadmap import Indices, Roadmap
from missionc.backends.smt.sat.wait_for_process import is_over
from missionc.backends.smt.settings import smt_settings
from missionc.backends.smt.shorten.minimize_duration import duration, rests_from
from missionc.backends.work import MOVE_STEP


@dataclass(slots=True, eq=False)
class ShorterMakespan:
    """The search for a joint motion that is over sooner.

    Args:
        planner_of: prioritized planning of what is required, on these roadmaps, up to so many units of work.
        states: the best found, (agents, steps + 1); ``planner`` found it.
    """

    setting: Setting
    planner_of: Callable[[tuple[Roadmap, ...], float], PrioritizedPlanner]
    roadmaps: tuple[Roadmap, ...]
    states: Indices
    planner: PrioritizedPlanner
    most: float = math.inf
    """Units of work of the run's account that it may come to."""
    _planners: dict[int, PrioritizedPlanner] = field(default_factory=dict)

    @property
    def affordable(self) -> bool:
        """Whether there is work left to do it with, and time."""
        setting = self.setting
        return setting.account.work < self.most and not is_over(setting.budget.deadline)

    @property
    def best(self) -> int:
        """After how many steps nobody moves any more."""
        return duration(self.states)

    def find(self) -> None:
        """Makes it as short as it gets, and notes what is known."""
        settings = smt_settings(self.setting.mission).work
        account = self.setting.account
        made, before = account.work, self.best
        least = self.least(int(self.setting.budget.enough(self.best)))
        self.most = account.work + max(settings.makespan, settings.makespan_share * made)
        self.descend(least)
        if self.affordable and self.best > least and self.attempt(self.best - 1, anew=True):
            self.descend(least)
        lasts = f"lasts {self.best} steps" + (f", {before} before it was made less" if self.best < before else "")
        fewest = self.best == least
        known = "the fewest on this roadmap" if fewest else f"no plan on this roadmap takes less than {least}"
        account.notes.append(f"{lasts}; {known}")

    def descend(self, least: int) -> None:
        """Goes down in strides that double as long as each comes off, and then halve."""
        vain, stride = least - 1, max(1, (self.best - least) // smt_settings(self.setting.mission).prioritized.strides)
        while self.affordable and self.best - vain > 1:
            target = max(self.best - stride, vain + 1)
            if self.attempt(target):
                stride *= 2
            else:
                vain, stride = target, max(1, (self.best - target) // 2)

    def attempt(self, steps: int, *, anew: bool = False) -> bool:
        """Whether a joint motion is found that is over after so many steps; it is the best then.

        Args:
            anew: all are planned from the beginning; else who is not late goes as before, unless pushed.
        """
        settings = smt_settings(self.setting.mission).prioritized
        self.setting.budget.listen(Progress("improve", 0, f"{self.best} steps; are {steps} enough?"))
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
        """The roadmaps without moves that lead on after so many steps."""

        def still(roadmap: Roadmap) -> Roadmap:
            allowed = roadmap.allowed.copy()
            allowed[steps:, np.not_equal(*roadmap.moves.T)] = False
            return replace(roadmap, allowed=allowed)

        return tuple(map(still, self.roadmaps))

    def least(self, least: int) -> int:
        """The steps that some agent needs by itself, whatever the others do, where so many are known to be needed."""
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
        """Whether there may be a way of the agent by itself that is over after so many steps."""
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
