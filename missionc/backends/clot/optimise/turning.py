"""Residuals of bounded turning: excess turns of agents that move along their heading.

A resting agent continues to turn. The bound therefore applies to the angle between any two steps in motion, in
proportion to the number of steps between them. The excess angle counts as lateral metres, which vanish at rest, so that
resting is one method of turning. ``pursuit`` removes remaining excess in tiny steps.

Source:
    [strel] Experiment Setup, the unicycle.
"""

from __future__ import annotations

import math

import numpy as np

from missionc.backends.clot.optimise.control_points import Arguments, Splines
from missionc.backends.clot.optimise.dual_numbers import Values
from missionc.backends.clot.optimise.task_residuals import norm
from missionc.base.late_dataclass import Record
from missionc.base.trace import Array
from missionc.geometry.dynamics import turn_in_step
from missionc.ir import Mission

TURN = "turn"
"""Name of the residual group of turning."""


class Turns(Record, eq=False):
    """Pairs of steps of one agent with a maximum turn between them.

    Args:
        pair: velocities in both steps, (pairs,) each.
        most: maximum turn, (pairs,), rad.
    """

    pair: tuple[Arguments, Arguments]
    most: Array

    def excess(self, one: Values, other: Values, share: float) -> Values:
        """Excess turn as lateral metres, (pairs,), from the movements in both steps, (pairs, dim), metres.

        Args:
            share: fraction of the allowed turn that is reserved as margin.
        """
        still = 1e-6  # metres; an agent that moves less in a step does not turn in it
        one, other = one[:, :2], other[:, :2]
        first, second = norm(one), norm(other)
        moving = ((first > still) & (second > still))[:, None]
        ahead = np.array([1.0, 0.0])
        here, there = np.where(moving, one, ahead), np.where(moving, other, ahead)
        dot = (here * there).sum(axis=1)
        cross = here[:, 0] * there[:, 1] - here[:, 1] * there[:, 0]
        angle = np.arctan2(np.where(cross < 0, -cross, cross), dot)  # at a half turn too, the gradient is not 0
        return 2 * first * second / (first + second) * (angle - self.most * (1 - share))


def turns(mission: Mission, made: Splines) -> Turns:
    """Pairs of steps with a maximum turn, for all agents of a mission that turn slowly."""
    agents, earlier, apart, most = (list[int](), list[int](), list[int](), list[float]())
    for agent in mission.agents:
        limit = turn_in_step(agent.dynamics, made.step)
        if math.isinf(limit):
            continue
        for steps in range(1, min(math.ceil(math.pi / limit), made.steps)):
            count = made.steps - steps
            agents += [agent.index] * count
            earlier += range(count)
            apart += [steps] * count
            most += [steps * limit] * count
    agent_of, step_of = np.array(agents, dtype=np.int64), np.array(earlier, dtype=np.int64)
    later = step_of + np.array(apart, dtype=np.int64)
    pair = made.velocity(agent_of, step_of), made.velocity(agent_of, later)
    return Turns(pair, np.array(most))
