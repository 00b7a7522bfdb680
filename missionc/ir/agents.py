"""Agents: their dynamics, initial and final sets, and sets of agents."""

from __future__ import annotations

from collections.abc import Iterable

from missionc.base.late_dataclass import Record
from missionc.base.source import Span
from missionc.base.units import Metres
from missionc.ir.dynamics import Dynamics
from missionc.ir.pads import Pad
from missionc.ir.places import Region
from missionc.ir.shapes import Box, Shape, Vector
from missionc.ir.vehicles import AHEAD, PLAIN, Vehicle, Yaw


class InitialSet(Record):
    """Set of allowed positions of an agent's centre at the first or the last step: one point or a region.

    Args:
        point: the only allowed position, metres; None if the set is a region.
        region: region from which the compiler chooses a position; None if the set is one point.
    """

    span: Span
    point: Vector | None = None
    region: Region | None = None

    @property
    def shape(self) -> Shape:
        """Set of allowed positions as a shape, metres; for one point, a box without extent."""
        if self.point is not None:
            return Box(self.point, self.point)
        assert self.region is not None
        return self.region.shape

    def __str__(self) -> str:
        if self.region is not None:
            return f"in `{self.region.name}`"
        return f"at ({', '.join(f'{value:g}' for value in self.point or ())})"


class Agent(Record, eq=False):
    """Robot of the mission, with its body, dynamics, start and finish.

    Args:
        name: ``drone[0]`` for a member of a team, or for example ``truck7`` for a single agent.
        radius: body radius, metres; ``altitude`` is the flight altitude in a plane mission, metres.
        begins: state at time 0 of an agent that is already in motion: (x, y, z, yaw), metres and rad, and its time
            derivatives up to the fourth. Empty if the agent begins at rest.
        course: given positions at the steps, metres, of an agent that is not planned. Empty for a planned agent.
    """

    index: int
    name: str
    team: str
    radius: Metres
    dynamics: Dynamics
    start: InitialSet
    finish: InitialSet | None
    altitude: Metres
    span: Span
    vehicle: Vehicle = PLAIN
    yaw: Yaw = AHEAD
    pad: Pad | None = None
    begins: tuple[Vector, ...] = ()
    course: tuple[Vector, ...] = ()

    @property
    def ends(self) -> tuple[InitialSet, ...]:
        """Set of allowed start positions, followed by the set of allowed finish positions if the agent has a finish."""
        return (self.start,) if self.finish is None else (self.start, self.finish)


class AgentSet(Record, eq=False):
    """Team, group or single agent under its name in the mission; ``agents`` are mission indices."""

    name: str
    agents: tuple[int, ...]
    span: Span


def ends_by_region(ends: Iterable[tuple[Agent, InitialSet]]) -> dict[Region, list[tuple[Agent, InitialSet]]]:
    """Starts or finishes that are regions, grouped by region, each with its agent."""
    found: dict[Region, list[tuple[Agent, InitialSet]]] = {}
    for agent, place in ends:
        if place.region is not None:
            found.setdefault(place.region, []).append((agent, place))
    return found
