"""Uploads: the polynomials that each agent is told to fly, by its own clock.

in   uploads, each with the time from which it is flown
out  setpoints of all agents over a stretch of time

An agent that has become slow stays on its trajectory, and falls behind wherever that is faster than it can go.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from missionc.base.trace import Array, Trace
from missionc.curves.crazyflie_csv import Pieces
from missionc.simulate.firmware_setpoints import ACCELERATION, POSITION, RATES, VELOCITY, setpoints


@dataclass(slots=True, eq=False)
class _Agent:
    """One agent's uploads, the first one first; how fast it still is, m/s; and by how much it is behind, s."""

    uploads: list[tuple[float, Pieces]]
    skew: float
    most: float = math.inf
    behind: float = 0.0
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

    def slow(self, agent: int, most: float) -> None:
        """The agent goes no faster than so many m/s from now on."""
        self._agents[agent].most = most

    def setpoints(self, times: Array) -> Array:
        """(times,), seconds, evenly apart, later than all before and not beyond the next upload's reach
        -> (13, times, agents)."""
        return np.stack([self._of(own, times) for own in self._agents], axis=-1)

    def _of(self, own: _Agent, times: Array) -> Array:
        shifted = times - own.skew
        latest = max(index for index, (begins, _) in enumerate(own.uploads) if begins <= shifted[0] or index == 0)
        begins, pieces = own.uploads[latest]
        if latest != own.current:
            own.current, own.behind = latest, 0.0
        local = shifted - begins
        if math.isinf(own.most):
            return setpoints(pieces, local)
        period = float(times[1] - times[0]) if times.size > 1 else 0.0
        columns = []
        for moment in local:
            wanted = setpoints(pieces, np.array([moment - own.behind]))
            fast = float(np.linalg.norm(wanted[VELOCITY]))
            rate = min(1.0, own.most / fast) if fast > 0 else 1.0
            own.behind += (1.0 - rate) * period
            for row, power in ((VELOCITY, 1), (ACCELERATION, 2), (RATES, 1)):
                wanted[row] *= rate**power
            columns.append(wanted)
        return np.concatenate(columns, axis=1)

    def wanted(self, agent: int, time: float) -> Array:
        """(3,), metres: where the ground believes that the agent is to be."""
        return np.asarray(self.way(agent, np.array([time]))[0])

    def way(self, agent: int, times: Array) -> Array:
        """(times,), seconds -> (times, 3), metres: likewise at each of them, by all uploads so far."""
        own = self._agents[agent]
        latest = np.maximum(np.searchsorted([begins for begins, _ in own.uploads], times, side="right") - 1, 0)
        places = np.empty((times.size, 3))
        for number in np.unique(latest).tolist():
            begins, pieces = own.uploads[number]
            places[latest == number] = setpoints(pieces, times[latest == number] - begins)[POSITION].T
        return places


def uploaded(told: Told, plan: Trace) -> Trace:
    """Where everybody is told to be at the steps of the whole flight, by all that was uploaded so far.

    Args:
        plan: the first one, of the whole mission.
    """
    agents, steps, dimension = plan.position.shape
    times = float(plan.step) * np.arange(steps, dtype=np.float64)
    position = np.stack([told.way(agent, times)[:, :dimension] for agent in range(agents)])
    return Trace(plan.step, position, np.gradient(position, float(plan.step), axis=1), plan.heading)
