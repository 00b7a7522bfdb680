"""Sampling of motions on even grids of time."""

from __future__ import annotations

from dataclasses import dataclass

from missionc.base.trace import Array


@dataclass(frozen=True, slots=True, eq=False)
class Placed:
    """``rate`` times to a step, the first at 0 and the last at the mission's end.

    Args:
        times: (samples,), seconds.
        position: (agents, samples, dim), metres.
    """

    rate: int
    times: Array
    position: Array


@dataclass(frozen=True, slots=True, eq=False)
class Sampled(Placed):
    """
    Args:
        velocity, acceleration: (agents, samples, dim), metres and seconds.
    """

    velocity: Array
    acceleration: Array
