"""The other side of the answer: where a search takes long or fails, covers are asked whether any motion is a plan.

in   a backend, Mission, its kernel
out  its Outcome, or that no motion satisfies the mission
"""

from __future__ import annotations

import time
from dataclasses import dataclass, field, replace
from functools import partial
from typing import TYPE_CHECKING

from missionc.backends import api
from missionc.backends.options import Options
from missionc.backends.run_account import Account
from missionc.backends.work import run_to_end
from missionc.compiler.stage_log import StageLog
from missionc.compiler.strategy import COVERS
from missionc.ir import Mission
from missionc.ir.kernel.nodes import Kernel

if TYPE_CHECKING:
    from missionc.backends.cover.refute import Answer


@dataclass(slots=True, eq=False)
class CoverSide:
    """Covers of a mission, asked for little when a search has done some work, and for more later or where it failed."""

    mission: Mission
    kernel: Kernel
    meant: Kernel
    """The kernel with whatever looks back, as it was written: certificates are about that."""
    options: Options
    budget: api.Budget
    log: StageLog = field(default_factory=StageLog)
    account: Account = field(default_factory=Account)
    answer: Answer | None = None
    asked: float = 0.0
    """Units of work that covers had, the last time."""
    planned: bool = False
    """Whether a search has a plan already, which it goes on to make better."""

    def refusal(self, work: float, after: api.Report | None = None) -> api.Impossible | None:
        """That no motion satisfies the mission; None where covers do not show it.

        Args:
            work: units that they may take.
            after: what a search did that found nothing.
        """
        from missionc.backends.cover.refute import Refuted, refute  # for those who are not planned at once

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
        """What a search for a plan of the mission, or of a stronger one, comes to; or that no motion is one."""

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
        """That no motion satisfies the mission, by covers that take so much work while a search has done so much."""
        return None if self.planned else self.refusal(work, api.Report(work=done))

    def _report(self, report: api.Report) -> api.Report:
        """A report with what covers took."""
        if dict(report.seconds).get("cover") is not None:
            return report
        cover = self.account.report()
        seconds = (*report.seconds, *cover.seconds)
        return replace(report.noting(*cover.notes), seconds=seconds, work=report.work + cover.work)
