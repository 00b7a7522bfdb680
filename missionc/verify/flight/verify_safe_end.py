"""Verification of safe ends: from moments of a flight to rest, hovering, and straight down in turns, touching nobody.

    in   Mission, its flight and ways, and the stops that are stated
    out  Certificate: that each stop begins in the flight, keeps every claim of a flight, and leads to the floor

Between two moments that have a stop, the safe end is to fly on to the next one and to stop there: what is flown until
then is proved with the flight. So the stops at some moments are a safe end for every moment, at most the longest wait
between them later.

All stops are judged together, as pieces of one flight that follow each other on a clock of its own. Vehicles that
started late are off by what they fly in that time at most, which counts as what they may miss.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from missionc.base.trace import Array
from missionc.base.units import Seconds
from missionc.curves.crazyflie_csv import Pieces
from missionc.curves.piecewise_polynomials import values
from missionc.ir import Agent, Mission, Obstacle, Path
from missionc.verify.certificate import Certificate, Check, Figure, judged
from missionc.verify.flight.continuity_and_fidelity import exactness
from missionc.verify.flight.flight_curves import Flight
from missionc.verify.flight.joint_claims import downwash, obstacles, separation, world
from missionc.verify.flight.landing_in_turns import Stop, landing_margins
from missionc.verify.flight.vehicle_claims import limits
from missionc.verify.flight.verify_polynomials import prove_all
from missionc.verify.proof.proof_boxes import Boxes
from missionc.verify.tolerances import MOTION, WAYPOINT
from missionc.world.grown_shape import grown_shape

HOVER = 1.0
"""Seconds of hovering that are judged with each stop, before anybody lands."""
FARTHEST = 1e3
"""Metres: a margin that is larger, or without bounds where there is nobody else, is stated as so much."""
ORDERS = 5
"""Position, velocity, acceleration, jerk and snap: what a stop takes over from the flight."""


def verify_safe_end(
    mission: Mission, whole: Mapping[str, Pieces], before: float, risen: float, stops: Sequence[Stop]
) -> Certificate:
    """Judge the safe ends of a flight, from its beginning to its end.

    Args:
        whole: of each agent, by its name: the way out, the mission and the way home as one; they were verified.
        before: seconds of it before the mission begins.
        risen: seconds from the take-off to its beginning.
    """
    end = float(next(iter(whole.values())).times[-1]) - before
    moments = _moments(stops, before, end)
    if not moments.passed:
        return _named(Certificate(mission.name, (moments,)))
    judged_stops = judge_stops(mission, whole, before, stops)
    waits = [after - here for here, after in pairwise([-before, *(stop.at for stop in stops)])]
    hovering = sum(1 for stop in stops if sum(map(len, stop.turns)) < len(mission.agents))
    figures = (
        Figure("safe end wait", "flight", round(max(waits), 6), "s"),
        Figure("safe end hover", "flight", float(hovering), "moments"),
    )
    rest = Certificate(mission.name, tuple(_endurance(mission, stops, risen + before)))
    named = _named(Certificate(mission.name, (moments,)).joined(judged_stops).joined(rest))
    return replace(named, figures=figures)


def _named(certificate: Certificate) -> Certificate:
    return replace(
        certificate,
        checks=tuple(replace(check, name=f"safe end {check.name}") for check in certificate.checks),
        boxes=tuple(
            replace(each, claim=replace(each.claim, name=f"safe end {each.claim.name}")) for each in certificate.boxes
        ),
    )


def judge_stops(mission: Mission, whole: Mapping[str, Pieces], before: float, stops: Sequence[Stop]) -> Certificate:
    """Judge stops by themselves, arguments as of ``verify_safe_end``; the boxes are on the clock of all in a row."""
    flown = [whole[agent.name] for agent in mission.agents]
    checks: list[Check] = [_begins(agent, flown[agent.index], before, stops) for agent in mission.agents]
    boxes: list[Boxes] = []
    wide, flight = _as_one(mission, flown, stops)
    claims = [world(wide, flight), *separation(wide, flight, False), *downwash(wide, flight), *limits(wide, flight)]
    constant = replace(wide, obstacles=tuple(each for each in mission.obstacles if each.constant))
    with np.errstate(over="ignore", invalid="ignore"):
        prove_all(wide, [*claims, *obstacles(constant, flight, False)], checks, boxes)
        checks = [_on_the_clock(check, flight, stops) for check in checks]
        checks += [_beside(wide, obstacle, stops) for obstacle in mission.obstacles if not obstacle.constant]
    checks.append(_landing(wide, stops))
    return Certificate(mission.name, tuple(checks), boxes=tuple(boxes))


def _on_the_clock(check: Check, flight: Flight, stops: Sequence[Stop]) -> Check:
    """A check of a claim, with its time on the mission's clock."""
    if check.at is None or not check.name.startswith("flown"):
        return check
    piece = int(np.clip(np.searchsorted(flight.times, check.at, side="right") - 1, 0, 2 * len(stops) - 1))
    stop = piece // 2
    return replace(check, at=float(stops[stop].at + check.at - flight.times[2 * stop]))


