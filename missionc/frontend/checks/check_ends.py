"""Check of requirements at the first and last step, by interval robustness.

    in   Mission, its Kernel, the FreeSpace
    out  nothing but findings
    says MC510

A requirement is evaluated as far as the first and the last step decide it. Planning decides what depends on the steps
in between.
"""

from __future__ import annotations

from missionc.base.diagnostics.model import Diagnostic
from missionc.frontend.checks.free_space import FreeSpace
from missionc.frontend.checks.possible_ends import possible
from missionc.ir import Mission
from missionc.ir.kernel.nodes import Kernel


def check_ends(mission: Mission, kernel: Kernel, ground: FreeSpace) -> list[Diagnostic]:
    """Findings about the requirements that no plan can satisfy because of a start or finish, one for each."""
    if not mission.agents:
        return []
    formulas = [goal.formula for goal in kernel.requirements]
    if possible(mission, formulas, ground).issuperset(formulas):
        return []
    from missionc.frontend.checks.broken_ends import (
        broken_ends,  # with numpy, if sample places do not show that all is possible
    )

    return broken_ends(mission, kernel, ground)
