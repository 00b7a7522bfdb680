"""Lower bounds on the objective over all plans, from tours and, for a duration, from covers.

in   Mission, its kernel, the value of a plan
out  Proven
"""

from __future__ import annotations

import time
from dataclasses import dataclass, replace

from missionc.backends.api import Budget, discard_snapshot
from missionc.backends.options import Options
from missionc.backends.run_account import Account
from missionc.base.proven import COVER, TOURS, Proven
from missionc.base.signals import stop_requested
from missionc.base.trace import Trace
from missionc.compiler.strategy import BOUND
from missionc.frontend.checks.lower_bounds import UNITS, beside, least_by_tours
from missionc.ir import Mission, Objective
from missionc.ir.kernel.nodes import Kernel
from missionc.ir.lower.unroll_past import looking_ahead


@dataclass(slots=True, eq=False)
class BoundSide:
    """Lower bounds on the objective of a mission, computed once, when there is a plan."""

    mission: Mission
    kernel: Kernel
    options: Options
    budget: Budget
    tours: float | None = None
    """Lower bound from tours, seconds or metres; None if unknown or not yet computed."""
    covered: int | None = None
    """Lower bound on the number of steps from covers; None if not computed."""

    def enough(self, value: float) -> float:
        """Lower bound on the objective over all plans, steps or metres, given a plan with ``value``; 0 if unknown."""
        if self.tours is None:
            self.tours = least_by_tours(self.mission, self.kernel)
        if self.tours is None or self.mission.objective is Objective.DISTANCE:
            return min(value, self.tours or 0.0)
        least, lasts = round(self.tours / self.mission.step), round(value)
        if self.covered is None and least < lasts:
            self.covered = self._covered(least, lasts)
        return float(min(lasts, max(least, self.covered or 0)))

    def proven(self, trace: Trace) -> Proven | None:
        """Lower bound that the report states for a plan; None if the objective has no lower bound."""
        if self.mission.objective not in UNITS:
            return None
        lasts = self.mission.objective is Objective.DURATION
        least = self.enough(trace.lasts if lasts else trace.metres) * (self.mission.step if lasts else 1.0)
        if self.tours is None:
            return None
        return beside(self.mission, trace, least, COVER if least > self.tours else TOURS)

    def _covered(self, least: int, lasts: int) -> int:
        """Lower bound on the number of steps from covers.

        Args:
            least: a lower bound that is already known, steps.
            lasts: duration of the plan, steps.
        """
        from missionc.backends.cover.refute import least_duration  # for missions that minimize a duration

        ahead = looking_ahead(self.mission, self.kernel, self.budget.limits.formula_nodes)
        now = time.monotonic()
        if not isinstance(ahead, Kernel) or now >= self.budget.deadline or stop_requested():
            return least
        until = now + BOUND.time * (self.budget.deadline - now)
        short = replace(self.budget, deadline=until, work=BOUND.work, on_snapshot=discard_snapshot, resume=None)
        try:
            return least_duration(self.mission, ahead, least, lasts, short, Account(), self.options.solver)
        except MemoryError:
            return least