# ------------------------------------------------------------------ the stops


def _moments(stops: Sequence[Stop], before: float, end: float) -> Check:
    """That they follow each other, and that the last is where the flight ends, at rest."""
    times = [stop.at for stop in stops]
    sound = bool(times) and times[0] >= -before - MOTION and abs(times[-1] - end) <= 1e-3
    sound = sound and all(here < after for here, after in pairwise(times))
    detail = "there is one at the end of the flight, and those before it follow each other"
    return Check("moments", "stops", 0.0, "", 0.0, sound, detail=detail)


def _begins(agent: Agent, flown: Pieces, before: float, stops: Sequence[Stop]) -> Check:
    """That each stop begins in the state of the flight, without a jump up to snap, and ends at rest."""
    worst, when = 0.0, 0.0
    for stop in stops:
        own = stop.pieces[agent.index]
        lasts = float(own.duration[0])
        here, there = _state(flown, stop.at + before), _state(own, 0.0)
        # As far as a control point of the stop would have to move for it.
        scale = np.array([lasts**order / math.perm(7, order) for order in range(ORDERS)])
        off = [float(np.linalg.norm(jump)) for jump in (here - there) * scale[:, None]]
        last, after = _state(own, lasts * (1 - 1e-15)), own.coefficients[1]
        off += [float(np.linalg.norm(last[order])) * float(scale[order]) for order in (1, 2, 3)]
        off += [float(np.linalg.norm(last[0] - after[:, 0])), float(np.abs(after[:, 1:]).max())]
        if max(off) > worst:
            worst, when = max(off), stop.at
    tolerance = 4 * exactness(flown)
    detail = "every stop begins as the flight is there, without a jump from position to snap, and ends at rest"
    return judged("begin", agent.name, -worst, "m", tolerance, at=when, agents=(agent.name,), detail=detail)


def _state(own: Pieces, time: float) -> Array:
    """(5, 4): of x, y, z and yaw, with their derivatives."""
    times = own.times
    piece = int(np.clip(np.searchsorted(times, time, side="right") - 1, 0, own.duration.size - 1))
    local = np.asarray(np.clip(time - times[piece], 0.0, own.duration[piece]))
    coefficients, state = own.coefficients[piece], []
    for _ in range(ORDERS):
        state.append(values(coefficients, local))
        coefficients = coefficients[:, 1:] * np.arange(1, coefficients.shape[1])
    return np.stack(state)


def _as_one(mission: Mission, flown: Sequence[Pieces], stops: Sequence[Stop]) -> tuple[Mission, Flight]:
    """All stops as one flight, and the mission of vehicles that miss their trajectories by what skews cost, too."""
    durations = np.concatenate([stop.pieces[0].duration for stop in stops])
    coefficients = np.stack(
        [np.concatenate([stop.pieces[agent.index].coefficients for stop in stops]) for agent in mission.agents]
    )
    return missing_by_skew(mission, flown), Flight(durations, coefficients)


