"""A backend that finishes in one turn, for stand-ins that only plan."""

from __future__ import annotations

from missionc.backends.api import Budget, Outcome, Turns
from missionc.backends.options import Options
from missionc.ir import Mission
from missionc.ir.kernel.nodes import Kernel


class OneTurn:
    """Backend whose only turn is its plan."""

    def plan(self, mission: Mission, kernel: Kernel, options: Options, budget: Budget) -> Outcome:
        raise NotImplementedError

    def turns(self, mission: Mission, kernel: Kernel, options: Options, budget: Budget) -> Turns:
        yield 0.0
        return self.plan(mission, kernel, options, budget)
