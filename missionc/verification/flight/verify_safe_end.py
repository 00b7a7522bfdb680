"""Verification of safe ends: stops from times of a flight to rest, hovering, and vertical landing without contact.

    in   Mission, its flight and transfers, and the stated stops
    out  Certificate: each stop begins in the flight, satisfies every claim of a flight, and leads to the floor

Between two stop times, the safe end is to continue to the next stop time and stop there; this part is proved with the
flight. The stops therefore give a safe end at every time, after at most the longest wait between them.

All stops are verified together, as consecutive pieces of one flight on a separate clock. Start skew counts as tracking
error, by the distance that a vehicle travels in that time.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from missionc.base.trace import Array
from missionc.base.units import Seconds
from missionc.geometry.curves.piecewise_polynomials import (
    Curves,
    Pieces,
    curves_of,
    derivatives_at,
    refined,
    speed_bounds,
    values,
)
from missionc.geometry.grown_shape import grown_shape
from missionc.ir import PLAIN, Agent, Mission, Obstacle, Path
from missionc.verification.certificate import MOTION, WAYPOINT, Certificate, Check, Figure, judged
from missionc.verification.flight.continuity_and_fidelity import exactness
from missionc.verification.flight.joint_claims import Flight, downwash, obstacles, separation, world
from missionc.verification.flight.verify_polynomials import limits, prove_all
from missionc.verification.flight.verify_whole_flight import Stop, in_turns, landing_margins
from missionc.verification.flight.way_missions import is_whole
from missionc.verification.proof.branch_and_bound import Claim, failing_pieces
from missionc.verification.proof.proof_boxes import Boxes

HOVER = 1.0
"""Duration of the hover that is verified after each stop, before any landing, seconds."""
FARTHEST = 1e3
"""Maximum margin that a check states, metres; larger or unbounded margins are replaced by it."""
AT_THE_END = 1e-3
"""Tolerance of a stop time, seconds: a stop this near to the end of the flight counts as a stop at its end."""
ROUNDED_UP = 1e-9
"""Relative error bound of speeds that are computed without outward rounding."""
WAIT, WITHOUT = "safe end wait", "safe end without"
"""Names of two quantities of a certificate: the longest wait until the next stop, and the time without a stop at the
end.
"""
ORDERS = 5
"""Number of derivatives, from position to snap, in the state that a stop continues from the flight."""


def has_safe_end(mission: Mission) -> bool:
    """Return whether the plan includes safe ends: the mission names a vehicle or starts on the floor."""
    return is_whole(mission) or any(agent.vehicle != PLAIN for agent in mission.agents)


def verify_safe_end(
    mission: Mission, whole: Mapping[str, Pieces], before: float, risen: float, stops: Sequence[Stop]
) -> Certificate:
    """Certificate of the safe ends of a flight, from its beginning to its end.

    A flight from the floor has a safe end at every time. Other flights may have none near their end, for a time that
    the certificate reports.

    Args:
        whole: by agent name, the verified outbound transfer, mission and return transfer as one.
        before: seconds before the mission begins.
        risen: seconds from takeoff to the beginning of ``whole``; 0 if it begins in the air.
    """
    end = float(next(iter(whole.values())).times[-1]) - before
    moments = _moments(stops, before, end, to_the_end=is_whole(mission))
    found = Certificate(mission.name, (moments,))
    if moments.passed and stops:
        found = found.joined(judge_stops(mission, whole, before, stops))
        found = found.joined(Certificate(mission.name, tuple(_endurance(mission, stops, risen + before))))
    if not moments.passed:
        return found.under("safe end")
    times = [-before, *(stop.at for stop in stops)]
    hovering = sum(1 for stop in stops if sum(map(len, stop.turns)) < len(mission.agents))
    without = end - times[-1]
    figures = (
        Figure(WAIT, "flight", round(max((after - here for here, after in pairwise(times)), default=0.0), 6), "s"),
        Figure("safe end hover", "flight", float(hovering), "moments"),
        Figure(WITHOUT, "flight", round(without, 6) if without > AT_THE_END else 0.0, "s"),
    )
    return replace(found.under("safe end"), figures=figures)


def judge_stops(mission: Mission, whole: Mapping[str, Pieces], before: float, stops: Sequence[Stop]) -> Certificate:
    """Certificate of the stops themselves; arguments as for ``verify_safe_end``.

    The times of the proof boxes are those of all stops in sequence.
    """
    flown = [whole[agent.name] for agent in mission.agents]
    boxes: list[Boxes] = []
    with np.errstate(over="ignore", invalid="ignore"):
        off = _begin_off(flown, before, stops)
        checks = [_begins(agent, flown[agent.index], off[agent.index], stops) for agent in mission.agents]
        punctual, flight = _as_one(mission, flown, before, stops)
        prove_all(punctual, _claims(punctual, flight), checks, boxes)
        checks = [_on_the_clock(check, flight, stops) for check in checks]
        for obstacle in mission.obstacles:
            if not obstacle.constant:
                beside = (_beside(punctual, flight, obstacle, number, stop) for number, stop in enumerate(stops))
                checks.append(min(beside, key=lambda check: (check.passed, check.margin)))
    checks.append(_landing(mission, [_landings(mission, flight, *each) for each in enumerate(stops)]))
    return Certificate(mission.name, tuple(checks), boxes=tuple(boxes))


def failing_stops(mission: Mission, whole: Mapping[str, Pieces], before: float, stops: Sequence[Stop]) -> set[int]:
    """Indices of the stops that violate a claim; the arguments are those of ``verify_safe_end``."""
    flown = [whole[agent.name] for agent in mission.agents]
    tolerance = np.array([4 * exactness(own) for own in flown])
    failing = set(np.flatnonzero((_begin_off(flown, before, stops) > tolerance[:, None]).any(axis=0)).tolist())
    punctual, flight = _as_one(mission, flown, before, stops)
    with np.errstate(over="ignore", invalid="ignore"):
        failing |= {piece // 2 for claim in _claims(punctual, flight) for piece in failing_pieces(claim)}
        changing = [obstacle for obstacle in mission.obstacles if not obstacle.constant]
        for number, stop in enumerate(stops):
            beside = (_beside(punctual, flight, obstacle, number, stop) for obstacle in changing)
            if number not in failing and not all(check.passed for check in beside):
                failing.add(number)
    return failing


def _claims(mission: Mission, flight: Flight) -> list[Claim]:
    """Claims about all stops, except claims about moving or growing obstacles."""
    constant = replace(mission, obstacles=tuple(each for each in mission.obstacles if each.constant))
    joint = [world(mission, flight), *separation(mission, flight, False), *downwash(mission, flight)]
    return [*joint, *limits(mission, flight), *obstacles(constant, flight, False)]


def _on_the_clock(check: Check, flight: Flight, stops: Sequence[Stop]) -> Check:
    """The check with its time converted from the clock of the stops to the mission's clock."""
    if check.at is None or not check.name.startswith("flown"):
        return check
    piece = int(np.clip(np.searchsorted(flight.times, check.at, side="right") - 1, 0, 2 * len(stops) - 1))
    stop = piece // 2
    return replace(check, at=float(stops[stop].at + check.at - flight.times[2 * stop]))


