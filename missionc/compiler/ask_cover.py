"""Covers during or after a long search, which may prove that no motion satisfies the mission.

in   a backend, Mission, its kernel
out  its Outcome, or the proof that no motion satisfies the mission

Lower bounds on the objective over all plans, from tours and, for a duration, from covers.

in   Mission, its kernel, the value of a plan
out  Proven
"""

from __future__ import annotations

import time
from dataclasses import dataclass, field, replace
from functools import partial
from typing import TYPE_CHECKING

from missionc.backends import api
from missionc.backends.api import Budget, discard_snapshot
from missionc.backends.options import Options
from missionc.backends.run_account import Account, run_to_end
from missionc.base.signals import stop_requested
from missionc.base.trace import COVER, TOURS, Proven, Trace
from missionc.compiler.plan_request import StageLog
from missionc.compiler.strategy import BOUND, COVERS
from missionc.frontend.checks.lower_bounds import UNITS, beside, least_by_tours
from missionc.ir import Mission, Objective
from missionc.ir.kernel.nodes import Kernel
from missionc.ir.lower.unroll_past import looking_ahead

if TYPE_CHECKING:
    from missionc.backends.cover.refute import Answer


@dataclass(slots=True, eq=False)
class CoverSide:
    """Covers of a mission, with little work at first, and more work later or after a failed search."""

    mission: Mission
    kernel: Kernel
    meant: Kernel
    """Kernel of the original mission, with its past operators, for certificates."""
    options: Options
    budget: api.Budget
    log: StageLog = field(default_factory=StageLog)
    account: Account = field(default_factory=Account)
    answer: Answer | None = None
    asked: float = 0.0
    """Work limit of the last attempt with covers, in work units."""
    planned: bool = False
    """True if a search already has a plan that it improves."""

    def refusal(self, work: float, after: api.Report | None = None) -> api.Impossible | None:
        """Proof that no motion satisfies the mission; None if covers do not prove it.

        Args:
            work: work limit.
            after: report of a failed search.
        """
        from missionc.backends.cover.refute import Refuted, refute  # for missions that are not planned at once

        if self.asked < work:
            now = time.monotonic()
            until = now + COVERS.time * max(0.0, self.budget.deadline - now)
            budget = replace(
                self.budget,
                deadline=until,
                work=self.account.work + work,
                on_snapshot=api.discard_snapshot,
                resume=None,
            )
            self.asked = work
            before = self.account.work
            self.answer = refute(self.mission, self.kernel, budget, self.account, self.options.solver)
            self.log.add("covers", "cover", self.account.work - before, str(self.answer))
        if not isinstance(self.answer, Refuted):
            return None
        if self.options.certify and not self.account.files:
            from missionc.compiler.claim_cover import certify_refusal

            certify_refusal(self.answer, self.mission, self.meant, self.budget, self.account)
        report = replace(self._report(after or api.Report()), files=tuple(self.account.files.items()))
        return api.Impossible(
            self.answer.conflict, str(self.answer), report, api.Scope.MISSION, smallest=self.answer.smallest
        )

    def searched(
        self, backend: api.Backend, mission: Mission, kernel: Kernel, budget: api.Budget, attempt: str
    ) -> api.Outcome:
        """Outcome of a search for a plan, or the proof of infeasibility if covers find one during the search.

        Args:
            mission, kernel: the mission to plan, or a strengthened one.
            attempt: name of the attempt in the log.
        """

        def found(plan: api.Planned) -> object:
            self.planned = True
            return budget.on_incumbent(plan)

        meanwhile = (
            () if self.options.captures else [(units, partial(self._meanwhile, work)) for units, work in COVERS.during]
        )
        turns = backend.turns(mission, kernel, self.options, replace(budget, on_incumbent=found))
        outcome = run_to_end(turns, budget, meanwhile)
        self.log.searched(backend.name, outcome, attempt)
        no_room = isinstance(outcome, api.NotFound) and outcome.reason is api.Reason.MEMORY
        if isinstance(outcome, api.Planned) or self.planned or no_room:
            return outcome
        refused = self.refusal(COVERS.failed, outcome.report)
        if refused is not None:
            return refused
        notes = (str(self.answer),) if isinstance(outcome, api.Impossible) else ()
        return replace(outcome, report=self._report(outcome.report).noting(*notes))

    def _meanwhile(self, work: float, done: float) -> api.Impossible | None:
        """Proof of infeasibility by covers during a search; None if there is no proof, or already a plan.

        Args:
            work: work limit of the covers.
            done: work of the search so far.
        """
        return None if self.planned else self.refusal(work, api.Report(work=done))

    def _report(self, report: api.Report) -> api.Report:
        """The report with the covers' work added."""
        if dict(report.seconds).get("cover") is not None:
            return report
        cover = self.account.report()
        seconds = (*report.seconds, *cover.seconds)
        return replace(report.noting(*cover.notes), seconds=seconds, work=report.work + cover.work)


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
