"""The unsat core over assumption literals, minimised by deletion: requirements that cannot hold together."""

from __future__ import annotations

import time

from missionc.backends.smt.refine.conflict_limit import effort
from missionc.backends.smt.refine.lazy_constraints import LazyConstraints
from missionc.backends.smt.sat.solve import Unsatisfiable

SHARE = 0.2
"""The share of the time that is left which may go into a smaller core."""

AGAIN, LEAST = 2.0, 1.0
"""So many times as long as the solver took so far, for the cores of all roadmaps, and no less than so many seconds."""


def minimise(core: tuple[int, ...], search: LazyConstraints) -> tuple[int, ...]:
    """The core without what it can do without: first all that the solver does not name, then each of the rest in turn.

    Asked without looking for collisions: what is still impossible is so for
    certain, and what is possible then stays in.
    """
    now = time.monotonic()
    spent = search.account.seconds
    again = AGAIN * spent.get("solve", 0.0) - spent.get("core", 0.0)
    until = now + min(SHARE * (search.solvers.deadline - now), max(LEAST, again))
    tried = effort(search.clauses)
    for left_out in (None, *core):
        fewer = tuple(other for other in core if other != left_out)
        if left_out not in (None, *core) or not fewer or time.monotonic() > until:
            continue
        answer = search.ask(fewer, until, tried)
        if isinstance(answer, Unsatisfiable):
            core = tuple(other for other in core if other in answer.core)
    return core