# ------------------------------------------------------------------ the stops


def _moments(stops: Sequence[Stop], before: float, end: float, to_the_end: bool) -> Check:
    """Check that the stops are in order within the flight, and with ``to_the_end``, that the last stop is at
    its end.
    """
    times = [stop.at for stop in stops]
    sound = all(-before - MOTION <= time <= end + AT_THE_END for time in times)
    sound = sound and all(here < after for here, after in pairwise(times))
    detail = "the stops are in order and within the flight"
    if to_the_end:
        sound = sound and bool(times) and abs(times[-1] - end) <= AT_THE_END
        detail = "the stops are in order, and the last is at the end of the flight"
    return Check("moments", "stops", 0.0, "", 0.0, sound, detail=detail)


def _begin_off(flown: Sequence[Pieces], before: float, stops: Sequence[Stop]) -> Array:
    """Deviation of each stop's first state from the flight, or of its last state from rest if larger.

    Shape: (agents, stops), metres.

    Derivatives count by the displacement of a control point that would explain them. At the end of the flight, all
    agents are at rest up to jerk, and snap ends too.
    """
    times = np.array([stop.at + before for stop in stops])
    here = derivatives_at(curves_of(flown, slice(None)), times, ORDERS)
    here[:, times >= flown[0].times[-1] - MOTION, ORDERS - 1] = 0.0
    lasts = np.array([stop.seconds for stop in stops])
    own = np.stack([[each.coefficients for each in stop.pieces] for stop in stops], axis=1)
    orders = np.arange(ORDERS)
    there = np.swapaxes(own[:, :, 0, :, :ORDERS], -1, -2) * np.array([math.factorial(each) for each in orders])[:, None]
    scale = np.stack([lasts**order / math.perm(7, order) for order in orders.tolist()], axis=-1)
    jumps = np.linalg.norm(here - there, axis=-1) * scale
    ends = [own[:, :, 0]]
    for _ in orders[1:4]:
        ends.append(ends[-1][..., 1:] * np.arange(1, ends[-1].shape[-1]))
    last = [values(each, np.broadcast_to(lasts, own.shape[:2])) for each in ends]
    rests = [np.linalg.norm(last[order], axis=-1) * scale[:, order] for order in (1, 2, 3)]
    rests.append(np.linalg.norm(last[0] - own[:, :, 1, :, 0], axis=-1))
    rests.append(np.abs(own[:, :, 1, :, 1:]).max(axis=(-1, -2)))
    return np.asarray(np.max([*np.moveaxis(jumps, -1, 0), *rests], axis=0))


