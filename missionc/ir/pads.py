"""Pads: where an agent stands before it rises and where it lands, how high and how fast.

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
    """What ``flight`` says of one agent.

    Args:
        point: x and y, metres; None below where the agent starts.
        hover: metres, up to which it rises; None at the height of its start.
        rise: m/s at most on the way up, beside what its vehicle may; infinite where that alone counts.
        land: likewise on the way down.
        risen: seconds that have passed of the mission since its agent rose from it: it is in the air, and comes back to
            it; None where it stands on it.
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
"""What may be said of a pad beside where it is, in the order of its fields."""
