"""Takeoff and landing, outside the polynomials: vehicles rise to their first points and sink from their last points.

Each moves straight up and down in a column of its own, clear of obstacles, as fast as its profile allows, and lands
before its battery is empty. If that is impossible, a format with takeoff and landing reports an error.
"""

from __future__ import annotations

import math
from itertools import combinations

import numpy as np

from missionc.base.diagnostics.model import Diagnostic
from missionc.base.trace import Array
from missionc.geometry.columns import FLOOR, column_clearance
from missionc.geometry.curves.piecewise_polynomials import Pieces, hulls, values
from missionc.ir import Obstacle
from missionc.output.export.export_form import refused
from missionc.output.export.verified_flight import Flight, Part
from missionc.verification.certificate import WAYPOINT
from missionc.verification.flight.verify_whole_flight import LANDED, REST_TO_REST, Phases, pad_turns, phases_of
from missionc.verification.flight.way_missions import is_whole

GROUND = FLOOR
"""Height of the vehicles before takeoff, metres."""
PARTS = 32
"""Number of parts of each piece whose convex hulls bound an altitude or a speed, to about 0.1 %."""


def phases(flight: Flight, bottom: float = LANDED) -> Phases:
    """Duration of each phase of a flight in which no vehicle exceeds the vertical speeds of its profile.

    Args:
        bottom: height to which vehicles sink, metres: scripts stop motors above the floor.
    """
    agents = [each.agent for each in flight.parts]
    up, down = (
        [end[2] for end in ends] for ends in zip(*((each.first, each.last) for each in flight.parts), strict=True)
    )
    return phases_of(agents, up, down, flight.duration, len(turns_of(flight)), flight.in_flight, bottom)


def peaks(flight: Flight) -> list[float]:
    """Upper bound on the altitude of each vehicle along its trajectory, metres, at most some millimetres too large."""
    return [float(points[:, 2].max()) for points in hulls(flight.curves, PARTS)]


def turns_of(flight: Flight) -> tuple[tuple[int, ...], ...]:
    """Indices of the agents that take off together, turn by turn; landing uses the reverse order.

    Vehicles without pads take off in one turn.
    """
    everyone = tuple(each.agent.index for each in flight.parts)
    if not is_whole(flight.mission):
        return (everyone,)
    turns = pad_turns(flight.mission, np.array([each.last for each in flight.parts]))
    return tuple(reversed(turns)) if sum(map(len, turns)) == len(everyone) else (everyone,)


def floor_to_floor(flight: Flight) -> tuple[Pieces, ...]:
    """Flight of each vehicle as polynomials in double precision, with the floor at both ends.

    Vehicles rise, hover, fly, hover and sink. Unlike in scripts, they rise directly to their first points.
    """
    lasting, turns = phases(flight, GROUND), turns_of(flight)
    joined = []
    for each in flight.parts:
        own = next(number for number, turn in enumerate(turns) if each.agent.index in turn)
        up, down = each.first[2], each.last[2]
        rising, sinking = list[Array](), list[Array]()
        for number in range(len(turns)):
            begin, end = (GROUND if number <= own else up), (up if number >= own else GROUND)
            rising.append(_upright(each, 0, begin, end, lasting.rise))
            # They land in reverse order.
            begin, end = (GROUND if number < own else down), (GROUND if number <= own else down)
            sinking.insert(0, _upright(each, -1, begin, end, lasting.sink))
        stay, hover = (_upright(each, at, high, high, lasting.settle) for at, high in ((0, up), (-1, down)))
        before = [lasting.rise] * len(turns) + [lasting.settle]
        after = [lasting.settle] + [lasting.sink] * len(turns)
        duration = np.concatenate([before, each.pieces.duration, after])
        coefficients = np.concatenate([[*rising, stay], each.pieces.coefficients, [hover, *sinking]])
        joined.append(Pieces(duration, coefficients))
    return tuple(joined)


