"""A Crazyflie's polynomials for every agent, in the uav_trajectories format, verified as they are written.

    in   Mission, the verified Trace
    out  the files, and the certificate of what is in them
    says MC703

A fit of each agent alone is tried first, with two pieces for each step if they
fit into the memory, else with one; and where there are more steps than the
memory holds pieces, with a piece for several steps, that passes near each.
Where that brings two agents, or an agent and an obstacle, closer than the
mission allows, planes are put between them and those agents are fitted
together. The steps where even this fails get more pieces, and those beside
them. With two pieces for each step there is always a solution on straight
motion beside what stands still: to rest at each step, all agents in the same
rhythm. Beside a moving obstacle the flight has to keep time with the plan,
which takes more pieces, and more room the later it comes to speed.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from missionc.diagnostics.code import NOT_FLYABLE
from missionc.diagnostics.model import Diagnostic, Label
from missionc.emit.conflicts import Held, Near, conflicts, held_apart
from missionc.emit.fit import Course, Fitted, NoFit, Plane, fit
from missionc.ir import PLAIN, DoubleIntegrator, Mission
from missionc.kernel.nodes import Kernel
from missionc.plan import Array, Trace
from missionc.verify.certificate import Certificate, Check
from missionc.verify.columns import Pieces, written
from missionc.verify.curves import Curves, Indices, motion, refined, values
from missionc.verify.polynomials import MEMORY_BYTES, verify_polynomials
from missionc.verify.tolerances import TUBE
from missionc.verify.vehicles import PIECE_BYTES

ROUNDS = 12
"""Refits with more planes before steps get more pieces."""
NARROWEST = 1e-3
"""Metres: a tube is not halved below this."""
NEGLIGIBLE = 1e-9
"""Metres: a parabola that leaves its chord by less is straight."""
EXCESS = 1e-6
"""Metres: a bound of the fit that is exceeded by more is not kept."""
COMPRESSED = {2: 131, 3: 90}
"""Pieces that the memory holds in the firmware's compressed format, by the mission's dimension."""
SLACK = 5e-3
"""Metres: how far from a step's position a piece of several steps may pass."""
HALVINGS, SHORTEST = 3, 0.1
"""How often a step's pieces may be halved; and the seconds that they last at least, after the first time."""


@dataclass(frozen=True, slots=True, eq=False)
class Flyable:
    """The text of each agent's file, by the agent's name, and what was verified on it."""

    files: dict[str, str]
    certificate: Certificate


@dataclass(frozen=True, slots=True)
class _Stuck:
    """No polynomials were found: what they fail, if there were any, and the steps that leave too little room."""

    failed: Check | None
    steps: tuple[int, ...]


@dataclass(frozen=True, slots=True, eq=False)
class _Tight:
    """Polynomials on which no bodies touch, but ``short`` metres closer than asked: taken if there are no better."""

    flyable: Flyable
    short: float
    steps: tuple[int, ...]


def crazyflie(mission: Mission, kernel: Kernel, trace: Trace) -> Flyable | Diagnostic:
    """Polynomials that keep what the plan keeps, or why there are none."""
    chords = _chords(mission, trace)
    few: list[_Tight | _Stuck] = []
    for count in _mergers(mission, chords):
        merged = _attempt(mission, kernel, trace, chords, count)
        if isinstance(merged, Flyable):
            return merged
        few.append(merged)
    pieces = np.maximum(chords, 2 if chords.size == 1 else 1)
    attempts: list[_Tight | _Stuck] = []
    generous = _generous(pieces)
    if not np.array_equal(generous, pieces):
        found = _attempt(mission, kernel, trace, generous)
        if isinstance(found, Flyable):
            return found
    while True:
        found = _attempt(mission, kernel, trace, pieces)
        if isinstance(found, Flyable):
            return found
        attempts.append(found)
        more = _more(pieces, chords, found.steps, trace.step)
        if np.array_equal(more, pieces):
            break
        pieces = more
    tight = [attempt for attempt in attempts if isinstance(attempt, _Tight)]
    if tight:
        return min(tight, key=lambda attempt: attempt.short).flyable
    return _not_flyable(mission, [attempt for attempt in (*few, *attempts) if isinstance(attempt, _Stuck)])


