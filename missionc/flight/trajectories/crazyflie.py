"""Trajectory generation for Crazyflies: polynomials and yaw of every agent, verified as they are written.

    in   Mission, the verified Trace
    out  the files, and the certificate of what is in them
    says MC703 MC711

Each agent is first fitted alone. It has two pieces for each step if they fit into the memory, else one. If there are
more steps than the memory holds pieces, a piece spans several steps and passes near each.

If two agents, or an agent and an obstacle, then come closer than the mission allows, separating planes are added and
those agents are fitted together. Steps at which even this fails, and adjacent ones, get more pieces. On straight motion
beside static obstacles, two pieces for each step always have a solution: rest at each step, all agents in the same
rhythm. Beside a moving obstacle the flight must follow the plan's timing, which takes more pieces, and more clearance
if it accelerates late.

A flight beyond its vehicle's limits is fitted again with cuts. If no flight in the plan's time stays within them, the
message states the longer time that the closest flight needs.

Yaw is another coordinate on the flight's own pieces, within its rate limit. A single direction is a constant. Along the
path, yaw is the spline nearest to the direction of the flown velocity whose control points keep the rate within the
limit. It rests at both ends, or begins in a turn that is under way; if the agent hovers, yaw stays at the last
direction of flight.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import assert_never

import numpy as np
from scipy.sparse import block_diag, csr_array, eye_array, kron

from missionc.base.diagnostics.model import Diagnostic
from missionc.base.late_dataclass import Record
from missionc.base.trace import Array, Indices, Trace
from missionc.flight.trajectories.fit_polynomials import (
    REST,
    Bounds,
    Course,
    Cut,
    Fitted,
    NoFit,
    Plane,
    Program,
    Splines,
    begins_with,
    fit,
    splines,
)
from missionc.flight.trajectories.refusals import not_flyable, too_fast
from missionc.flight.trajectories.separating_planes import Held, Near, conflicts, groups, held_apart, narrowed
from missionc.flight.trajectories.vehicle_limits import (
    SHARE,
    Limit,
    Peak,
    cuts,
    in_parts,
    limits_of,
    peaks,
    spare_performance,
)
from missionc.geometry.curves.piecewise_polynomials import Curves, Pieces, motion, refined, values, written
from missionc.geometry.curves.smooth_splines import DEGREE, JOIN, bernstein, control_points_of, effort, rounded
from missionc.ir import Agent, AlongPath, Fixed, Mission, Yaw
from missionc.ir.kernel.nodes import Kernel
from missionc.ir.lower.tighten import with_vehicle_room
from missionc.verification.certificate import TUBE, WAYPOINT, Certificate, Check
from missionc.verification.flight.continuity_and_fidelity import check_flight, tube
from missionc.verification.flight.verify_polynomials import PIECE_BYTES, prove, verify_polynomials

SAMPLES = 16
"""Number of samples of the flight direction in each piece."""
HOVERING, DRIFTING = 0.05, 0.1
"""Speed below which an agent hovers: in m/s, and as a fraction of its largest speed, since rounding makes stops
drift.
"""
FAINT = 0.05
"""Weight of a direction sample while hovering, relative to a sample in motion."""
CALM = 0.1
"""Time constant in seconds: faster changes of yaw are smoothed."""


def pointing(yaw: Yaw, most: float, flight: Curves, begin: Array | None = None) -> Array:
    """Yaw polynomials of an agent, rad, in ascending powers of the seconds since the piece began: (pieces, 8).

    The values are float32.

    Args:
        most: rate limit, rad/s.
        flight: flight of one agent: (1, pieces, dim, 8).
        begin: (5,): initial yaw and derivatives up to the fourth, if it begins in motion.
    """
    match yaw:
        case Fixed(angle):
            constant = np.zeros((flight.durations.size, DEGREE + 1))
            constant[:, 0] = np.float32(angle)
            return constant
        case AlongPath():
            return _along(most, flight, begin)
        case _:
            assert_never(yaw)


def _along(most: float, flight: Curves, begin: Array | None) -> Array:
    share = (np.arange(SAMPLES) + 0.5) / SAMPLES
    durations = flight.durations
    target, weight = _directions(flight, share)
    if begin is not None:  # the same directions, continuing the previous turns
        target = target + 2 * math.pi * np.round((begin[0] - target[0]) / (2 * math.pi))
    points = control_points_of(flight.times)
    free, fixed = _ends(points, durations, begin)
    curve, known = csr_array(points @ free), np.asarray(points @ fixed)
    sampled = csr_array(kron(eye_array(durations.size), bernstein(share)))
    seen = csr_array(sampled @ curve)
    weight = weight * np.repeat(durations / SAMPLES, SAMPLES)
    calm = CALM**4 * (curve.T @ block_diag(list(effort(2, durations))))
    quadratic = csr_array(seen.T @ (seen * weight[:, None]) + calm @ curve)
    linear: Array = np.asarray(calm @ known - seen.T @ (weight * (target - sampled @ known)))
    count = linear.size
    rates = _rates(most, durations, curve, known)
    solved = Program(quadratic, linear, csr_array((0, count)), np.zeros(0), (rates,)).within(1)
    # An agent that never turns is within every rate limit.
    still = target[0] if begin is None else begin[0]
    numbers = np.full(count, still) if isinstance(solved, NoFit) else solved.numbers
    found = np.asarray(curve @ numbers + known).reshape(-1, 1, DEGREE + 1)
    return rounded(found, durations)[:, 0]


def _directions(flight: Curves, share: Array) -> tuple[Array, Array]:
    """Unwrapped direction of the flown velocity at samples, rad, and weights of the samples: (pieces * samples,) twice.

    Args:
        share: times of the samples as fractions of a piece.
    """
    velocity = flight.derivative().coefficients[0][:, None]
    flown = values(np.repeat(velocity, share.size, axis=1), share * flight.durations[:, None]).reshape(
        -1, velocity.shape[-2]
    )
    speed = np.linalg.norm(flown[:, :2], axis=-1)
    moving = np.flatnonzero(speed > max(HOVERING, DRIFTING * float(speed.max())))
    if not moving.size:
        return np.zeros(len(flown)), np.ones(len(flown))
    direction = np.unwrap(np.arctan2(flown[moving, 1], flown[moving, 0]))
    last = np.maximum(np.searchsorted(moving, np.arange(len(flown)), side="right") - 1, 0)
    weight = np.full(len(flown), FAINT)
    weight[moving] = 1.0
    return direction[last], weight


def _ends(points: csr_array, durations: Array, begin: Array | None) -> tuple[csr_array, Array]:
    """Map from the free yaw coefficients to all, (coefficients, free), and the fixed initial ones, (coefficients,),
    rad.

    At rest, the last coefficients are equal, and so are the first ones.
    """
    count = points.shape[1]
    known, first = np.zeros(count), REST - 1
    if begin is not None:
        first = begin.size
        wanted = begins_with(begin[:, None], float(durations[0]))[0]
        known[:first] = np.linalg.solve(points[:first, :first].toarray(), wanted)
    number = np.minimum(np.arange(count), count - REST) - first
    chosen = np.flatnonzero(number >= 0) if begin is not None else np.arange(count)
    column = np.maximum(number, 0)[chosen]
    return csr_array((np.ones(chosen.size), (chosen, column)), shape=(count, int(column.max()) + 1)), known


def _rates(most: float, durations: Array, curve: csr_array, known: Array) -> Bounds:
    """Bounds on the control points of the yaw rate, rad/s, in parts of every piece.

    Args:
        most: rate limit, rad/s.
        curve: map from coefficients to control points.
        known: constant part of the control points, rad, (points,).
    """
    if math.isinf(most):
        return Bounds(csr_array((0, curve.shape[1])), np.zeros(0), np.zeros(0), np.zeros(0, dtype=np.int64))
    form = in_parts(1)
    changes = csr_array(block_diag([form / duration for duration in durations.tolist()]))
    rate, begun = csr_array(changes @ curve), changes @ known
    high = np.full(rate.shape[0], SHARE * most)
    return Bounds(rate, -high - begun, high - begun, np.zeros(rate.shape[0], dtype=np.int64))


ROUNDS = 12
"""Maximum number of refits with more planes before steps get more pieces."""
CUTTING = 8
"""Maximum number of refits with more cuts before a vehicle's limits count as infeasible."""
NEGLIGIBLE = 1e-9
"""Deviation of a parabola from its chord below which it counts as straight, metres."""
EXCESS = 1e-6
"""Violation of the fit's bounds up to which a fit is accepted, metres."""
COMPRESSED, COMPRESSED_YAW, COMPRESSED_ENDS = {2: 31, 3: 45}, 14, 11
"""Memory in the firmware's compressed format, bytes: of a piece, by the mission's dimension; of its yaw; of the two
ends.
"""
SLACK = 0.98 * WAYPOINT
"""Tolerance of a step's position if a piece spans several steps, metres; smaller than the full one, for rounding."""
HALVINGS, SHORTEST = 3, 0.1
"""Maximum number of halvings of a step's pieces; and their minimum duration, seconds, after the first halving."""


