"""Reports: positions of agents as received on the ground: noisy, late, or missing."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from missionc.base.trace import Array, Flags
from missionc.tools.closed_loop.scenario import Scenario

PERIOD = 0.1
"""Seconds between two reports of an agent."""


@dataclass(frozen=True, slots=True, eq=False)
class Report:
    """State of an agent at a time (s): position and velocity, (3,) in metres and m/s, and heading, rad."""

    agent: int
    time: float
    position: Array
    velocity: Array
    heading: float


class Reports:
    """Reports in transit to the ground."""

    def __init__(self, scenario: Scenario, random: np.random.Generator) -> None:
        self._scenario, self._random = scenario, random
        self._sent: list[tuple[float, Report]] = []

    def send(self, time: float, position: Array, velocity: Array, heading: Array, silent: Flags) -> None:
        """Send the states of all agents that are not silent: position and velocity (3, agents), m and m/s, heading
        (agents,), rad.
        """
        noise = self._scenario.noise * self._random.standard_normal(position.shape)
        arrives: Flags = np.asarray(self._random.random(position.shape[1]) >= self._scenario.dropped)
        late: Array = np.asarray(self._scenario.late * self._random.random(position.shape[1]))
        for agent in np.flatnonzero(arrives & ~silent).tolist():
            place = position[:, agent] + noise[:, agent]
            report = Report(agent, time, place, velocity[:, agent].copy(), float(heading[agent]))
            self._sent.append((time + float(late[agent]), report))

    def heard(self, time: float) -> list[Report]:
        """Reports that have arrived by now, in order of arrival."""
        arrived = sorted((each for each in self._sent if each[0] <= time), key=lambda each: each[0])
        self._sent = [each for each in self._sent if each[0] > time]
        return [report for _, report in arrived]