def _chords(mission: Mission, trace: Trace) -> Indices:
    """(steps,): so many that a parabola leaves its tube at least half of the width."""
    count = np.ceil(np.sqrt(_bulge(mission, motion(mission, trace)) / (TUBE / 2))).astype(np.int64)
    return np.maximum(count, 1)


def _mergers(mission: Mission, chords: Indices) -> list[int]:
    """How many pieces there may be where they are to be fewer than there are legs: as many as a memory holds."""
    return [count for count in (MEMORY_BYTES // PIECE_BYTES, COMPRESSED[mission.dimension]) if count < chords.sum()]


def _generous(pieces: Indices) -> Indices:
    """Two for each step, or for the first and the last, where a Crazyflie's memory holds them: slower and gentler."""
    ends = pieces.copy()
    ends[[0, -1]] = np.maximum(pieces[[0, -1]], 2)
    for more in (np.maximum(pieces, 2), ends):
        if more.sum() <= MEMORY_BYTES // PIECE_BYTES:
            return more
    return pieces


def _more(pieces: Indices, chords: Indices, steps: tuple[int, ...], step: float) -> Indices:
    """Twice as many where there is too little room, half of that beside it; if no more can be, two everywhere."""
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
    mission: Mission, kernel: Kernel, trace: Trace, legs: Indices, count: int = 0
) -> Flyable | _Tight | _Stuck:
    """With so many legs for each step: each a piece of its own, or in so many pieces if there is a ``count``."""
    course = _course(mission, trace, legs, count)
    step_of = np.repeat(np.arange(legs.size), legs)
    knots = course.times[course.knot]
    coefficients = np.zeros((len(mission.agents), knots.size - 1, mission.dimension, 8))
    excess = np.zeros((len(mission.agents), step_of.size))
    held: Held = {}
    stale = {agent.index for agent in mission.agents}
    found: list[Near] = []
    for _ in range(ROUNDS):
        planes = [plane for each in held.values() for plane in each]
        for group in _groups(planes, stale):
            fitted = _fit(mission, course, planes, group)
            if isinstance(fitted, NoFit):
                return _Stuck(None, ())
            coefficients[group] = _rounded(fitted.points, np.diff(knots))
            excess[group] = fitted.excess
        level = refined(Curves(knots, coefficients), course.times)
        found = conflicts(mission, level, held)
        radius = _narrowed(course.radius, [near for near in found if near in held and not near.moving])
        more = held_apart(mission, course, held, found, level)
        if more == held and np.array_equal(radius, course.radius):
            break
        held, course = more, replace(course, radius=radius)
        stale = {agent for near in found for agent in near.agents}
    steps = {*step_of[excess.max(axis=0) > EXCESS].tolist(), *(int(step_of[near.leg]) for near in found)}
    files = _texts(mission, coefficients, np.diff(knots))
    certificate = verify_polynomials(mission, kernel, trace, files)
    if not certificate.passed:
        failed = min(certificate.failures, key=lambda check: (check.at is None, check.margin))
        if failed.at is not None:
            steps.add(min(int(failed.at / trace.step), mission.steps - 1))
        return _Stuck(failed, tuple(sorted(steps)))
    if not found:
        return Flyable(files, certificate)
    return _Tight(Flyable(files, certificate), max(near.short for near in found), tuple(sorted(steps)))


def _course(mission: Mission, trace: Trace, legs: Indices, count: int) -> Course:
    """Segments to stay near, and the times of the joints; all pieces of a step last the same float32 number of seconds.

    A step's legs share its segment; where a parabola bends it, each has its own
    chord.
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
    return Course(times, joint, fixed, start, end, radius, knot, slack)


def _shared(legs: Indices, count: int) -> Indices:
    """(all legs,): which of ``count`` pieces each is in; the first and the last, at rest at one end, are alone."""
    total = int(legs.sum())
    return np.searchsorted(np.round(np.linspace(1, total - 1, count - 1)), np.arange(total), side="right")


def _bulge(mission: Mission, planned: Curves) -> Array:
    """(steps,), metres: how far any parabola of a step leaves its chord."""
    chosen = [agent.index for agent in mission.agents if isinstance(agent.dynamics, DoubleIntegrator)]
    if not chosen:
        return np.zeros(planned.durations.size)
    bend = np.linalg.norm(planned.coefficients[chosen, :, :, 2], axis=-1) * 2
    bulge: Array = (bend * planned.durations**2 / 8).max(axis=0)
    return np.where(bulge > NEGLIGIBLE, bulge, 0.0)


def _groups(planes: list[Plane], stale: set[int]) -> list[list[int]]:
    """Agents to be fitted together, of those that are ``stale`` and all that planes tie them to."""
    root = {index: index for index in stale}
    for plane in planes:
        for index in (plane.first, plane.second):
            root.setdefault(index, index)

    def find(index: int) -> int:
        while root[index] != index:
            root[index] = root[root[index]]
            index = root[index]
        return index

    for plane in planes:
        first, second = sorted((find(plane.first), find(plane.second)))
        root[second] = first
    groups: dict[int, list[int]] = {}
    for index in sorted(root):
        groups.setdefault(find(index), []).append(index)
    return [group for group in groups.values() if stale.intersection(group)]


def _fit(mission: Mission, course: Course, planes: list[Plane], group: list[int]) -> Fitted | NoFit:
    place = {index: position for position, index in enumerate(group)}
    start, end, radius = course.start[group], course.end[group], course.radius[group]
    own = replace(course, joint=course.joint[group], start=start, end=end, radius=radius)
    held = [
        replace(plane, first=place[plane.first], second=place[plane.second]) for plane in planes if plane.first in place
    ]
    return fit(own, held, np.array(mission.world.low), np.array(mission.world.high))


def _narrowed(radius: Array, again: list[Near]) -> Array:
    """Planes did not end these conflicts (a shape that is not convex): the tubes are halved there."""
    radius = radius.copy()
    for near in again:
        for index in (near.first, near.other):
            if isinstance(index, int):
                radius[index, near.leg] = max(NARROWEST, radius[index, near.leg] / 2)
    return radius


def _rounded(points: Array, durations: Array) -> Array:
    """Control points to coefficients in float32: (agents, pieces, dim, 8) to the same, ascending powers of seconds."""
    difference = points
    columns = []
    for power in range(8):
        columns.append(difference[..., 0] * math.comb(7, power) / (durations**power)[:, None])
        difference = np.diff(difference, axis=-1)
    return np.stack(columns, axis=-1).astype(np.float32).astype(np.float64)


def _texts(mission: Mission, coefficients: Array, durations: Array) -> dict[str, str]:
    files = {}
    for agent in mission.agents:
        rows = np.zeros((durations.size, 4, 8))
        rows[:, : mission.dimension] = coefficients[agent.index]
        if mission.dimension == 2:
            rows[:, 2, 0] = np.float32(agent.altitude)
        files[agent.name] = written(Pieces(durations, rows))
    return files


def _not_flyable(mission: Mission, attempts: list[_Stuck]) -> Diagnostic:
    """Said of the attempt that came nearest."""
    tried = [attempt.failed for attempt in attempts if attempt.failed is not None]
    failed = max(tried, key=lambda check: (check.at is not None, check.margin), default=None)
    plain = all(agent.vehicle == PLAIN for agent in mission.agents)
    spans = {agent.name: agent.span for agent in mission.agents}
    names = failed.agents if failed and failed.agents else (mission.agents[0].name,)
    who = " and ".join(f"`{name}`" for name in names)
    message, why = f"no polynomials fly the plan of {who}", "no curve was found that stays near the plan"
    help_ = "give the agents more time for their ways: a larger `step`, or slower `dynamics`"
    match failed:
        case Check(name="flown obstacle", subject=obstacle, margin=margin, at=float(at)) if plain:
            message += f" clear of `{obstacle}`: they would touch at {at:.2f} s"
            why = f"the best that was found overlaps by {-margin - mission.clearance:.3g} m there"
            help_ = f"give the plan more room there: a `clearance` above {mission.clearance:g} m, or another start"
        case Check(name="flown separation", margin=margin, at=float(at)) if plain:
            message += f": they would touch at {at:.2f} s"
            why = f"the best that was found overlaps by {-margin - mission.separation:.3g} m there"
            help_ = f"give the plan more room there: a `separation` above {mission.separation:g} m, or other starts"
        case Check(name=name, margin=margin, unit=unit, at=float(at)):
            message += f" at {at:.2f} s"
            why = f"in the best that was found `{name}` fails by {-margin:.3g} {unit}"
        case _:
            pass
    return Diagnostic(
        NOT_FLYABLE,
        message,
        Label(spans[names[0]]),
        notes=(why, f"they start and end at rest, and stay within {TUBE:g} m of the verified motion"),
        help=help_,
    )