class Flyable(Record, eq=False):
    """Text of each agent's trajectory file, by agent name, and the certificate of the trajectories."""

    files: dict[str, str]
    certificate: Certificate


class _Stuck(Record):
    """Result of a fit without valid polynomials: the failed check, if any, and the steps with too little clearance."""

    failed: Check | None
    steps: tuple[int, ...]


class _Beyond(Record):
    """Result of a fit whose polynomials exceed some vehicle limits, by agent name."""

    peaks: tuple[tuple[str, Peak], ...]

    @property
    def stretch(self) -> float:
        return max(peak.stretch for _, peak in self.peaks)


class _Tight(Record, eq=False):
    """Result of a fit without contact, but ``short`` metres closer than required; used if there is no better one."""

    flyable: Flyable
    short: float
    steps: tuple[int, ...]


def crazyflie(mission: Mission, kernel: Kernel, trace: Trace, stretch: float = 1.0) -> Flyable | Diagnostic:
    """Polynomials that satisfy the same requirements as the plan, or a diagnostic with the reason why there are none.

    Args:
        stretch: time-scaling factor of the plan, for messages only.
    """
    chords, apart = _chords(mission, trace), with_vehicle_room(mission)
    attempts: list[_Tight | _Beyond | _Stuck] = []
    few: list[_Tight | _Stuck] = []
    for count in _mergers(mission, chords):
        merged = _attempt(mission, apart, kernel, trace, chords, count)
        if isinstance(merged, Flyable):
            return merged
        if isinstance(merged, _Beyond):
            attempts.append(merged)
        else:
            few.append(merged)
    pieces = np.maximum(chords, 2 if chords.size == 1 else 1)  # two to come to rest, even from a motion
    generous = _generous(mission, pieces)
    if not np.array_equal(generous, pieces):
        attempt = _attempt(mission, apart, kernel, trace, generous)
        if isinstance(attempt, Flyable):
            return attempt
        attempts += [attempt] if isinstance(attempt, _Beyond) else []
    while not any(isinstance(attempt, _Beyond) for attempt in attempts):
        attempt = _attempt(mission, apart, kernel, trace, pieces)
        if isinstance(attempt, Flyable):
            return attempt
        attempts.append(attempt)
        more = _more(pieces, chords, attempt.steps, trace.step) if not isinstance(attempt, _Beyond) else pieces
        if np.array_equal(more, pieces):
            break
        pieces = more
    tight = [attempt for attempt in attempts if isinstance(attempt, _Tight)]
    if tight:
        return min(tight, key=lambda attempt: attempt.short).flyable
    beyond = [attempt for attempt in attempts if isinstance(attempt, _Beyond)]
    if beyond:
        return too_fast(mission, min(beyond, key=lambda attempt: attempt.stretch).peaks, stretch)
    stuck = [attempt for attempt in (*few, *attempts) if isinstance(attempt, _Stuck)]
    return not_flyable(mission, [attempt.failed for attempt in stuck if attempt.failed is not None])


