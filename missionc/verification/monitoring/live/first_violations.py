"""First violations: the step at which online monitoring was first certain of a violated requirement.

in   Mission, Kernel, the flight so far
out  steps, by requirement name
"""

from __future__ import annotations

from missionc.base.trace import Trace
from missionc.ir import Mission
from missionc.ir.kernel.nodes import Kernel
from missionc.verification.monitoring.live.judge import LiveJudge
from missionc.verification.monitoring.live.verdicts import LiveVerdict


def first_violations(mission: Mission, kernel: Kernel, trace: Trace) -> dict[str, int]:
    """For each violated goal, by name, the first step from which no continuation within top speeds satisfies it."""
    judge, found = LiveJudge(mission, kernel), dict[str, int]()
    for step in range(trace.position.shape[1]):
        for standing in judge.advance(trace.position[:, step], trace.velocity[:, step], trace.heading[:, step]):
            if standing.verdict is LiveVerdict.VIOLATED:
                found.setdefault(standing.name, step)
    return found