def _begins(agent: Agent, flown: Pieces, off: Array, stops: Sequence[Stop]) -> Check:
    """Check that each stop begins in the flight's state, without a jump up to snap, and ends at rest.

    Args:
        off: deviation of each stop, (stops,), metres.
    """
    worst = int(off.argmax())
    detail = "every stop continues the flight from position to snap and ends at rest"
    margin, when = -float(off[worst]), stops[worst].at
    return judged("begin", agent.name, margin, "m", 4 * exactness(flown), at=when, agents=(agent.name,), detail=detail)


def _as_one(mission: Mission, flown: Sequence[Pieces], before: float, stops: Sequence[Stop]) -> tuple[Mission, Flight]:
    """The mission without start skew, and all stops as one flight whose additional deviation covers late starts."""
    durations = np.concatenate([stop.pieces[0].duration for stop in stops])
    coefficients = np.stack(
        [np.concatenate([stop.pieces[agent.index].coefficients for stop in stops]) for agent in mission.agents]
    )
    astray = np.repeat(_late(mission, flown, before, stops), 2)
    return _missing(mission, 0.0), Flight(durations, coefficients, astray)


def _late(mission: Mission, flown: Sequence[Pieces], before: float, stops: Sequence[Stop]) -> Array:
    """Upper bound on the distance that an agent travels in the start skew, around or during each stop: (stops,),
    metres.
    """
    skew = np.array([agent.vehicle.start_skew for agent in mission.agents])
    if not skew.any():
        return np.zeros(len(stops))
    at = np.array([stop.at + before for stop in stops])
    begin, end = at - skew.max(), at + skew.max()
    whole = curves_of(flown, slice(0, 3))
    parts = refined(whole, np.concatenate([begin, end]))
    fastest = speed_bounds(parts)
    within = (parts.times[None, :-1] < end[:, None]) & (parts.times[None, 1:] > begin[:, None])
    speed = np.where(within[None], fastest[:, None], 0.0).max(axis=-1)
    own = np.stack([[each.coefficients[0, :3] for each in stop.pieces] for stop in stops], axis=1)
    lasts = np.array([stop.seconds for stop in stops])
    for stop, last in enumerate(lasts.tolist()):
        braking = speed_bounds(Curves(np.array([0.0, last]), own[:, [stop]]))[:, 0]
        speed[:, stop] = np.maximum(speed[:, stop], braking)
    jumps = Flight(flown[0].duration, np.stack([each.coefficients for each in flown])).jumps.max(axis=-1, initial=0.0)
    return np.asarray(((speed * skew[:, None] + jumps[:, None]) * (1 + ROUNDED_UP)).max(axis=0))


