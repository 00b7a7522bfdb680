"""Resampling: a mission on a coarser clock, and a motion on that clock read on the mission's own."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from missionc.base.trace import Array, Trace
from missionc.base.units import Seconds, Steps
from missionc.ir import Mission, Objective
from missionc.world.dynamics import States, motion_of


def on_clock(mission: Mission, ticks: int) -> Mission:
    """The mission with ``ticks`` steps of equal length; nothing to prefer and nothing to make least."""
    step = Seconds(mission.horizon / ticks)
    return replace(mission, step=step, steps=Steps(ticks), preferences=(), objective=Objective.NONE)


def positions(mission: Mission, motion: Trace) -> Array:
    """Where a motion on any clock has the mission's agents at its own steps, (agents, steps + 1, dim), metres."""
    time = np.arange(mission.steps + 1) * mission.step
    last = motion.position.shape[1] - 2
    tick = np.clip(np.floor(time / motion.step).astype(np.int64), 0, last)
    since = (time - tick * motion.step)[:, None]
    position = np.zeros((len(mission.agents), len(time), mission.dimension))
    for agent in mission.agents:
        states = States(motion.position[agent.index], motion.velocity[agent.index])
        here, velocity, bend = motion_of(agent.dynamics, states.take(tick), states.take(tick + 1), motion.step)
        position[agent.index] = here + velocity * since + bend * since**2 / 2
    return position
