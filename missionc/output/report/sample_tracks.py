"""Sampling of trajectories on regular time grids."""

from __future__ import annotations

from dataclasses import dataclass, field

from missionc.base.trace import Array, Flags


@dataclass(frozen=True, slots=True, eq=False)
class Placed:
    """Sampled positions of all agents, ``rate`` per step, from 0 to the mission's end.

    Args:
        times: (samples,), seconds.
        position: (agents, samples, dim), metres.
        there: (agents, samples), mask of the agents that need separation; None for all agents at all times.
    """

    rate: int
    times: Array
    position: Array
    there: Flags | None = field(default=None, kw_only=True)


@dataclass(frozen=True, slots=True, eq=False)
class Sampled(Placed):
    """Sampled positions, velocities and accelerations of all agents.

    Args:
        velocity, acceleration: (agents, samples, dim), m/s and m/s².
    """

    velocity: Array
    acceleration: Array
