"""A verified flight as a value, for export to other formats."""

from __future__ import annotations

import re
from collections.abc import Mapping

import numpy as np

from missionc.base.late_dataclass import Record
from missionc.base.trace import Array, Trace
from missionc.geometry.curves.piecewise_polynomials import Curves, Pieces, curves_of, read, values, written
from missionc.ir import Agent, Mission
from missionc.ir.kernel.nodes import Kernel
from missionc.output.folder.file_names import file_names
from missionc.verification.certificate import Certificate
from missionc.verification.flight.verify_whole_flight import verify_whole_flight
from missionc.verification.flight.way_missions import Stage, Ways
from missionc.verification.verify_plan import verify_polynomials


class Part(Record, eq=False):
    """Trajectory of one agent in a verified flight.

    Args:
        file: name of its file, without a suffix.
        robot: unique name for ROS 2: ASCII letters, digits and ``_``.
        text: its polynomials as they were verified, byte for byte.
        pieces: contents of the text.
    """

    agent: Agent
    file: str
    robot: str
    text: str
    pieces: Pieces

    @property
    def first(self) -> tuple[float, float, float]:
        """First point of the polynomials, metres."""
        x, y, z = self.pieces.coefficients[0, :3, 0].tolist()
        return (x, y, z)

    @property
    def last(self) -> tuple[float, float, float]:
        """Last point of the polynomials, metres."""
        x, y, z = values(self.pieces.coefficients[-1, :3], self.pieces.duration[-1]).tolist()
        return (x, y, z)

    @property
    def yaw(self) -> float:
        """Yaw at the beginning of the polynomials, rad."""
        return float(self.pieces.coefficients[0, 3, 0])


class Flight(Record, eq=False):
    """Verified polynomials of every agent, in mission order, with common joints.

    Args:
        before: seconds before the mission begins; 0 if there are none.
        ways: transfers in it, before and after the mission.
        texts: polynomials of the mission alone, by the agent's name.
        in_flight: True if all agents are in the air when it begins.
    """

    mission: Mission
    kernel: Kernel
    trace: Trace
    parts: tuple[Part, ...]
    texts: Mapping[str, str]
    ways: Ways
    before: float = 0.0
    in_flight: bool = False

    @property
    def times(self) -> Array:
        """Times at which the polynomial pieces meet, (pieces + 1,), seconds."""
        return self.parts[0].pieces.times

    @property
    def duration(self) -> float:
        return float(self.times[-1])

    @property
    def curves(self) -> Curves:
        """Trajectories of all agents with x, y and z, in plane missions too."""
        return curves_of([each.pieces for each in self.parts], slice(0, 3))

    @property
    def yaws(self) -> Curves:
        """Yaw of all agents, rad, as curves with one coordinate."""
        return curves_of([each.pieces for each in self.parts], slice(3, 4))

    def judged(self, pieces: Mapping[str, Pieces]) -> Certificate:
        """Certificate for other polynomials in place of these, with the same number of pieces, by the agent's name."""
        sections: dict[Stage | None, dict[str, str]] = {}
        for each in self.parts:
            begin = 0
            for stage, size in _sizes(self, each.agent.name):
                own, end = pieces[each.agent.name], begin + size
                part = Pieces(own.duration[begin:end], own.coefficients[begin:end])
                sections.setdefault(stage, {})[each.agent.name] = written(part)
                begin = end
        flown = sections.pop(None)
        certificate = verify_polynomials(self.mission, self.kernel, self.trace, flown)
        if not self.ways or not all(check.passed for check in certificate.checks if check.name == "file"):
            return certificate
        ways = {stage: texts for stage, texts in sections.items() if stage is not None}
        return certificate.joined(verify_whole_flight(self.mission, flown, ways))


def _sizes(flight: Flight, name: str) -> list[tuple[Stage | None, int]]:
    """Number of pieces of an agent's polynomials in the outbound transfer, the mission (None) and the return
    transfer.
    """
    stages: list[tuple[Stage | None, str]] = []
    for stage in (Stage.OUT, None, Stage.HOME):
        texts = flight.texts if stage is None else flight.ways.get(stage)
        if texts is not None:
            stages.append((stage, texts[name]))
    # A header, and the end of the last line.
    return [(stage, text.count("\n") - 1) for stage, text in stages]


def flight(
    mission: Mission,
    kernel: Kernel,
    trace: Trace,
    texts: Mapping[str, str],
    ways: Ways | None = None,
    in_flight: bool = False,
) -> Flight:
    """Verified polynomials as a flight, with the transfers before and after the mission.

    Args:
        texts: file of each agent, by the agent's name.
        in_flight: True if it begins in the air, after an earlier flight.

    Raises:
        ValueError: a text does not contain polynomials.
    """
    ways = ways or {}
    files, robots = file_names(mission.agents), robot_names(mission)
    parts, before = [], 0.0
    for agent in mission.agents:
        own = [_read(agent, texts[agent.name])]
        if Stage.OUT in ways:
            own.insert(0, _read(agent, ways[Stage.OUT][agent.name]))
            before = float(own[0].times[-1])
        if Stage.HOME in ways:
            own.append(_read(agent, ways[Stage.HOME][agent.name]))
        pieces = Pieces(
            np.concatenate([each.duration for each in own]), np.concatenate([each.coefficients for each in own])
        )
        text = written(pieces) if ways else texts[agent.name]
        parts.append(Part(agent, files[agent.name], robots[agent.name], text, pieces))
    return Flight(mission, kernel, trace, tuple(parts), texts, ways, before, in_flight)


def _read(agent: Agent, text: str) -> Pieces:
    pieces = read(text)
    if isinstance(pieces, str):
        raise ValueError(f"{agent.name}: {pieces}")
    return pieces


def robot_names(mission: Mission) -> dict[str, str]:
    """ROS 2 name of each agent, by the agent's name."""
    files = file_names(mission.agents)
    robots = _robots([files[agent.name] for agent in mission.agents])
    return {agent.name: robot for agent, robot in zip(mission.agents, robots, strict=True)}


def _robots(files: list[str]) -> list[str]:
    """Unique ROS 2 names, as similar to the files' names as possible."""
    names: list[str] = []
    for index, file in enumerate(files):
        name = re.sub(r"\W", "_", file, flags=re.ASCII)
        if not name[:1].isalpha() or name in names or (name != file and name in files):
            name = f"robot_{index}"
            while name in names or name in files:
                name += "_"
        names.append(name)
    return names
