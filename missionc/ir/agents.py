"""Agents: their dynamics, their starts and finishes, and sets of them."""

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
        point: the one position, metres; None if there is a region.
        region: the compiler chooses a position from it; None if there is one point.
    """

    span: Span
    point: Vector | None = None
    region: Region | None = None

    @property
    def shape(self) -> Shape:
        """The set as a shape, metres; a box without extent for one point."""
        if self.point is not None:
            return Box(self.point, self.point)
        assert self.region is not None
        return self.region.shape

    def __str__(self) -> str:
        if self.region is not None:
            return f"in `{self.region.name}`"
        return f"at ({', '.join(f'{value:g}' for value in self.point or ())})"


class Agent(Record, eq=False):
    """One robot.

    Its ``name`` is ``drone[0]`` for a member of a team, or for example ``truck7`` for a single agent.

    Args:
        begins: state at time 0 of an agent that is already in motion, for example of the rest of a running mission:
            (x, y, z, yaw), metres and rad, and their derivatives by time up to the fourth. Empty if it begins at rest.
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
        """The start, and the finish if there is one."""
        return (self.start,) if self.finish is None else (self.start, self.finish)


class AgentSet(Record, eq=False):
    """A team, a group or one agent, under the name in the mission."""

    name: str
    agents: tuple[int, ...]
    span: Span


def ends_by_region(ends: Iterable[tuple[Agent, InitialSet]]) -> dict[Region, list[tuple[Agent, InitialSet]]]:
    """Group the starts or finishes that are regions by region, each with its agent."""
    found: dict[Region, list[tuple[Agent, InitialSet]]] = {}
    for agent, place in ends:
        if place.region is not None:
            found.setdefault(place.region, []).append((agent, place))
    return found
