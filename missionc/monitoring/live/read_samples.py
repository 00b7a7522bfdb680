"""Reader of samples: one line of JSON to what it says of agents.

in   a line, the Mission
out  samples, or why there are none
"""

from __future__ import annotations

import math
from typing import Any

from missionc.base.limits import Limits
from missionc.base.strict_json import NotJsonError, parse_record
from missionc.ir import Mission
from missionc.kernel.analysis import agents_asked
from missionc.kernel.nodes import Atom, Kernel
from missionc.kernel.walk import postorder
from missionc.monitoring.live.samples import Sample


class UnusableError(ValueError):
    """A line that says nothing that can be used; the text says why."""


class SampleReader:
    """Reads lines such as ``{"t": 1.25, "agent": "drone[0]", "position": [1, 2], "velocity": [0, 1], "heading": 0.5}``.

    In the place of ``agent`` and ``position``, ``agents`` may hold the positions of several, by their names. A
    velocity is needed of agents of which the mission asks for the speed, a heading where it asks for headings. A
    mission in the plane leaves a third coordinate out, and ``flattened`` is true from then on.
    """

    def __init__(self, mission: Mission, kernel: Kernel, limits: Limits | None = None) -> None:
        self.dimension, self.magnitude = mission.dimension, (limits or Limits()).magnitude
        self.flattened = False
        self.index = {agent.name: agent.index for agent in mission.agents}
        self.needs_velocity: set[int] = set()
        self.needs_heading: set[int] = set()
        for goal in kernel.goals:
            reads = [node for node in postorder((goal.formula,)) if isinstance(node, Atom)]
            if any(node.predicate.reads_speed or node.predicate.reads_heading for node in reads):
                asked = agents_asked(goal.formula)
                for node in reads:
                    if node.predicate.reads_speed:
                        self.needs_velocity |= asked[node]
                    if node.predicate.reads_heading:
                        self.needs_heading |= asked[node]

    def read(self, line: str) -> list[Sample]:
        """What a line says.

        Raises:
            UnusableError: nothing that can be used.
        """
        try:
            record = parse_record(line)
        except NotJsonError as error:
            raise UnusableError(error.reason) from None
        time = self._number(record.get("t"), "`t`")
        if "agents" in record:
            agents = record["agents"]
            if not isinstance(agents, dict):
                raise UnusableError("`agents` is no record of positions by the names of agents")
            return [self._sample(name, time, {"position": position}) for name, position in agents.items()]
        return [self._sample(record.get("agent"), time, record)]

    def _sample(self, name: Any, time: float, record: dict[str, Any]) -> Sample:
        if not isinstance(name, str):
            raise UnusableError("`agent` is no name of an agent")
        if name not in self.index:
            raise UnusableError(f"the mission has no agent `{name[:40]}`")
        agent = self.index[name]
        position = self._vector(record.get("position"), "position", name)
        velocity: tuple[float, ...] = ()
        if record.get("velocity") is not None:
            velocity = self._vector(record["velocity"], "velocity", name)
        elif agent in self.needs_velocity:
            raise UnusableError(f"nothing is said of the velocity of `{name}`, whose speed the mission asks for")
        heading = math.nan
        if record.get("heading") is not None:
            heading = self._number(record["heading"], f"`heading` of `{name}`")
        elif agent in self.needs_heading:
            raise UnusableError(f"nothing is said of where `{name}` faces, which the mission asks for")
        return Sample(agent, time, position, velocity, heading)

    def _vector(self, value: Any, key: str, name: str) -> tuple[float, ...]:
        if not isinstance(value, list) or len(value) not in (self.dimension, 3):
            raise UnusableError(f"`{key}` of `{name}` is no list of {self.dimension} numbers")
        self.flattened |= len(value) > self.dimension
        return tuple(self._number(each, f"`{key}` of `{name}`") for each in value)[: self.dimension]

    def _number(self, value: Any, what: str) -> float:
        if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
            raise UnusableError(f"{what} is no finite number")
        if abs(value) > self.magnitude:
            raise UnusableError(f"{what} is {value:g}; the largest number may be {self.magnitude:g}")
        return float(value)
