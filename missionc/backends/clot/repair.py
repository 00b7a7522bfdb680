"""Trajectory repair: the optimiser starts at a trajectory that nearly satisfies a kernel.

    in   Mission, a kernel and the trace of a trajectory
    out  Planned or NotFound

For each requirement, the choices (part, step and link) that the trajectory satisfies best are fixed
(``goal_terms.Demand.witness``), and the trajectory is optimised until they are satisfied. If the result implies other
choices, it is optimised again with them.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import field, replace

from missionc.backends.acceptance import attempt
from missionc.backends.api import Budget, NotFound, Outcome, Planned, Reason, Report, Turns
from missionc.backends.clot.cost_graph.cost_graph import build
from missionc.backends.clot.cost_weights import spare
from missionc.backends.clot.optimise.active_set import Demand
from missionc.backends.clot.optimise.control_points import splines, trace
from missionc.backends.clot.optimise.levenberg_marquardt import polish
from missionc.backends.clot.optimise.motion_residuals import Costs
from missionc.backends.clot.optimise.own_state_stays import with_stays
from missionc.backends.clot.settings import clot_settings
from missionc.backends.options import Options
from missionc.backends.run_account import Account, polish_work, run_to_end
from missionc.base.diagnostics.model import Diagnostic
from missionc.base.late_dataclass import Record
from missionc.base.signals import stop_requested
from missionc.base.trace import Trace, then_polished
from missionc.ir import Mission
from missionc.ir.kernel.nodes import Kernel


class Repair(Record, eq=False):
    """Backend that searches for a plan near a given trajectory."""

    motion: Trace
    found: Report = field(default_factory=Report)
    """Report of the search that found the trajectory; clauses, roadmaps and methods also apply to the repaired plan."""
    name: str = "clot"
    refutes: bool = False

    def missing(self, options: Options) -> Diagnostic | None:
        return None

    def plan(self, mission: Mission, kernel: Kernel, options: Options, budget: Budget) -> Outcome:
        """Outcome of optimising the trajectory until it satisfies the kernel."""
        return run_to_end(self.turns(mission, kernel, options, budget), budget)

    def turns(self, mission: Mission, kernel: Kernel, options: Options, budget: Budget) -> Turns:
        """Search in a single turn."""
        yield 0.0
        account = Account()

        def in_time() -> bool:
            return time.monotonic() < budget.deadline and not stop_requested()

        with account.stage("repair"):
            found = self._repaired(mission, kernel, in_time, account)
        if found is None:
            reason = Reason.SOLVER if in_time() else Reason.TIME
            return NotFound(reason, "no plan was found near the first plan", account.report())
        before = self.found
        report = replace(account.report(), sizes=before.sizes, texts=before.texts, roadmaps=before.roadmaps)
        return Planned(found, replace(report, solved=then_polished(before.solved, mission.names)))

    def _repaired(self, mission: Mission, kernel: Kernel, go_on: Callable[[], bool], account: Account) -> Trace | None:
        settings = clot_settings(mission).attempts
        made = splines(mission)
        control = made.at_rest(made.joined(self.motion.position, self.motion.velocity))
        roots = tuple(each.formula for each in build(kernel).requirements)
        costs = Costs(mission, made, clot_settings(mission).weights, spare(mission))
        for _ in range(settings.repairs):
            states = made.states(control)
            choices = Demand.of(mission, roots, {}, mission.steps).witness(*states)
            demand = with_stays(Demand.of(mission, roots, choices, mission.steps), *states)
            polished = polish(control, costs, demand, settings.repair_polish, go_on)
            account.work += polish_work(mission, polished.iterations)
            motion = trace(mission, made, polished.control)
            if attempt(mission, kernel, motion).is_plan:
                return motion
            if not go_on() or not (polished.control != control).any():
                return None
            control = polished.control
        return None
