"""Unsat core over assumption literals, minimised by deletion: requirements in conflict.

Each question has a limit on conflicts, which grows with the clauses.
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
    """The core without literals that the solver does not name; a presolve names none.

    The question ignores collisions: a refusal is then still certain, and literals without one stay in the core.
    """
    answer = search.ask(core, effort(search.mission, search.clauses))
    return tuple(literal for literal in core if literal in answer.core) if isinstance(answer, Unsatisfiable) else core


def minimise(core: tuple[int, ...], search: LazyConstraints) -> tuple[int, ...]:
    """Minimise the core: first drop all literals that the solver does not name, then try each of the rest.

    The questions ignore collisions, as in ``named_by_solver``.
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
    """A shrinking conflict; its names are jointly unsatisfiable.

    A satisfiable subset stays satisfiable as the conflict shrinks, so no question is repeated.
    """

    conflict: tuple[str, ...]
    needed: set[str] = field(default_factory=set)
    """Names without which the others are satisfiable."""
    left_open: set[str] = field(default_factory=set)
    """Names with an undecided question, and the conflict at that time."""

    @property
    def smallest(self) -> bool:
        """True if every proper subset is satisfiable."""
        return self.needed.issuperset(self.conflict)

    def question(self) -> str | None:
        """A name for which satisfiability of the others is unknown; None if no question is left."""
        return next((name for name in self.conflict if name not in self.needed | self.left_open), None)

    def without(self, name: str) -> tuple[str, ...]:
        return tuple(other for other in self.conflict if other != name)

    def holds(self, without: str) -> None:
        """Note that the others are satisfiable without this name."""
        self.needed.add(without)

    def refused(self, core: Collection[str]) -> None:
        """Note that these names are jointly unsatisfiable.

        Undecided questions of a larger conflict are asked again.
        """
        self.conflict = tuple(name for name in self.conflict if name in core)
        self.left_open.clear()

    def unknown(self, without: str) -> None:
        """Note that the question without this name is undecided."""
        self.left_open.add(without)


def effort(mission: Mission, clauses: Clauses) -> Effort:
    """Effort of one question: fewer conflicts for many clauses, since each takes longer."""
    settings = smt_settings(mission).solver
    conflicts = min(settings.improve_most, settings.improve_work // max(1, clauses.count))
    return Effort(max(settings.improve_least, conflicts), settings.improve_rounds)
