"""Pads: takeoff and landing places of agents, with heights and speeds.

An agent with a pad flies from the floor to the floor: up above its pad, to its start, its mission, back above the pad,
and down.
"""

from __future__ import annotations

import math

from missionc.base.late_dataclass import Record
from missionc.base.source import Span
from missionc.base.units import Dimension
from missionc.ir.shapes import Vector
from missionc.ir.vehicles import Figure


class Pad(Record, eq=False):
    """Pad of one agent, as the ``flight`` declaration gives it.

    Args:
        point: x and y, metres; None: below the agent's start.
        hover: metres, height after takeoff; None: the height of its start.
        rise: maximum climb speed, m/s, besides its vehicle's limit; infinite if only that limit applies.
        land: likewise for the descent.
        risen: seconds of mission time since the agent took off: it is in the air and will land here; None if it is on
            the pad.
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
"""Optional figures of a pad besides its position, in the order of its fields."""
