"""First violations: the step of a run at which online monitoring was first certain that a requirement is violated.

in   Mission, Kernel, what was flown so far
out  steps, by the requirement's name
"""

from __future__ import annotations

from missionc.base.trace import Trace
from missionc.ir import Mission
from missionc.ir.kernel.nodes import Kernel
from missionc.verification.monitoring.live.judge import LiveJudge
from missionc.verification.monitoring.live.verdicts import LiveVerdict


def first_violations(mission: Mission, kernel: Kernel, trace: Trace) -> dict[str, int]:
    """By the names of goals that no continuation within the top speeds keeps any more, the first step of that."""
    judge, found = LiveJudge(mission, kernel), dict[str, int]()
    for step in range(trace.position.shape[1]):
        for standing in judge.advance(trace.position[:, step], trace.velocity[:, step], trace.heading[:, step]):
            if standing.verdict is LiveVerdict.VIOLATED:
                found.setdefault(standing.name, step)
    return found