def _upright(part: Part, at: int, low: float, high: float, seconds: float) -> Array:
    """Coefficients (4, 8) of a vertical motion between two heights, at the horizontal position of one end of the
    flight.

    Args:
        at: 0 for the start of the flight, -1 for its end.
        low, high: heights, metres.
        seconds: duration.
    """
    piece = part.pieces.coefficients[at]
    there = piece[:, 0] if at == 0 else values(piece, part.pieces.duration[at])
    own = np.zeros((4, len(REST_TO_REST)))
    own[:, 0] = there
    own[2] = (high - low) * np.array(REST_TO_REST) / seconds ** np.arange(len(REST_TO_REST))
    own[2, 0] = low
    return own


def cannot_rise_or_land(name: str, flight: Flight, bottom: float = LANDED) -> Diagnostic | None:
    """Diagnostic that states why this format cannot fly from floor to floor; None if it can.

    Args:
        bottom: as in ``phases``.
    """
    whole = phases(flight, bottom).whole
    return _shared_column(name, flight) or _blocked_column(name, flight) or _too_long(name, flight, whole)


def _columns(flight: Flight, part: Part) -> list[tuple[str, tuple[float, float, float], bool]]:
    """Columns in which a vehicle takes off (unless in the air) and lands: verb, point in the air, True for landing."""
    land = ("land", part.last, True)
    return [land] if flight.in_flight else [("take off", part.first, False), land]


def _shared_column(name: str, flight: Flight) -> Diagnostic | None:
    """Diagnostic of two vehicles that would take off or land through each other; None if there are none."""
    if len(turns_of(flight)) > 1:
        return None
    for first, second in combinations(flight.parts, 2):
        need = flight.mission.spacing(first.agent.index, second.agent.index).sideways
        for (verb, one, _), (_, other, _) in zip(_columns(flight, first), _columns(flight, second), strict=True):
            apart = math.dist(one[:2], other[:2])
            # A flight may end this far from the end of the plan.
            if apart < need - WAYPOINT:
                return refused(
                    name,
                    f"`{first.agent.name}` and `{second.agent.name}` cannot {verb} together, one above the other",
                    f"their horizontal distance is {apart:.3g} m; the minimum is {need:.3g} m",
                    help=f"move their {'starts' if verb == 'take off' else 'finishes'} apart",
                )
    return None


def _blocked_column(name: str, flight: Flight) -> Diagnostic | None:
    """Diagnostic of a vehicle that would rise or sink through an obstacle; None if there is none.

    In a plane mission, obstacles have no height and are not checked.
    """
    mission = flight.mission
    if mission.dimension < 3:
        return None
    for part in flight.parts:
        need = part.agent.radius + part.agent.vehicle.tracking
        for verb, point, at_end in _columns(flight, part):
            for obstacle in mission.obstacles:
                time = flight.duration - flight.before if at_end else 0.0
                clear = column_clearance(obstacle, point, time, time)
                # A flight may begin or end this far from the plan.
                if clear < need - WAYPOINT:
                    return _blocked(name, verb, part, obstacle, clear, need)
    return None


def _too_long(name: str, flight: Flight, whole: float) -> Diagnostic | None:
    for part in flight.parts:
        flies = part.agent.vehicle.endurance
        if whole > flies:
            return refused(
                name,
                f"the flight lasts {whole:g} s from takeoff to landing, but the endurance of `{part.agent.name}` is "
                f"{flies:g} s",
                f"the trajectories alone last {flight.duration:g} s",
                help="shorten the `horizon`",
            )
    return None


def _blocked(name: str, verb: str, part: Part, obstacle: Obstacle, clear: float, need: float) -> Diagnostic:
    where, way = ("start", "below its first point") if verb == "take off" else ("finish", "below its last point")
    near = f"`{obstacle.name}` is {max(clear, 0.0):.3g} m from the column {way}; the minimum is {need:.3g} m"
    return refused(
        name,
        f"`{part.agent.name}` cannot {verb} vertically",
        near,
        help=f"give the agent a {where} that is not above an obstacle",
    )
