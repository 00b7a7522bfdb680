"""Sampling of motions on even grids of time."""

from __future__ import annotations

from dataclasses import dataclass, field

from missionc.base.trace import Array, Flags


@dataclass(frozen=True, slots=True, eq=False)
class Placed:
    """``rate`` times to a step, the first at 0 and the last at the mission's end.

    Args:
        times: (samples,), seconds.
        position: (agents, samples, dim), metres.
        there: (agents, samples), who has to keep apart from others; None for everybody, always.
    """

    rate: int
    times: Array
    position: Array
    there: Flags | None = field(default=None, kw_only=True)


@dataclass(frozen=True, slots=True, eq=False)
class Sampled(Placed):
    """
    Args:
        velocity, acceleration: (agents, samples, dim), metres and seconds.
    """

    velocity: Array
    acceleration: Array
