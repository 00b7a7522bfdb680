"""Take-off and landing, outside the polynomials: vehicles rise to their first points and sink from their last.

Each goes straight up and down in a column of its own, clear of everything that stands, as fast as its profile allows,
and is on the floor again before its battery is empty. Where that cannot be, a form that flies so is refused.

The firmware rises and sinks on the polynomial of degree 7 that begins and ends at rest, without acceleration and jerk.

Source:
    crazyflie-firmware, planner.c (``plan_takeoff``, ``plan_land``) and pptraj.c (``piecewise_plan_7th_order_no_jerk``).
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from itertools import combinations

import numpy as np

from missionc.base.trace import Array
from missionc.curves.crazyflie_csv import Pieces
from missionc.curves.piecewise_polynomials import speed_bounds, values
from missionc.diagnostics.model import Diagnostic
from missionc.ir import Mission, Obstacle, Vector, Vehicle
from missionc.output.export.export_form import refused
from missionc.output.export.verified_flight import Flight, Part
from missionc.verify.tolerances import WAYPOINT
from missionc.world.displacement import displaced, moved
from missionc.world.signed_distance import signed_distance

GROUND = 0.0
"""Metres: where the vehicles stand before they take off."""
RISE, SETTLE, GO, SINK = 3.0, 2.0, 4.0, 4.0
"""Seconds: to take off and to land at least, to hover quietly, to go to the first point."""
LANDED = 0.04
"""Metres: the height to which they sink before their motors stop."""
NEAR = 0.1
"""Metres: how far from below its first point a vehicle may stand, for it to take off."""
SPEED, ACCELERATION = 35 / 16, 7.514
"""The largest speed and acceleration of the polynomial, over 1 m in 1 s: m/s; m/s², rounded up."""
FINE = 0.002
"""Metres between the heights of a column that are looked at: what lies in between is nearer by half of it at most."""
REST_TO_REST = (0.0, 0.0, 0.0, 0.0, 35.0, -84.0, 70.0, -20.0)
"""The polynomial of the firmware, from 0 to 1 in 1 s: ascending powers."""
CLOCK_ERROR, UPTIME = 2.0**-10, 2**14
"""Seconds by which a firmware's clock, seconds since it was switched on in float32, is wrong up to so many of them.

The time now and that of the start are each rounded to a multiple of 2^-10 s below 2^14 s.

Source:
    crazyflie-firmware, crtp_commander_high_level.c (``usecTimestamp() / 1e6``, a ``float``) and planner.c
    (``t - t_begin``).
"""


@dataclass(frozen=True, slots=True)
class Phases:
    """Seconds of each phase, the same for everybody; ``duration`` is that of the polynomials."""

    rise: float
    settle: float
    go: float
    duration: float
    sink: float

    @property
    def whole(self) -> float:
        """Seconds from the floor to the floor."""
        return self.rise + self.settle + self.go + self.settle + self.duration + self.settle + self.sink


def phases(flight: Flight) -> Phases:
    """How long a flight takes in each phase, so that nobody rises or sinks faster than its vehicle may."""
    rise = max(_seconds(each.first[2] - GROUND, each.agent.vehicle) for each in flight.parts)
    sink = max(_seconds(each.last[2] - LANDED, each.agent.vehicle) for each in flight.parts)
    return Phases(max(rise, RISE), SETTLE, GO, flight.duration, max(sink, SINK))


def _seconds(height: float, vehicle: Vehicle) -> float:
    """For so many metres at the vehicle's limits, rounded up to a tenth."""
    by_speed = SPEED * abs(height) / vehicle.vertical_speed
    by_acceleration = math.sqrt(ACCELERATION * abs(height) / vehicle.acceleration)
    return math.ceil(10 * max(by_speed, by_acceleration) - 1e-9) / 10


def for_templates(flight: Flight) -> dict[str, float]:
    """What a script says of its phases, by the names that it has for them; and what the clock on board may cost."""
    costs = math.ceil(float(speed_bounds(flight.curves).max()) * CLOCK_ERROR * 1e4) / 10
    hours = math.floor(UPTIME / 360) / 10
    return asdict(phases(flight)) | {"landed": LANDED, "near": NEAR, "clock": costs, "hours": hours}


def floor_to_floor(flight: Flight) -> tuple[Pieces, ...]:
    """The whole flight of each vehicle as polynomials in doubles, the floor at both ends.

    They rise, hover, fly, hover and sink, without the way to the first points that scripts fly: here vehicles rise to
    them.
    """
    lasting = phases(flight)
    joined = []
    for each in flight.parts:
        start = _upright(each, 0, GROUND, each.first[2], lasting.rise)
        stay = _upright(each, 0, each.first[2], each.first[2], lasting.settle)
        hover = _upright(each, -1, each.last[2], each.last[2], lasting.settle)
        end = _upright(each, -1, each.last[2], GROUND, lasting.sink)
        duration = np.concatenate(
            [[lasting.rise, lasting.settle], each.pieces.duration, [lasting.settle, lasting.sink]]
        )
        coefficients = np.concatenate([[start, stay], each.pieces.coefficients, [hover, end]])
        joined.append(Pieces(duration, coefficients))
    return tuple(joined)


