"""Constraints of a flight that goes on: each step when it is settled.

in   Mission, samples as they come, the team's state at each step
out  Constraint: what is violated for the first time; at the end the verdicts
"""

from __future__ import annotations

import math

import numpy as np

from missionc.base.constraint import Constraint
from missionc.ir import Mission
from missionc.monitoring.live.samples import Sample, StepState
from missionc.verify.recorded.constraint_judge import ConstraintJudge
from missionc.verify.recorded.state_margins import States


class LiveConstraints(ConstraintJudge):
    """The constraints of one mission while it is flown; work and memory do not grow with its length.

    A velocity or heading of an agent counts as recorded as long as every sample of it has one.
    """

    def __init__(self, mission: Mission, tolerance: float = 0.0) -> None:
        super().__init__(mission, tolerance)
        self.recorded = np.ones((2, len(mission.agents)), dtype=np.bool_)

    def hear(self, sample: Sample) -> None:
        """Take note of what a sample records."""
        self.recorded[:, sample.agent] &= bool(sample.velocity), not math.isnan(sample.heading)

    def judge_step(self, state: StepState) -> list[Constraint]:
        """Judge a step; what is violated for the first time."""
        arrays = (state.position, state.velocity, state.heading, state.doubt)
        position, velocity, heading, doubt = (each[:, None] for each in arrays)
        return self.take(States(state.step, position, velocity, heading, doubt, *self.recorded))
