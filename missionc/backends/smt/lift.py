"""Lifting of a joint motion on roadmaps to a trace."""

from __future__ import annotations

import numpy as np

from missionc.backends.smt.encode.lower_motion import Motion
from missionc.backends.smt.roadmap.faced import faced
from missionc.backends.smt.roadmap.roadmap import Indices
from missionc.base.trace import Array, Trace
from missionc.ir import Mission


def lift(states: Indices, motion: Motion, mission: Mission) -> Trace:
    """What the agents do that are in these states, (agents, steps + 1), each in its roadmap."""
    position = np.stack([motion.roadmap(agent).position[row] for agent, row in enumerate(states)])
    way = np.diff(position, axis=1)
    velocity = np.zeros_like(position)
    if motion.steps:
        velocity[:, :-1] = way / mission.step
        velocity[:, -1] = velocity[:, -2]
    for agent in mission.agents:
        if agent.dynamics.has_momentum:
            velocity[agent.index] = motion.roadmap(agent.index).velocity[states[agent.index]]
    return Trace(mission.step, position, velocity, _headings(states, way, motion))


def _headings(states: Indices, way: Array, motion: Motion) -> Array:
    """Where each agent faces when the motion from each step begins, (agents, steps + 1), rad.

    Along the motion; who stays turns to where its next state faces, or faces
    on. Before its first motion an agent faces as for it.
    """
    headings = np.zeros(states.shape)
    for agent, row in enumerate(states):
        known = np.append(faced(way[agent], motion.roadmap(agent).heading[row[1:]]), np.nan)
        given = np.flatnonzero(~np.isnan(known))
        if given.size:
            latest = np.maximum.accumulate(np.where(np.isnan(known), -1, np.arange(len(known))))
            headings[agent] = known[np.where(latest < 0, given[0], latest)]
    return headings
