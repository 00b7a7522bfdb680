"""Unsatisfiable core over assumption literals, minimised by deletion: requirements in conflict.

Each query has a limit on conflicts, which decreases with the number of clauses.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, field

from missionc.backends.smt.encode.clauses import Clauses
from missionc.backends.smt.refine.lazy_constraints import Effort, LazyConstraints
from missionc.backends.smt.sat.solve import Unsatisfiable
from missionc.backends.smt.settings import smt_settings
from missionc.ir import Mission


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
