"""Requirements at the steps of a plan: the monitor's truth and robustness, as checks."""

from __future__ import annotations

from missionc.base.trace import Trace
from missionc.ir import Mission
from missionc.kernel.nodes import Kernel
from missionc.monitoring.monitor import monitor
from missionc.verify.certificate import Check, Figure


def check_requirements(mission: Mission, kernel: Kernel, trace: Trace) -> tuple[list[Check], list[Figure]]:
    """A check for each requirement, whose margin is the robustness; preferences bind nobody and are figures."""
    judgements = monitor(mission, kernel, trace)
    required, preferred = judgements[: len(kernel.requirements)], judgements[len(kernel.requirements) :]
    checks = [
        Check(
            name="requirement",
            subject=judgement.name,
            margin=judgement.robustness,
            unit="m",
            tolerance=0.0,
            passed=judgement.satisfied,
            at=None if judgement.step is None else judgement.step * mission.step,
            agents=judgement.agents,
            detail="judged at the steps by the monitor",
        )
        for judgement in required
    ]
    return checks, [Figure("preference", judgement.name, judgement.robustness, "m") for judgement in preferred]