def _upright(part: Part, at: int, low: float, high: float, seconds: float) -> Array:
    """(4, 8): from one height to another above an end of the flight, 0 or -1, as its nose points there."""
    piece = part.pieces.coefficients[at]
    there = piece[:, 0] if at == 0 else values(piece, part.pieces.duration[at])
    own = np.zeros((4, len(REST_TO_REST)))
    own[:, 0] = there
    own[2] = (high - low) * np.array(REST_TO_REST) / seconds ** np.arange(len(REST_TO_REST))
    own[2, 0] = low
    return own


def cannot_rise_or_land(name: str, flight: Flight) -> Diagnostic | None:
    """Why the form of this name cannot fly from the floor to the floor; None where it can."""
    return _shared_column(name, flight) or _blocked_column(name, flight) or _too_long(name, flight)


def _ends(part: Part) -> Iterator[tuple[str, tuple[float, float, float], bool]]:
    """Where a vehicle rises and sinks: the verb, the point in the air, whether it is the flight's end."""
    yield "take off", part.first, False
    yield "land", part.last, True


def _shared_column(name: str, flight: Flight) -> Diagnostic | None:
    """Two vehicles that would take off, or land, through each other."""
    for first, second in combinations(flight.parts, 2):
        need = flight.mission.spacing(first.agent.index, second.agent.index).sideways
        for (verb, one, _), (_, other, _) in zip(_ends(first), _ends(second), strict=True):
            apart = math.dist(one[:2], other[:2])
            # A flight need not end nearer than this to where the plan ends.
            if apart < need - WAYPOINT:
                return _crowded(name, verb, first, second, apart, need)
    return None


def _blocked_column(name: str, flight: Flight) -> Diagnostic | None:
    """A vehicle that would rise or sink through an obstacle, as it stands then; in a plane obstacles have no height."""
    mission = flight.mission
    if mission.dimension < 3:
        return None
    for part in flight.parts:
        need = part.agent.radius + part.agent.vehicle.tracking
        for verb, point, at_end in _ends(part):
            for obstacle in mission.obstacles:
                time = flight.duration if at_end else 0.0
                clear = _clearance(mission, obstacle, time, point)
                # A flight need not begin or end nearer than this to where the plan does.
                if clear < need - WAYPOINT:
                    return _blocked(name, verb, part, obstacle, clear, need)
    return None


def _clearance(mission: Mission, obstacle: Obstacle, time: float, point: Vector) -> float:
    """Metres between an obstacle and the column below a point, at least."""
    shape = moved(obstacle.shape, displaced(obstacle, time, mission.dimension))
    heights = np.linspace(GROUND, point[2], max(2, math.ceil(abs(point[2] - GROUND) / FINE) + 1))
    column = np.column_stack([np.full(heights.shape, point[0]), np.full(heights.shape, point[1]), heights])
    return float(signed_distance(np, shape, column).min()) - FINE / 2 - obstacle.grown(time)


def _too_long(name: str, flight: Flight) -> Diagnostic | None:
    whole = phases(flight).whole
    for part in flight.parts:
        flies = part.agent.vehicle.endurance
        if whole > flies:
            return refused(
                name,
                f"it takes {whole:g} s from the floor to the floor, and `{part.agent.name}` flies {flies:g} s",
                f"its trajectories alone last {flight.duration:g} s",
                help="shorten the mission's `horizon`, or give `vehicle` its own `endurance`",
            )
    return None


def _crowded(name: str, verb: str, first: Part, second: Part, apart: float, need: float) -> Diagnostic:
    where = "starts" if verb == "take off" else "finishes"
    return refused(
        name,
        f"`{first.agent.name}` and `{second.agent.name}` cannot {verb} at once, one above the other",
        f"seen from above they are {apart:.3g} m apart, and need {need:.3g} m",
        help=f"give them {where} that are not above each other; the polynomials alone are in `crazyflie/`",
    )


def _blocked(name: str, verb: str, part: Part, obstacle: Obstacle, clear: float, need: float) -> Diagnostic:
    where, way = ("start", "below its first point") if verb == "take off" else ("finish", "below its last point")
    near = f"`{obstacle.name}` is within {max(clear, 0.0):.3g} m of the column {way}, and it needs {need:.3g} m"
    return refused(
        name,
        f"`{part.agent.name}` cannot {verb} straight {'up' if verb == 'take off' else 'down'}",
        near,
        help=f"give it a {where} that is not above an obstacle; the polynomials alone are in `crazyflie/`",
    )
