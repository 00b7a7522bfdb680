"""Pads: takeoff and landing positions of agents, with hover heights and vertical speeds.

An agent with a pad takes off from the floor above its pad, flies to its start, flies its mission, returns above the
pad, and lands.
"""

from __future__ import annotations

import math

from missionc.base.late_dataclass import Record
from missionc.base.source import Span
from missionc.base.units import Dimension
from missionc.ir.shapes import Vector
from missionc.ir.vehicles import Figure


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
