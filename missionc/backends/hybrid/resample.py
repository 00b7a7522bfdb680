"""Resampling: a mission on a coarser clock and of first order, and a motion of that read on the mission's own clock."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from missionc.base.trace import Array, Trace
from missionc.base.units import Seconds, Steps
from missionc.ir import Dynamics, Mission, Objective
from missionc.ir.dynamics.single_integrator import of_first_order
from missionc.world.dynamics import States, motion_of

REST = 3
"""From one rest to the next an inert agent has so many ticks: so often its plan on the roadmap may turn a corner."""


def on_clock(mission: Mission, ticks: int) -> Mission:
    """The mission with ``ticks`` steps of equal length, its agents without momentum and heading.

    Nothing is preferred and nothing made least.
    """
    step = Seconds(mission.horizon / ticks)
    agents = tuple(replace(each, dynamics=first_order(each.dynamics, step)) for each in mission.agents)
    return replace(mission, agents=agents, step=step, steps=Steps(ticks), preferences=(), objective=Objective.NONE)


def first_order(dynamics: Dynamics, step: float) -> Dynamics:
    """Dynamics whose velocity may jump, at a pace that these can follow.

    Of an agent with momentum that is the mean speed of a way from rest to rest that takes ``REST`` steps.

    Args:
        step: seconds.
    """
    if not dynamics.has_momentum and not dynamics.faces_ahead:
        return dynamics
    speed, slowing = dynamics.top_speed, dynamics.top_acceleration * REST * step
    return of_first_order(slowing / 4 if slowing <= 2 * speed else speed - speed**2 / slowing)


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
