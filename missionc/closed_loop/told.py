"""Uploads: the polynomials that each agent is told to fly, by its own clock.

in   uploads, each with the time from which it is flown
out  setpoints of all agents over a stretch of time
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from missionc.base.trace import Array
from missionc.curves.crazyflie_csv import Pieces
from missionc.simulate.firmware_setpoints import ACCELERATION, POSITION, RATES, VELOCITY, setpoints


@dataclass(slots=True, eq=False)
class _Agent:
    """One agent's uploads, the first one first, and how its trajectory time runs: ``rate`` from ``since`` on."""

    uploads: list[tuple[float, Pieces]]
    skew: float
    rate: float = 1.0
    since: float = 0.0
    gone: float = 0.0
    current: int = field(default=0)


class Told:
    """Everybody's uploads.

    Args:
        pieces: what each flies from time 0 on.
        skew: (agents,), seconds by which each clock is late.
    """

    def __init__(self, pieces: list[Pieces], skew: Array) -> None:
        self._agents = [_Agent([(0.0, own)], float(late)) for own, late in zip(pieces, skew, strict=True)]

    def upload(self, agent: int, pieces: Pieces, begins: float) -> None:
        """From then on, seconds, the agent flies these; what it was to fly after that is forgotten."""
        own = self._agents[agent]
        own.uploads = [each for each in own.uploads if each[0] < begins] + [(begins, pieces)]

    def slow(self, agent: int, rate: float, time: float) -> None:
        """From then on the agent's trajectories run at that rate."""
        own = self._agents[agent]
        own.gone += own.rate * (time - own.since)
        own.since, own.rate = time, rate

    def setpoints(self, times: Array) -> Array:
        """(times,), seconds, none of them beyond the next upload's reach -> (13, times, agents)."""
        return np.stack([self._of(own, times) for own in self._agents], axis=-1)

    def _of(self, own: _Agent, times: Array) -> Array:
        shifted = times - own.skew
        latest = max(index for index, (begins, _) in enumerate(own.uploads) if begins <= shifted[0] or index == 0)
        begins, pieces = own.uploads[latest]
        if latest != own.current:
            own.current, own.since, own.gone = latest, begins, 0.0
        local = own.gone + own.rate * (shifted - own.since)
        reference = setpoints(pieces, local)
        if own.rate != 1.0:
            reference[VELOCITY] *= own.rate
            reference[ACCELERATION] *= own.rate**2
            reference[RATES] *= own.rate
        return reference

    def wanted(self, agent: int, time: float) -> Array:
        """(3,), metres: where the ground believes that the agent is to be."""
        own = self._agents[agent]
        begins, pieces = [each for index, each in enumerate(own.uploads) if each[0] <= time or index == 0][-1]
        return np.asarray(setpoints(pieces, np.array([time - begins]))[POSITION, 0])
