"""Conversion of a joint motion on roadmaps to a trace."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from missionc.backends.smt.roadmap.labels import faced
from missionc.backends.smt.roadmap.roadmap import Roadmap
from missionc.base.trace import Array, Indices, Trace
from missionc.ir import Mission


def lift(states: Indices, roadmaps: Sequence[Roadmap], mission: Mission) -> Trace:
    """Trace of agents in the given states, (agents, steps + 1), each in its own roadmap."""
    position = np.stack([roadmap.position[row] for roadmap, row in zip(roadmaps, states, strict=True)])
    way = np.diff(position, axis=1)
    velocity = np.zeros_like(position)
    if len(way[0]):
        velocity[:, :-1] = way / mission.step
        velocity[:, -1] = velocity[:, -2]
    for agent in mission.agents:
        if agent.dynamics.has_momentum:
            velocity[agent.index] = roadmaps[agent.index].velocity[states[agent.index]]
    return Trace(mission.step, position, velocity, _headings(states, way, roadmaps))


def _headings(states: Indices, way: Array, roadmaps: Sequence[Roadmap]) -> Array:
    """Heading of each agent at the beginning of each step, (agents, steps + 1), rad.

    The heading is the direction of motion. A waiting agent turns to the heading of its next state, or keeps its own.
    Before its first motion it has the heading of that motion. ``way`` are the movements, (agents, steps, dim), metres.
    """
    headings = np.zeros(states.shape)
    for agent, row in enumerate(states):
        known = np.append(faced(way[agent], roadmaps[agent].heading[row[1:]]), np.nan)
        given = np.flatnonzero(~np.isnan(known))
        if given.size:
            latest = np.maximum.accumulate(np.where(np.isnan(known), -1, np.arange(len(known))))
            headings[agent] = known[np.where(latest < 0, given[0], latest)]
    return headings
