"""A verified flight as a value, ready to be written in other formats."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass

from missionc.base.trace import Array, Trace
from missionc.curves.crazyflie_csv import Pieces, curves_of, read
from missionc.curves.piecewise_polynomials import Curves, values
from missionc.ir import Agent, Mission
from missionc.kernel.nodes import Kernel
from missionc.output.folder.file_names import file_names


@dataclass(frozen=True, slots=True, eq=False)
class Part:
    """One agent's part of a flight.

    Args:
        file: its file's name, without a suffix.
        robot: a name that ROS 2 takes: ASCII letters, digits and ``_``; no two alike.
        text: its polynomials as they were verified, byte for byte.
        pieces: what the text holds.
    """

    agent: Agent
    file: str
    robot: str
    text: str
    pieces: Pieces

    @property
    def first(self) -> tuple[float, float, float]:
        """Metres: where the polynomials begin."""
        x, y, z = self.pieces.coefficients[0, :3, 0].tolist()
        return (x, y, z)

    @property
    def last(self) -> tuple[float, float, float]:
        """Metres: where they end."""
        x, y, z = values(self.pieces.coefficients[-1, :3], self.pieces.duration[-1]).tolist()
        return (x, y, z)

    @property
    def yaw(self) -> float:
        """Radians, at the beginning."""
        return float(self.pieces.coefficients[0, 3, 0])


@dataclass(frozen=True, slots=True, eq=False)
class Flight:
    """Every agent's polynomials, in mission order, on one grid of times."""

    mission: Mission
    kernel: Kernel
    trace: Trace
    parts: tuple[Part, ...]

    @property
    def times(self) -> Array:
        """(pieces + 1,), seconds: the joints."""
        return self.parts[0].pieces.times

    @property
    def duration(self) -> float:
        return float(self.times[-1])

    @property
    def curves(self) -> Curves:
        """Where everybody is: x, y and z, of plane missions too."""
        return curves_of([each.pieces for each in self.parts], slice(0, 3))

    @property
    def yaws(self) -> Curves:
        """Likewise, the one coordinate yaw, radians."""
        return curves_of([each.pieces for each in self.parts], slice(3, 4))


def flight(mission: Mission, kernel: Kernel, trace: Trace, texts: Mapping[str, str]) -> Flight:
    """The flight of verified polynomials.

    Args:
        texts: each agent's file, by the agent's name.

    Raises:
        ValueError: a text does not hold polynomials.
    """
    files, robots = file_names(mission.agents), robot_names(mission)
    parts = []
    for agent in mission.agents:
        text = texts[agent.name]
        pieces = read(text)
        if isinstance(pieces, str):
            raise ValueError(f"{agent.name}: {pieces}")
        parts.append(Part(agent, files[agent.name], robots[agent.name], text, pieces))
    return Flight(mission, kernel, trace, tuple(parts))


def robot_names(mission: Mission) -> dict[str, str]:
    """What each agent is called in ROS 2, by the agent's name."""
    files = file_names(mission.agents)
    robots = _robots([files[agent.name] for agent in mission.agents])
    return {agent.name: robot for agent, robot in zip(mission.agents, robots, strict=True)}


def _robots(files: list[str]) -> list[str]:
    """ROS 2 names, as near to the files' names as can be."""
    names: list[str] = []
    for index, file in enumerate(files):
        name = re.sub(r"\W", "_", file, flags=re.ASCII)
        if not name[:1].isalpha() or name in names or (name != file and name in files):
            name = f"robot_{index}"
            while name in names or name in files:
                name += "_"
        names.append(name)
    return names
