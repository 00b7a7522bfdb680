"""Requirements over a mission with a flown past: past and plan, evaluated as one trajectory.

    in   the original mission, the traces of the completed parts, the trace of the plan
    out  Checks

Planning uses the progression of a requirement; this check does not rely on it.

Requirements at the steps of a plan, as checks with the monitor's truth and robustness.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from missionc.base.trace import Array, Judgements, Trace
from missionc.ir import Mission
from missionc.ir.kernel.nodes import Kernel
from missionc.verification.certificate import Check, Figure
from missionc.verification.monitoring.monitor import monitor


def check_requirements(mission: Mission, judgements: Judgements) -> tuple[list[Check], list[Figure]]:
    """A check for each requirement, with its robustness as margin, and an informative quantity for each preference."""
    checks = [
        Check(
            name="requirement",
            subject=judgement.name,
            margin=judgement.robustness,
            unit=judgement.unit,
            tolerance=0.0,
            passed=judgement.satisfied,
            at=None if judgement.step is None else judgement.step * mission.step,
            agents=judgement.agents,
            detail="evaluated by the monitor at the sample times",
        )
        for judgement in judgements.requirements
    ]
    return checks, [Figure("preference", each.name, each.robustness, each.unit) for each in judgements.preferences]


def check_whole(mission: Mission, kernel: Kernel, past: Sequence[Trace], plan: Trace) -> list[Check]:
    """A check of each requirement, evaluated over the past followed by the plan.

    Args:
        mission: the original mission, with all agents of the traces.
        past: in order; each begins with the last state of the previous one, and so does the plan.
    """
    parts = [*past, plan]

    def joined(arrays: list[Array]) -> Array:
        return np.concatenate([*(each[:, :-1] for each in arrays[:-1]), arrays[-1]], axis=1)

    whole = Trace(
        plan.step,
        joined([each.position for each in parts]),
        joined([each.velocity for each in parts]),
        joined([each.heading for each in parts]),
    )
    checks, _ = check_requirements(mission, monitor(mission, kernel, whole))
    return [replace(check, name="whole requirement") for check in checks]
