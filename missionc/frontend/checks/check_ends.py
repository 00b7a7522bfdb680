"""Check of requirements at the ends: those that starts or finishes break by themselves, by interval robustness.

    in   Mission, its Kernel, the FreeSpace
    out  nothing but findings
    says MC510

A requirement is judged as far as the first and the last step decide it. What
hangs on anything in between is left to planning.
"""

from __future__ import annotations

from missionc.base.diagnostics.model import Diagnostic
from missionc.frontend.checks.free_space import FreeSpace
from missionc.frontend.checks.possible_ends import possible
from missionc.ir import Mission
from missionc.ir.kernel.nodes import Kernel


def check_ends(mission: Mission, kernel: Kernel, ground: FreeSpace) -> list[Diagnostic]:
    """One finding for each requirement that no plan can satisfy, because of where it begins or ends."""
    if not mission.agents:
        return []
    formulas = [goal.formula for goal in kernel.requirements]
    if possible(mission, formulas, ground).issuperset(formulas):
        return []
    from missionc.frontend.checks.broken_ends import (
        broken_ends,  # with numpy, for what places alone do not show to be possible
    )

    return broken_ends(mission, kernel, ground)
