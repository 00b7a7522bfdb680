"""Conflict limits: a solver's effort for a better plan, counted so that it does not depend on the machine."""

from __future__ import annotations

from missionc.backends.smt.encode.clauses import Clauses
from missionc.backends.smt.refine.lazy_constraints import Effort
from missionc.backends.smt.settings import smt_settings
from missionc.ir import Mission


def effort(mission: Mission, clauses: Clauses) -> Effort:
    """Effort of one question: fewer conflicts if there are many clauses, since each takes longer."""
    settings = smt_settings(mission).solver
    conflicts = min(settings.improve_most, settings.improve_work // max(1, clauses.count))
    return Effort(max(settings.improve_least, conflicts), settings.improve_rounds)
