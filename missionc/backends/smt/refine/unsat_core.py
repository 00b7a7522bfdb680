"""Unsat core over assumption literals, minimised by deletion: requirements that cannot hold together.

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
    """The core without what the solver does not name: a presolve names nothing.

    Asked without looking for collisions: what is still impossible is so for
    certain, and what is possible then stays in.
    """
    answer = search.ask(core, effort(search.mission, search.clauses))
    return tuple(literal for literal in core if literal in answer.core) if isinstance(answer, Unsatisfiable) else core


def minimise(core: tuple[int, ...], search: LazyConstraints) -> tuple[int, ...]:
    """The core without what it can do without: first all that the solver does not name, then each of the rest in turn.

    Asked without looking for collisions, as ``named_by_solver`` does.
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
    """A conflict as it gets smaller; all its names together cannot hold.

    What holds without a name holds without it however small the conflict gets, so that no question is put twice.
    """

    conflict: tuple[str, ...]
    needed: set[str] = field(default_factory=set)
    """Names without which the others can hold."""
    left_open: set[str] = field(default_factory=set)
    """Names of which it was not found out, in the conflict as it was then."""

    @property
    def smallest(self) -> bool:
        """Every proper subset can hold."""
        return self.needed.issuperset(self.conflict)

    def question(self) -> str | None:
        """A name without which the others may hold or not; None where nothing is left to ask."""
        return next((name for name in self.conflict if name not in self.needed | self.left_open), None)

    def without(self, name: str) -> tuple[str, ...]:
        return tuple(other for other in self.conflict if other != name)

    def holds(self, without: str) -> None:
        """The others can hold."""
        self.needed.add(without)

    def refused(self, core: Collection[str]) -> None:
        """These names of the conflict cannot hold together; what was left open of a larger one is asked again."""
        self.conflict = tuple(name for name in self.conflict if name in core)
        self.left_open.clear()

    def unknown(self, without: str) -> None:
        """Whether the others can hold was not found out."""
        self.left_open.add(without)


def effort(mission: Mission, clauses: Clauses) -> Effort:
    """Effort of one question: fewer conflicts if there are many clauses, since each takes longer."""
    settings = smt_settings(mission).solver
    conflicts = min(settings.improve_most, settings.improve_work // max(1, clauses.count))
    return Effort(max(settings.improve_least, conflicts), settings.improve_rounds)