def _chords(mission: Mission, trace: Trace) -> Indices:
    """Number of chords for each step such that a parabola leaves at least half of its tube's width: (steps,)."""
    count = np.ceil(np.sqrt(_bulge(mission, motion(mission, trace)) / (TUBE / 2))).astype(np.int64)
    return np.maximum(count, 1)


def _mergers(mission: Mission, chords: Indices) -> list[int]:
    """Possible total numbers of pieces that the memory allows and that are fewer than the number of chords."""
    turning = any(isinstance(agent.yaw, AlongPath) for agent in mission.agents)
    compressed = (_memory(mission) - COMPRESSED_ENDS) // (COMPRESSED[mission.dimension] + turning * COMPRESSED_YAW)
    return [count for count in (_memory(mission) // PIECE_BYTES, compressed) if 3 <= count < chords.sum()]


def _memory(mission: Mission) -> int:
    """Size of the smallest vehicle memory, bytes, since all files have the same pieces."""
    return min(agent.vehicle.memory for agent in mission.agents)


def _generous(mission: Mission, pieces: Indices) -> Indices:
    """Number of pieces for each step: two, or two for the first and the last step, if every memory allows.

    More pieces make the flight slower and smoother.
    """
    ends = pieces.copy()
    ends[[0, -1]] = np.maximum(pieces[[0, -1]], 2)
    for more in (np.maximum(pieces, 2), ends):
        if more.sum() <= _memory(mission) // PIECE_BYTES:
            return more
    return pieces


def _more(pieces: Indices, chords: Indices, steps: tuple[int, ...], step: float) -> Indices:
    """Number of pieces for each step after an increase at the steps with too little clearance.

    Those steps get twice as many pieces, adjacent steps half of that. At the limit, every step gets two.

    Args:
        steps: steps with too little clearance.
        step: duration of a step, seconds.
    """
    more = pieces.copy()
    for index in steps:
        if pieces[index] < 2 * chords[index] or step / pieces[index] >= 2 * SHORTEST:
            more[index] = min(2 * pieces[index], chords[index] << HALVINGS)
    for index in steps:
        for beside in (index - 1, index + 1):
            if 0 <= beside < more.size:
                times = more[index] // chords[index] // 2
                more[beside] = max(more[beside], chords[beside] * times)
    return more if (more > pieces).any() else np.maximum(pieces, 2 * chords)


def _attempt(
    mission: Mission, apart: Mission, kernel: Kernel, trace: Trace, legs: Indices, count: int = 0
) -> Flyable | _Tight | _Beyond | _Stuck:
    """Result of a fit with ``legs`` legs per step: each a separate piece, or ``count`` pieces in all.

    The separation is that of ``apart``, the mission with the vehicles' clearance.
    """
    course = _course(mission, trace, legs, count)
    shared = splines(course)
    step_of = np.repeat(np.arange(legs.size), legs)
    knots = course.times[course.knot]
    coefficients = np.zeros((len(mission.agents), knots.size - 1, mission.dimension, 8))
    excess = np.zeros((len(mission.agents), step_of.size))
    limits = {agent.index: limits_of(agent.vehicle) for agent in mission.agents}
    held: Held = {}
    known_cuts: list[Cut] = []
    stale = {agent.index for agent in mission.agents}
    near_misses: list[Near] = []
    for _ in range(ROUNDS):
        planes = [plane for each in held.values() for plane in each]
        for group in groups(planes, stale):
            fitted = _within_limits(mission, course, shared, planes, group, limits, known_cuts)
            if isinstance(fitted, NoFit):
                return _Stuck(None, ())
            coefficients[group] = rounded(fitted.points, np.diff(knots))
            excess[group] = fitted.excess
            if count and not planes and excess[group].max() > EXCESS:
                # More bounds do not bring it nearer to the plan.
                far = [_far(mission, trace, mission.agents[index], coefficients[index], knots) for index in group]
                if any(far):
                    return _Stuck(next(filter(None, far)), ())
        beyond = [
            (mission.agents[index].name, peak)
            for index in sorted(stale)
            for peak in peaks(limits[index], Curves(knots, coefficients[[index]]))
        ]
        if beyond:
            return _Beyond(tuple(beyond))
        level = refined(Curves(knots, coefficients), course.times)
        near_misses = conflicts(apart, level, held)
        radius = narrowed(course.radius, [near for near in near_misses if near in held and not near.moving])
        more = held_apart(apart, course, held, near_misses, level)
        if more == held and np.array_equal(radius, course.radius):
            break
        stale = {agent for near, planes in more.items() if planes is not held.get(near) for agent in near.agents}
        stale.update(np.flatnonzero((radius != course.radius).any(axis=1)).tolist())
        held, course = more, replace(course, radius=radius)
    steps = {*step_of[excess.max(axis=0) > EXCESS].tolist(), *(int(step_of[near.leg]) for near in near_misses)}
    yaw = [
        pointing(each.yaw, each.vehicle.yaw_rate, Curves(knots, coefficients[[each.index]]), _turning(each))
        for each in mission.agents
    ]
    files = _texts(mission, coefficients, np.stack(yaw), np.diff(knots))
    certificate = verify_polynomials(mission, kernel, trace, files)
    if not certificate.passed:
        failed = min(certificate.failures, key=lambda check: (check.at is None, check.margin))
        if failed.at is not None:
            steps.add(min(int(failed.at / trace.step), mission.steps - 1))
        return _Stuck(failed, tuple(sorted(steps)))
    if not near_misses:
        return Flyable(files, certificate)
    return _Tight(Flyable(files, certificate), max(near.short for near in near_misses), tuple(sorted(steps)))


def _course(mission: Mission, trace: Trace, legs: Indices, count: int) -> Course:
    """Segments that the fit follows, and times of the joints; all pieces of a step have equal float32 durations.

    A step's legs share its segment; on a parabola, each has its own chord.
    """
    planned = motion(mission, trace)
    step_of = np.repeat(np.arange(legs.size), legs)
    within = np.arange(step_of.size) - np.repeat(np.cumsum(legs) - legs, legs)
    share = within / legs[step_of] * trace.step
    inner = values(planned.coefficients[:, step_of], np.broadcast_to(share, (len(mission.agents), share.size)))
    fixed = np.append(within == 0, True)
    joint = np.concatenate([inner, trace.position[:, -1:]], axis=1)
    joint[:, fixed] = trace.position
    bulge = (_bulge(mission, planned) / legs**2)[step_of]
    bent = (bulge > 0)[:, None]
    start = np.where(bent, joint[:, :-1], trace.position[:, step_of])
    end = np.where(bent, joint[:, 1:], trace.position[:, step_of + 1])
    radius = np.tile(TUBE - bulge, (len(mission.agents), 1))
    lasting = trace.step / legs[step_of]
    pieces = _shared(legs, count) if count else np.arange(step_of.size)
    knot = np.append(np.diff(pieces, prepend=-1) > 0, True)
    durations = np.bincount(pieces, lasting).astype(np.float32).astype(np.float64)
    knots = np.concatenate([[0.0], np.cumsum(durations)])
    before = np.cumsum(lasting) - lasting
    begin = before[knot[:-1]][pieces]
    times = np.append(
        knots[pieces] + (before - begin) / np.bincount(pieces, lasting)[pieces] * durations[pieces], knots[-1]
    )
    times[knot] = knots
    slack = SLACK if count else 0.0
    course = Course(times, joint, fixed, start, end, radius, knot, slack)
    return replace(course, begin=_beginning(mission, course)) if _in_motion(mission) else course


def _in_motion(mission: Mission) -> bool:
    """Return whether some agents are in motion as the mission begins."""
    return any(agent.begins for agent in mission.agents)


def _beginning(mission: Mission, course: Course) -> Array:
    """First control points of each agent: (agents, dim, 5), metres; the course's first joint is moved to them."""
    states = np.zeros((len(mission.agents), JOIN + 1, mission.dimension))
    states[:, 0] = course.joint[:, 0]
    for agent in mission.agents:
        if agent.begins:
            states[agent.index] = np.array(agent.begins)[:, : mission.dimension]
    course.joint[:, 0] = states[:, 0]
    first = float(course.times[course.knot][1])
    return np.stack([begins_with(state, first) for state in states])


def _shared(legs: Indices, count: int) -> Indices:
    """Index of the piece that contains each leg, for ``count`` pieces: (all legs,).

    The first and the last leg, at rest at one end, are separate pieces.
    """
    total = int(legs.sum())
    return np.searchsorted(np.round(np.linspace(1, total - 1, count - 1)), np.arange(total), side="right")


def _bulge(mission: Mission, planned: Curves) -> Array:
    """Maximum deviation of each step's parabolas from their chords: (steps,), metres."""
    chosen = [agent.index for agent in mission.agents if agent.dynamics.has_momentum]
    if not chosen:
        return np.zeros(planned.durations.size)
    bend = np.linalg.norm(planned.coefficients[chosen, :, :, 2], axis=-1) * 2
    bulge: Array = (bend * planned.durations**2 / 8).max(axis=0)
    return np.where(bulge > NEGLIGIBLE, bulge, 0.0)


def _far(mission: Mission, trace: Trace, agent: Agent, coefficients: Array, knots: Array) -> Check | None:
    """Failed check of waypoints or tube if the fitted trajectory is too far from the plan; None if it is not.

    Args:
        coefficients: (pieces, dim, 8), metres.
        knots: joints of the pieces, seconds.
    """
    durations, planned = np.diff(knots), motion(mission, trace)
    own = Pieces(durations, _rows(mission, agent, coefficients, np.zeros((durations.size, DEGREE + 1))))
    checks = [check for check in check_flight(mission, agent, own, planned) if check.name == "waypoints"]
    checks.append(prove(mission, tube(mission, agent, own, planned))[0])
    return min((check for check in checks if not check.passed), key=lambda check: check.margin, default=None)


def _within_limits(
    mission: Mission,
    course: Course,
    shared: Splines,
    planes: list[Plane],
    group: list[int],
    limits: dict[int, list[Limit]],
    known_cuts: list[Cut],
) -> Fitted | NoFit:
    """Fit with the smallest excess over vehicle limits, after refits with additional cuts while a limit is exceeded."""
    knots = course.times[course.knot]
    durations = np.diff(knots)
    best, least, most = None, math.inf, None
    for _ in range(CUTTING):
        fitted = _fit(mission, course, shared, planes, group, known_cuts, most)
        if isinstance(fitted, NoFit):
            return best or fitted
        most = fitted.kept
        flown = rounded(fitted.points, durations)
        peaks_by_agent = [peaks(limits[index], Curves(knots, flown[[place]])) for place, index in enumerate(group)]
        worst = max((peak.stretch for own in peaks_by_agent for peak in own), default=0.0)
        if worst < least:
            best, least = fitted, worst
        if worst == 0.0:
            break
        for own, index, points in zip(peaks_by_agent, group, fitted.points, strict=True):
            known_cuts += cuts([peak.limit for peak in own], index, points, durations)
    return best or fitted


def _fit(
    mission: Mission,
    course: Course,
    shared: Splines,
    planes: list[Plane],
    group: list[int],
    known_cuts: list[Cut],
    most: int | None,
) -> Fitted | NoFit:
    place = {index: position for position, index in enumerate(group)}
    start, end, radius = course.start[group], course.end[group], course.radius[group]
    begin = None if course.begin is None else course.begin[group]
    own = replace(course, joint=course.joint[group], start=start, end=end, radius=radius, begin=begin)
    held = [
        replace(plane, first=place[plane.first], second=place[plane.second]) for plane in planes if plane.first in place
    ]
    cut = [replace(each, agent=place[each.agent]) for each in known_cuts if each.agent in place]
    return fit(own, held, *spare_performance(mission, own, group), cut, shared, most)


def _turning(agent: Agent) -> Array | None:
    """Yaw and its derivatives as the mission begins, (5,), rad and seconds; None if the agent begins at rest."""
    return np.array(agent.begins)[:, 3] if agent.begins else None


def _texts(mission: Mission, coefficients: Array, yaw: Array, durations: Array) -> dict[str, str]:
    return {
        agent.name: written(Pieces(durations, _rows(mission, agent, coefficients[agent.index], yaw[agent.index])))
        for agent in mission.agents
    }


def _rows(mission: Mission, agent: Agent, coefficients: Array, yaw: Array) -> Array:
    """Coefficients of x, y, z and yaw, (pieces, 4, 8), metres and rad, with the altitude of a plane mission."""
    rows = np.zeros((len(coefficients), 4, DEGREE + 1))
    rows[:, : mission.dimension] = coefficients
    rows[:, 3] = yaw
    if mission.dimension == 2:
        rows[:, 2, 0] = np.float32(agent.altitude)
    return rows
