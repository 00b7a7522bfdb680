"""The unsat core over assumption literals, minimised by deletion: requirements that cannot hold together."""

from __future__ import annotations

from missionc.backends.smt.refine.conflict_limit import effort
from missionc.backends.smt.refine.lazy_constraints import LazyConstraints
from missionc.backends.smt.sat.solve import Unsatisfiable
from missionc.backends.smt.settings import smt_settings


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
