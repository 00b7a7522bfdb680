"""Vehicles: parameters that limit an agent's flight, and its yaw."""

from __future__ import annotations

import math
from typing import TypeAlias

from missionc.base.late_dataclass import Record
from missionc.base.units import Dimension


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
