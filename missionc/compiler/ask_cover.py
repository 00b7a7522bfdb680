"""Covers during or after a long search, which may prove that no motion satisfies the mission.

in   a backend, Mission, its kernel
out  its Outcome, or the proof that no motion satisfies the mission
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
