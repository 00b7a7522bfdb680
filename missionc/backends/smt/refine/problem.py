"""SAT problem: agents to plan, formulas, and reservations of planned agents.

Unsatisfiable core over assumption literals, minimised by deletion: requirements in conflict.

Each query has a limit on conflicts, which decreases with the number of clauses.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, field

import numpy as np

from missionc.backends.api import Budget
from missionc.backends.run_account import CLAUSE, Account
from missionc.backends.smt.encode.clauses import Clauses
from missionc.backends.smt.encode.lower import Lowered, lower
from missionc.backends.smt.encode.lower_motion import Motion, Occupancy, lower_motion
from missionc.backends.smt.refine.lazy_constraints import Effort, LazyConstraints
from missionc.backends.smt.roadmap.labels import Labels
from missionc.backends.smt.roadmap.roadmap import Roadmap
from missionc.backends.smt.sat.solve import Solvers, Unsatisfiable
from missionc.backends.smt.settings import smt_settings
from missionc.base.late_dataclass import Record
from missionc.base.trace import Flags
from missionc.ir import Mission
from missionc.ir.kernel.nodes import Goal


class Problem(Record, eq=False):
    """SAT problem with its variables and its search; ``lowered`` has a literal for each goal."""

    motion: Motion
    lowered: Lowered
    search: LazyConstraints


class Setting(Record, eq=False):
    """Data and limits that all problems of a run share."""

    mission: Mission
    budget: Budget
    account: Account
    clauses: int
    """Maximum number of clauses for formulas and motions; collision clauses may exceed it, up to the budget's limit."""

    def problem(
        self,
        goals: Sequence[Goal],
        roadmaps: tuple[Roadmap, ...],
        ways: tuple[Flags, ...],
        planned: frozenset[int],
        reserved: frozenset[int],
        most_links: int,
        solvers: Solvers,
    ) -> Problem:
        """SAT problem of some agents and goals, with the search that queries the solvers.

        Args:
            roadmaps: roadmaps with the allowed moves of the planned agents.
            ways: possible states of each agent, (steps + 1, states).
            planned: agents to plan.
            reserved: agents with one fixed motion each, out of reach of the planned agents' moves.
            most_links: maximum number of links of a route.

        Raises:
            TooLarge: the clauses would exceed their limit.
            Unexpressible: a predicate depends on too many agents at once.
        """
        with self.account.stage("lower"):
            clauses = Clauses(self.clauses)
            solvers.begin()
            motion = lower_motion(roadmaps, ways, planned | reserved, clauses)
            solvers.show(clauses)
            lowered = lower(
                goals, Labels(self.mission, roadmaps), motion, clauses, Occupancy(motion, clauses), most_links
            )
            self.account.work += CLAUSE * clauses.count
            clauses.limit = self.budget.limits.clauses
        members = np.array(sorted(planned), dtype=np.int64)
        search = LazyConstraints(self.mission, motion, members, clauses, solvers, self.account, self.budget.on_progress)
        return Problem(motion, lowered, search)


def named_by_solver(core: tuple[int, ...], search: LazyConstraints) -> tuple[int, ...]:
    """Core without literals that the solver does not need; a presolve returns all assumptions as core.

    The query ignores collisions: a refusal is then still certain, and without a refusal the core is unchanged.
    """
    answer = search.ask(core, effort(search.mission, search.clauses))
    return tuple(literal for literal in core if literal in answer.core) if isinstance(answer, Unsatisfiable) else core


def minimise(core: tuple[int, ...], search: LazyConstraints) -> tuple[int, ...]:
    """Core minimised by deletion: first all literals that the solver does not need, then single other literals, while
    work is left.

    The queries ignore collisions, as in ``named_by_solver``.
    """
    settings = smt_settings(search.mission).work
    account = search.account
    most = account.work + max(settings.core, settings.core_share * search.work)
    core = named_by_solver(core, search) if core else core
    for left_out in core:
        fewer = tuple(other for other in core if other != left_out)
        if left_out not in core or not fewer or account.work > most:
            continue
        answer = search.ask(fewer, effort(search.mission, search.clauses))
        if isinstance(answer, Unsatisfiable):
            core = tuple(other for other in core if other in answer.core)
    return core


@dataclass(slots=True)
class Deletion:
    """Conflict that is minimised by deletion; its names are jointly unsatisfiable.

    A satisfiable subset stays satisfiable as the conflict shrinks, so no query is repeated.
    """

    conflict: tuple[str, ...]
    needed: set[str] = field(default_factory=set)
    """Names without which the conflict is satisfiable."""
    left_open: set[str] = field(default_factory=set)
    """Names for which it is undecided if the conflict without the name is satisfiable."""

    @property
    def smallest(self) -> bool:
        """True if every proper subset of the conflict is satisfiable."""
        return self.needed.issuperset(self.conflict)

    def question(self) -> str | None:
        """Next name whose removal from the conflict is to be tested; None if no test is left."""
        return next((name for name in self.conflict if name not in self.needed | self.left_open), None)

    def without(self, name: str) -> tuple[str, ...]:
        return tuple(other for other in self.conflict if other != name)

    def holds(self, without: str) -> None:
        """Record that the conflict is satisfiable without this name."""
        self.needed.add(without)

    def refused(self, core: Collection[str]) -> None:
        """Record that the names of ``core`` are jointly unsatisfiable; undecided queries of the larger conflict are
        repeated."""
        self.conflict = tuple(name for name in self.conflict if name in core)
        self.left_open.clear()

    def unknown(self, without: str) -> None:
        """Record that the query about the conflict without this name is undecided."""
        self.left_open.add(without)


def effort(mission: Mission, clauses: Clauses) -> Effort:
    """Limits of one SAT query: fewer conflicts for many clauses, since each conflict takes longer."""
    settings = smt_settings(mission).solver
    conflicts = min(settings.improve_most, settings.improve_work // max(1, clauses.count))
    return Effort(max(settings.improve_least, conflicts), settings.improve_rounds)
