"""Search in turns: its account, its work limits, and the queries to solvers within them."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Generator
from dataclasses import dataclass, field, replace
from typing import TypeAlias, TypeVar

from missionc.backends.api import Budget
from missionc.backends.options import Options
from missionc.backends.run_account import CLAUSE, Account
from missionc.backends.smt.encode.clauses import Clauses, TooLarge, dimacs, smt2
from missionc.backends.smt.refine.lazy_constraints import Effort, LazyConstraints
from missionc.backends.smt.refine.problem import Problem, Setting
from missionc.backends.smt.roadmap_answers import TimeOver, WorkExceeded
from missionc.backends.smt.sat.solve import Solvers
from missionc.backends.smt.sat.solver_process import is_over
from missionc.backends.smt.settings import SmtSettings, smt_settings
from missionc.base.memory import left
from missionc.ir import Mission
from missionc.ir.kernel.nodes import Kernel

Made = TypeVar("Made")

Pausing: TypeAlias = Generator[float, float, Made]
"""Generator that pauses like ``Turns`` and returns another result."""


@dataclass(slots=True)
class PacedRun:
    """Search that counts its work, and pauses when it reaches the granted amount."""

    mission: Mission
    kernel: Kernel
    """Kernel for roadmaps: lengths in metres are in a stronger form than in the mission."""
    options: Options
    budget: Budget
    account: Account = field(default_factory=Account)
    most: float = math.inf
    """Work units after which the current roadmap is abandoned for the next."""
    granted: float = 0.0
    """Work units up to which the current turn may run."""

    @property
    def settings(self) -> SmtSettings:
        return smt_settings(self.mission)

    def pause(self, needed: float = 0.0) -> Pausing[None]:
        """Pause until more than ``needed`` work units remain.

        Raises:
            TimeOver: no time is left.
        """
        while self.account.work + needed >= self.granted:
            self.granted = yield max(self.account.work, self.granted)
        if is_over(self.budget.deadline):
            raise TimeOver

    def within_clauses(self, attempt: Callable[[Setting], Made], price: float = CLAUSE) -> Pausing[Made]:
        """Result of ``attempt`` with as many clauses as the granted work allows; in later turns, the attempt is
        repeated with more clauses if needed.

        Args:
            price: work units per clause.

        Raises:
            TooLarge: the clauses would exceed their limit for any work.
            WorkExceeded: the clauses take more work than this roadmap may use.
        """
        most, needed = self.budget.limits.clauses, 0.0
        while True:
            yield from self.pause(needed)
            afforded = min(most, max(self.settings.solver.turn_clauses, (self.granted - self.account.work) / price))
            try:
                return attempt(Setting(self.mission, self.budget, self.account, int(afforded)))
            except TooLarge as error:
                if afforded >= most:
                    raise
                self.account.work += CLAUSE * error.made
                needed = price * min(most, max(error.clauses, 2 * afforded))
                if self.account.work + needed > self.most:
                    raise WorkExceeded from error

    def effort(self, search: LazyConstraints) -> Effort | None:
        """Limits of a SAT query in the current turn of the portfolio or of the solver; None for no limit."""
        settings = self.settings
        work = min(self.granted, self.most) - self.account.work
        if search.solvers.takes_turns:
            work = min(work, max(settings.work.relief, search.work))
        if math.isinf(work):
            return None
        effort = Effort(sys.maxsize, settings.solver.turn_rounds).within(work, search.clauses.count)
        return replace(effort, conflicts=max(settings.solver.turn_conflicts, effort.conflicts))

    def solvers(self) -> Solvers:
        memory, presolve = left(self.budget.memory_bytes), self.settings.solver.presolve_conflicts
        return Solvers(self.options.solver, memory, self.budget.seed, self.budget.deadline, presolve=presolve)

    def record(self, problem: Problem | None, rounds: int, solvers: Solvers) -> None:
        """Record the sizes of a problem (None: no problem) and the number of rounds, and close the solvers."""
        solvers.close()
        sizes, texts = self.account.sizes, self.account.texts
        clauses = Clauses(1) if problem is None else problem.search.clauses
        sizes["variables"], sizes["clauses"], sizes["rounds"] = clauses.variables, clauses.count, rounds
        sizes["solver bytes"] = max(sizes.get("solver bytes", 0), solvers.peak_bytes)
        if "dimacs" in self.options.captures:
            texts["dimacs"] = dimacs(clauses.everything(), clauses.variables, clauses.count).decode()
        if "smt2" in self.options.captures:
            texts["smt2"] = smt2(clauses.everything(), clauses.variables)
