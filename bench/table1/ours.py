"""Our own backend, as in ``missionc compile --preset``."""

from __future__ import annotations

import time

from missionc.backends.api import Budget, Planned
from missionc.backends.load import load
from missionc.backends.options import TRANSPORT_PRESETS, Options
from missionc.base.diagnostics.model import Diagnostic
from missionc.ir import Mission
from missionc.ir.kernel.nodes import Kernel
from table1.score import Searched


def plan(
    mission: Mission, kernel: Kernel, seed: int, limit: float, preset: str = TRANSPORT_PRESETS[0]
) -> Searched | str:
    backend = load("clot")
    if isinstance(backend, Diagnostic):
        return backend.message
    outcome = backend.plan(mission, kernel, Options(preset=preset), Budget(time.monotonic() + 10 * limit, seed=seed))
    if not isinstance(outcome, Planned):
        return outcome.statement
    sizes = dict(outcome.report.sizes)
    return Searched(outcome.trace, sizes.get("local iterations"), sizes.get("joint motions"))