def _missing(mission: Mission, more: float) -> Mission:
    """The mission without start skew, with every vehicle's tracking error enlarged by ``more`` metres."""
    agents = (
        replace(agent, vehicle=replace(agent.vehicle, tracking=agent.vehicle.tracking + more, start_skew=0.0))
        for agent in mission.agents
    )
    return replace(mission, agents=tuple(agents))


def with_turns(mission: Mission, whole: Mapping[str, Pieces], before: float, stops: Sequence[Stop]) -> list[Stop]:
    """The stops, each with the groups of agents that can land in turns without contact.

    Arguments as for ``verify_safe_end``.
    """
    late = _late(mission, [whole[agent.name] for agent in mission.agents], before, stops)
    return [
        replace(stop, turns=in_turns(_missing(mission, float(more)), stop))
        for stop, more in zip(stops, late, strict=True)
    ]


def _beside(mission: Mission, flight: Flight, obstacle: Obstacle, number: int, stop: Stop) -> Check:
    """Check that no agent touches a moving or growing obstacle during one stop."""
    alone = replace(mission, obstacles=(_since(obstacle, stop.at, stop.seconds + HOVER),))
    pieces = slice(2 * number, 2 * number + 2)
    own = Flight(flight.durations[pieces], flight.coefficients[:, pieces], flight.off[pieces])
    found: list[Check] = []
    prove_all(alone, obstacles(alone, own, False), found, [])
    return replace(found[0], at=stop.at)


def _since(obstacle: Obstacle, time: float, seconds: float) -> Obstacle:
    """The obstacle on a clock that begins at ``time``, with the size that it has ``seconds`` later."""
    shape = grown_shape(obstacle.shape, obstacle.grown(time + seconds)) if obstacle.growth else obstacle.shape
    if not isinstance(obstacle.motion, Path):
        return replace(obstacle, shape=shape, growth=0.0)
    knots, offsets = np.array(obstacle.motion.times), np.array(obstacle.motion.offsets)
    inner = [each - time for each in obstacle.motion.times if 0 < each - time < seconds]
    times = np.array([0.0, *inner, seconds])
    rows = np.stack([np.interp(times + time, knots, axis) for axis in offsets.T], axis=-1)
    path = Path(tuple(map(Seconds, times.tolist())), tuple(map(tuple, rows.tolist())))
    return replace(obstacle, shape=shape, motion=path, growth=0.0)


def _landings(mission: Mission, flight: Flight, number: int, stop: Stop) -> list[tuple[float, float, int]]:
    """Clearance in metres of each agent that lands after a stop, with the stop's time and the agent's index."""
    widened = _missing(mission, float(flight.off[2 * number]))
    return [(margin, stop.at, index) for index, margin in landing_margins(widened, stop)]


def _landing(mission: Mission, margins: Sequence[list[tuple[float, float, int]]]) -> Check:
    """Check that landing agents touch no obstacle and no other agent, whether it lands, hovers or has landed."""
    found = [each for own in margins for each in own]
    if not found:
        return Check("landing", "stops", 0.0, "m", WAYPOINT, True, detail="no agent lands")
    worst, when, who = min(found)
    detail = "every agent that lands after a stop descends vertically without a collision"
    name = mission.agents[who].name
    worst = min(worst, FARTHEST)
    return judged("landing", "stops", worst, "m", WAYPOINT, at=when, agents=(name,), detail=detail)


def last_to_stand(mission: Mission, stop: Stop, aloft: float) -> float:
    """Seconds from takeoff until every agent has landed after a stop.

    Args:
        aloft: seconds from takeoff to the mission's beginning.
    """
    return aloft + stop.at + stop.seconds + sum(stop.landing(mission))


def _endurance(mission: Mission, stops: Sequence[Stop], aloft: float) -> list[Check]:
    """Checks that each battery lasts until every agent that lands after a stop is on the floor."""
    latest = max(last_to_stand(mission, stop, aloft) for stop in stops)
    begun = "takeoff" if is_whole(mission) else "the start of the polynomials"
    return [
        Check(
            "endurance",
            agent.name,
            agent.vehicle.endurance - latest,
            "s",
            0.0,
            latest <= agent.vehicle.endurance,
            agents=(agent.name,),
            detail=f"all agents have landed {latest:g} s after {begun}",
        )
        for agent in mission.agents
        if math.isfinite(agent.vehicle.endurance)
    ]
