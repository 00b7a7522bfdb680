"""Phases of a whole flight, from the floor to the floor: how long each lasts, so that nobody is faster than it may.

The firmware rises and sinks on the polynomial of degree 7 that begins and ends at rest, without acceleration and jerk.

Source:
    crazyflie-firmware, planner.c (``plan_takeoff``, ``plan_land``) and pptraj.c (``piecewise_plan_7th_order_no_jerk``).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from missionc.ir import Agent
from missionc.world.columns import FLOOR

RISE, SETTLE, GO, SINK = 3.0, 2.0, 4.0, 4.0
"""Seconds: to take off and to land at least, to hover quietly, to go to the first point."""
LANDED = 0.04
"""Metres: the height to which they sink before their motors stop."""
SPEED, ACCELERATION = 35 / 16, 7.514
"""The largest speed and acceleration of the polynomial, over 1 m in 1 s: m/s; m/s², rounded up."""
REST_TO_REST = (0.0, 0.0, 0.0, 0.0, 35.0, -84.0, 70.0, -20.0)
"""The polynomial of the firmware, from 0 to 1 in 1 s: ascending powers."""


@dataclass(frozen=True, slots=True)
class Phases:
    """Seconds of each phase, the same for everybody; ``duration`` is that of the polynomials.

    All rise, and sink, in so many ``rounds``, each of which takes so long. Where all are in the air when it begins,
    ``rise`` is 0, and nobody hovers before the polynomials.
    """

    rise: float
    settle: float
    go: float
    duration: float
    sink: float
    rounds: int = 1

    @property
    def hover(self) -> float:
        """Seconds from the last one to have risen to the beginning of the polynomials."""
        return self.settle + self.go + self.settle if self.rise else 0.0

    @property
    def before(self) -> float:
        """Seconds from the take-off to the beginning of the polynomials."""
        return self.rounds * self.rise + self.hover

    @property
    def whole(self) -> float:
        """Seconds from the floor to the floor, or from the air."""
        return self.before + self.duration + self.settle + self.rounds * self.sink


def phases_of(
    agents: Sequence[Agent],
    up: Sequence[float],
    down: Sequence[float],
    duration: float,
    rounds: int = 1,
    risen: bool = False,
    bottom: float = LANDED,
) -> Phases:
    """How long a flight takes in each phase.

    Args:
        risen: whether all are in the air already.
        bottom: metres, the height to which they sink.
        up, down: metres, by agent: the heights to which they rise, and from which they sink.
        duration: seconds of the polynomials.
    """
    rise = max(_seconds(height - FLOOR, agent, _rise(agent)) for agent, height in zip(agents, up, strict=True))
    sink = max(landing_seconds(agent, height, bottom) for agent, height in zip(agents, down, strict=True))
    return Phases(0.0 if risen else max(rise, RISE), SETTLE, GO, duration, sink, rounds)


def landing_seconds(agent: Agent, height: float, bottom: float = LANDED) -> float:
    """Duration of a landing from a height in metres to another."""
    return max(_seconds(height - bottom, agent, math.inf if agent.pad is None else agent.pad.land), SINK)


def rest_to_rest(distance: float, speed: float, acceleration: float) -> float:
    """Seconds that the polynomial takes over a distance in metres, within a speed and an acceleration."""
    return max(SPEED * abs(distance) / speed, math.sqrt(ACCELERATION * abs(distance) / acceleration))


def _rise(agent: Agent) -> float:
    """m/s: what the mission wants on the way up."""
    return math.inf if agent.pad is None else agent.pad.rise


def _seconds(height: float, agent: Agent, wanted: float) -> float:
    """For so many metres, no faster than the mission wants and its vehicle may, rounded up to a tenth."""
    speed = min(agent.vehicle.vertical_speed, wanted)
    return math.ceil(10 * rest_to_rest(height, speed, agent.vehicle.acceleration) - 1e-9) / 10
