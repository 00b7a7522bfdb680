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
    """Positions of an agent's centre at the first step, or at the last: one point, or any of a region.

    Args:
        point: the one position, metres; None if there is a region.
        region: from which the compiler chooses a position; None if there is one point.
    """

    span: Span
    point: Vector | None = None
    region: Region | None = None

    @property
    def shape(self) -> Shape:
        """The set, metres; a box without extent if it is one point."""
        if self.point is not None:
            return Box(self.point, self.point)
        assert self.region is not None
        return self.region.shape

    def __str__(self) -> str:
        if self.region is not None:
            return f"in `{self.region.name}`"
        return f"at ({', '.join(f'{value:g}' for value in self.point or ())})"


class Agent(Record, eq=False):
    """One robot. ``name`` is ``drone[0]``, or ``truck7`` for an agent of its own.

    Args:
        begins: its state as the mission begins, where it is in motion then, as the rest of one that is being flown:
            (x, y, z, yaw), metres and rad, and their derivatives by seconds up to the fourth. Empty: it begins at rest.
        course: where it is at the steps, metres, where its motion is given and nobody plans it. Empty: it is free.
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
        """Its start, and its finish if it has one."""
        return (self.start,) if self.finish is None else (self.start, self.finish)


class AgentSet(Record, eq=False):
    """A team, a group, or one agent, by the name it was meant with."""

    name: str
    agents: tuple[int, ...]
    span: Span


def ends_by_region(ends: Iterable[tuple[Agent, InitialSet]]) -> dict[Region, list[tuple[Agent, InitialSet]]]:
    """The starts, or finishes, that are regions, with their agents, by the region."""
    found: dict[Region, list[tuple[Agent, InitialSet]]] = {}
    for agent, place in ends:
        if place.region is not None:
            found.setdefault(place.region, []).append((agent, place))
    return found