def missing_by_skew(mission: Mission, flown: Sequence[Pieces]) -> Mission:
    """The mission of vehicles that all start at once, and miss their trajectories by what starting late costs, too.

    Args:
        flown: by agent: the whole of its flight.
    """
    whole = Flight(flown[0].duration, np.stack([each.coefficients for each in flown]))
    agents = []
    for agent in mission.agents:
        vehicle = agent.vehicle
        missed = vehicle.tracking + vehicle.start_skew * float(whole.speed[agent.index].max())
        agents.append(replace(agent, vehicle=replace(vehicle, tracking=missed, start_skew=0.0)))
    return replace(mission, agents=tuple(agents))


def _beside(mission: Mission, obstacle: Obstacle, stops: Sequence[Stop]) -> Check:
    """That nobody touches what moves or grows, at any of the stops: of each the worst."""
    checks: list[Check] = []
    for stop in stops:
        seconds = stop.seconds + HOVER
        alone = replace(
            mission,
            obstacles=(_since(obstacle, stop.at, seconds),),
        )
        flight = Flight(stop.pieces[0].duration, np.stack([own.coefficients for own in stop.pieces]))
        found: list[Check] = []
        prove_all(alone, obstacles(alone, flight, False), found, [])
        checks.append(replace(found[0], at=stop.at))
    return min(checks, key=lambda check: (check.passed, check.margin))


def _since(obstacle: Obstacle, time: float, seconds: float) -> Obstacle:
    """An obstacle on a clock that begins at a time, for so many seconds, as large as it is after them."""
    shape = grown_shape(obstacle.shape, obstacle.grown(time + seconds)) if obstacle.growth else obstacle.shape
    if not isinstance(obstacle.motion, Path):
        return replace(obstacle, shape=shape, growth=0.0)
    knots, offsets = np.array(obstacle.motion.times), np.array(obstacle.motion.offsets)
    inner = [each - time for each in obstacle.motion.times if 0 < each - time < seconds]
    times = np.array([0.0, *inner, seconds])
    rows = np.stack([np.interp(times + time, knots, axis) for axis in offsets.T], axis=-1)
    path = Path(tuple(map(Seconds, times.tolist())), tuple(map(tuple, rows.tolist())))
    return replace(obstacle, shape=shape, motion=path, growth=0.0)


def _landing(mission: Mission, stops: Sequence[Stop]) -> Check:
    """That whoever lands touches nobody: who lands with it, who hovers still, who has landed, and what stands there."""
    margins = [(margin, stop.at, index) for stop in stops for index, margin in landing_margins(mission, stop)]
    if not margins:
        return Check("landing", "stops", 0.0, "m", WAYPOINT, True, detail="nobody lands")
    worst, when, who = min(margins)
    detail = "whoever lands after a stop goes straight down clear of all others and of what stands there"
    name = mission.agents[who].name
    worst = min(worst, FARTHEST)
    return judged("landing", "stops", worst, "m", WAYPOINT, at=when, agents=(name,), detail=detail)


def _endurance(mission: Mission, stops: Sequence[Stop], aloft: float) -> list[Check]:
    """That batteries last until everybody who lands after a stop stands."""
    ends = [aloft + stop.at + stop.seconds + sum(stop.landing(mission)) for stop in stops]
    latest = max(ends)
    return [
        Check(
            "endurance",
            agent.name,
            agent.vehicle.endurance - latest,
            "s",
            0.0,
            latest <= agent.vehicle.endurance,
            agents=(agent.name,),
            detail=f"after the last stop to end everybody stands {latest:g} s after the take-off began",
        )
        for agent in mission.agents
        if math.isfinite(agent.vehicle.endurance)
    ]
