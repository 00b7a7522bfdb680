"""The unsat core over assumption literals, minimised by deletion: requirements that cannot hold together."""

from __future__ import annotations

from missionc.backends.smt.refine.conflict_limit import effort
from missionc.backends.smt.refine.lazy_constraints import LazyConstraints
from missionc.backends.smt.sat.solve import Unsatisfiable

AGAIN, LEAST = 2.0, 1.0
"""So many times the work that the question itself took may go into a smaller core, and no less than so many units."""


def minimise(core: tuple[int, ...], search: LazyConstraints) -> tuple[int, ...]:
    """The core without what it can do without: first all that the solver does not name, then each of the rest in turn.

    Asked without looking for collisions: what is still impossible is so for
    certain, and what is possible then stays in.
    """
    account, tried = search.account, effort(search.clauses)
    most = account.work + max(LEAST, AGAIN * search.work)
    for left_out in (None, *core):
        fewer = tuple(other for other in core if other != left_out)
        if left_out not in (None, *core) or not fewer or account.work > most:
            continue
        answer = search.ask(fewer, tried)
        if isinstance(answer, Unsatisfiable):
            core = tuple(other for other in core if other in answer.core)
    return core
