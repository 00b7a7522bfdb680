"""Agents: their dynamics, their starts and finishes, and sets of them."""

from __future__ import annotations

from typing import TypeAlias

from missionc.base.late_dataclass import Record
from missionc.base.source import Span
from missionc.base.units import Metres
from missionc.ir.dynamics import Dynamics
from missionc.ir.pads import Pad
from missionc.ir.places import Region
from missionc.ir.shapes import Vector
from missionc.ir.vehicles import AHEAD, PLAIN, Vehicle, Yaw


class Anywhere(Record):
    """A place in a region, for the compiler to choose."""

    region: Region
    span: Span


class Exactly(Record):
    point: Vector
    span: Span


Place: TypeAlias = Anywhere | Exactly


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
    start: Place
    finish: Place | None
    altitude: Metres
    span: Span
    vehicle: Vehicle = PLAIN
    yaw: Yaw = AHEAD
    pad: Pad | None = None
    begins: tuple[Vector, ...] = ()
    course: tuple[Vector, ...] = ()


class AgentSet(Record, eq=False):
    """A team, a group, or one agent, by the name it was meant with."""

    name: str
    agents: tuple[int, ...]
    span: Span
