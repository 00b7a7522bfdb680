"""Which requirements cannot hold together: as few as can be shown in the time there is."""

from __future__ import annotations

import time

from missionc.backends.smt.search import Search
from missionc.backends.smt.solve import Unsatisfiable

SHARE = 0.2
"""Of the time that is left, so much may go into a smaller core."""

MOST = 20.0
"""Seconds, whatever is left."""


def minimise(core: tuple[int, ...], search: Search) -> tuple[int, ...]:
    """The core without what it can do without: each of its assumptions is left out in turn.

    Asked without looking for collisions: what is still impossible is so for
    certain, and what is possible then stays in.
    """
    now = time.monotonic()
    until = now + min(SHARE * (search.solvers.deadline - now), MOST)
    for assumption in core:
        fewer = tuple(other for other in core if other != assumption)
        if assumption in core and fewer and time.monotonic() < until:
            answer = search.ask(fewer, until)
            if isinstance(answer, Unsatisfiable):
                core = tuple(other for other in core if other in answer.core)
    return core
