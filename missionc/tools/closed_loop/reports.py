"""Telemetry reports of the agents, as ground control receives them: with noise, delays and losses."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from missionc.base.trace import Array, Flags
from missionc.tools.closed_loop.scenario import Scenario

PERIOD = 0.1
"""Time between two reports of an agent, seconds."""


@dataclass(frozen=True, slots=True, eq=False)
class Report:
    """Reported state of an agent.

    Args:
        agent: index of the agent.
        time: time of the state, s.
        position, velocity: (3,), metres and m/s.
        heading: rad.
    """

    agent: int
    time: float
    position: Array
    velocity: Array
    heading: float


class Reports:
    """Reports on their way to the ground."""

    def __init__(self, scenario: Scenario, random: np.random.Generator) -> None:
        self._scenario, self._random = scenario, random
        self._sent: list[tuple[float, Report]] = []

    def send(self, time: float, position: Array, velocity: Array, heading: Array, silent: Flags) -> None:
        """Send the states of all agents that are not silent.

        Args:
            time: time of the states, s.
            position, velocity: (3, agents), m and m/s.
            heading: (agents,), rad.
            silent: (agents,), True for agents that send no report.
        """
        noise = self._scenario.noise * self._random.standard_normal(position.shape)
        arrives: Flags = np.asarray(self._random.random(position.shape[1]) >= self._scenario.dropped)
        late: Array = np.asarray(self._scenario.late * self._random.random(position.shape[1]))
        for agent in np.flatnonzero(arrives & ~silent).tolist():
            place = position[:, agent] + noise[:, agent]
            report = Report(agent, time, place, velocity[:, agent].copy(), float(heading[agent]))
            self._sent.append((time + float(late[agent]), report))

    def heard(self, time: float) -> list[Report]:
        """Remove and return the reports that arrived up to ``time``, in seconds, in order of arrival."""
        arrived = sorted((each for each in self._sent if each[0] <= time), key=lambda each: each[0])
        self._sent = [each for each in self._sent if each[0] > time]
        return [report for _, report in arrived]
