"""Conflict limits: a solver's effort for a better plan, counted so that it does not depend on the machine."""

from __future__ import annotations

from missionc.backends.smt.encode.clauses import Clauses
from missionc.backends.smt.refine.lazy_constraints import Effort

WORK = 300_000_000
"""Clauses times conflicts of one question."""

LEAST, MOST = 500, 20_000
"""Conflicts of one question, whatever the clauses."""

ROUNDS = 60
"""Rounds of collisions, for one question."""


def effort(clauses: Clauses) -> Effort:
    """What a question about so many clauses may take: fewer conflicts where they are many, for each takes longer."""
    return Effort(conflicts=max(LEAST, min(MOST, WORK // max(1, clauses.count))), rounds=ROUNDS)
