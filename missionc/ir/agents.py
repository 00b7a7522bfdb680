"""Agents: their dynamics, initial and final sets, and sets of agents.

Vehicles: parameters that limit an agent's flight, and its yaw.

Pads: takeoff and landing positions of agents, with hover heights and vertical speeds.

An agent with a pad takes off from the floor above its pad, flies to its start, flies its mission, returns above the
pad, and lands.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import TypeAlias

from missionc.base.late_dataclass import Record
from missionc.base.source import Span
from missionc.base.units import Dimension, Metres
from missionc.ir.dynamics import Dynamics
from missionc.ir.places import Box, Region, Shape, Vector


class Band(Record):
    """Range of numbers from ``low`` to ``high``, both included."""

    low: float
    high: float


class Vehicle(Record):
    """Parameters and limits of a vehicle, in SI units. An absent limit is infinite, an absent margin is 0.

    ``radius`` is the default for agents whose team sets none; read the radius from the agent. Two vehicles are in each
    other's downwash if the offset of their centres is shorter than 1 after scaling: horizontally by the sum of their
    ``downwash_radius``, vertically by the sum of their ``downwash_height``. For two equal vehicles, this condition is a
    length below 2 after scaling by one vehicle's half axes. A half axis of 0 means no downwash.
    """

    name: str
    radius: float = 0.1
    speed: float = math.inf
    vertical_speed: float = math.inf
    acceleration: float = math.inf
    jerk: float = math.inf
    tilt: float = math.inf
    thrust: Band = Band(0.0, math.inf)
    yaw_rate: float = math.inf
    height: Band = Band(-math.inf, math.inf)
    downwash_radius: float = 0.0
    downwash_height: float = 0.0
    pair_distance: float = 0.0
    tracking: float = 0.0
    fence_inset: float = 0.0
    start_skew: float = 0.0
    endurance: float = math.inf
    memory: int = 4096


PLAIN = Vehicle("plain")
"""Vehicle of a team that names none: the trajectory memory of a Crazyflie and no limits."""


class Figure(Record):
    """Format of a vehicle parameter: a limit (``<=``), a range (``..``) or a value (empty), with its description.

    Args:
        above: True if the parameter must exceed 0, False if 0 is allowed.
        whole: True for an integer.
        around: True if the range must contain 1.
    """

    dimension: Dimension
    relation: str
    says: str
    above: bool = False
    whole: bool = False
    around: bool = False


FIGURES: dict[str, Figure] = {
    "radius": Figure(Dimension.LENGTH, "", "body radius"),
    "speed": Figure(Dimension.SPEED, "<=", "horizontal speed", above=True),
    "vertical_speed": Figure(Dimension.SPEED, "<=", "vertical speed", above=True),
    "acceleration": Figure(Dimension.ACCELERATION, "<=", "acceleration in any direction", above=True),
    "jerk": Figure(Dimension.JERK, "<=", "change of acceleration per second", above=True),
    "tilt": Figure(Dimension.ANGLE, "<=", "angle of the thrust from vertical", above=True),
    "thrust": Figure(Dimension.NUMBER, "..", "thrust as a multiple of the weight", around=True),
    "yaw_rate": Figure(Dimension.TURN, "<=", "yaw rate", above=True),
    "height": Figure(Dimension.LENGTH, "..", "range of heights"),
    "downwash_radius": Figure(Dimension.LENGTH, "", "horizontal half axis of the downwash ellipsoid"),
    "downwash_height": Figure(Dimension.LENGTH, "", "vertical half axis of the downwash ellipsoid"),
    "pair_distance": Figure(Dimension.LENGTH, "", "required distance between centres, for any radii"),
    "tracking": Figure(Dimension.LENGTH, "", "largest tracking error"),
    "fence_inset": Figure(Dimension.LENGTH, "", "required distance from the borders of the world"),
    "start_skew": Figure(Dimension.TIME, "", "largest delay between the first and the last start"),
    "endurance": Figure(Dimension.TIME, "<=", "flight time on one charge", above=True),
    "memory": Figure(Dimension.NUMBER, "", "bytes for trajectories", above=True, whole=True),
}
"""Format of every parameter of a ``Vehicle`` except its name, in the order of its fields."""


class Fixed(Record):
    """Constant yaw: ``angle`` rad, counterclockwise from the x axis."""

    angle: float


class AlongPath(Record):
    """Yaw along the direction of motion."""


Yaw: TypeAlias = Fixed | AlongPath
AHEAD = Fixed(0.0)


class Pad(Record, eq=False):
    """Takeoff and landing pad of one agent, from the ``flight`` declaration.

    Args:
        point: x and y, metres; None: below the agent's start.
        hover: height after takeoff, metres; None: the height of the agent's start.
        rise: maximum climb speed, m/s, besides the vehicle's limit; infinite if only that limit applies.
        land: maximum descent speed, m/s, besides the vehicle's limit; infinite if only that limit applies.
        risen: mission time since takeoff, seconds, of an agent that is in the air and will land on the pad; None if the
            agent is on the pad.
    """

    point: Vector | None
    span: Span
    hover: float | None = None
    rise: float = math.inf
    land: float = math.inf
    risen: float | None = None


PAD_FIGURES: dict[str, Figure] = {
    "hover": Figure(Dimension.LENGTH, "", "hover height above the pad, after takeoff and before landing", above=True),
    "rise": Figure(Dimension.SPEED, "<=", "largest takeoff speed", above=True),
    "land": Figure(Dimension.SPEED, "<=", "largest landing speed", above=True),
}
"""Optional parameters of a pad besides its position, in the order of its fields."""


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
