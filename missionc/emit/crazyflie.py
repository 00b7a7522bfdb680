"""A Crazyflie's polynomials for every agent, in the uav_trajectories format, verified as they are written.

    in   Mission, the verified Trace
    out  the files, and the certificate of what is in them
    says MC703

A fit of each agent alone is tried first. Where that brings two agents, or an
agent and an obstacle, closer than the mission allows, planes are put between
them and those agents are fitted together; where even this fails, every step
gets more pieces. With two pieces for each step there is always a solution on
straight motion: to rest at each step, all agents in the same rhythm.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from missionc.diagnostics.code import NOT_FLYABLE
from missionc.diagnostics.model import Diagnostic, Label
from missionc.emit.conflicts import Near, conflicts, planes_for
from missionc.emit.fit import Course, NoFit, Plane, fit
from missionc.ir import DoubleIntegrator, Mission
from missionc.plan import Array, Trace
from missionc.verify.certificate import Certificate, Check
from missionc.verify.columns import COLUMNS
from missionc.verify.curves import Curves, motion, values
from missionc.verify.polynomials import verify_polynomials
from missionc.verify.tolerances import TUBE

ROUNDS = 12
"""Refits with more planes before every step gets more pieces."""
NARROWEST = 1e-3
"""Metres: a tube is not halved below this."""
PIECES = (1, 2, 4)
"""How many pieces a step may get, in the order they are tried."""


@dataclass(frozen=True, slots=True, eq=False)
class Flyable:
    """The text of each agent's file, by the agent's name, and what was verified on it."""

    files: dict[str, str]
    certificate: Certificate


@dataclass(frozen=True, slots=True)
class _Stuck:
    """Why no polynomials were found: the agents, the time, in words."""

    agents: tuple[int, ...]
    at: float | None
    why: str


@dataclass(frozen=True, slots=True, eq=False)
class _Tight:
    """Polynomials on which no bodies touch, but closer than the mission asks: taken if there are no better ones."""

    flyable: Flyable


def crazyflie(mission: Mission, trace: Trace) -> Flyable | Diagnostic:
    """Polynomials that keep what the plan keeps, or why there are none."""
    attempts: list[_Tight | _Stuck] = []
    for pieces in PIECES:
        found = _attempt(mission, trace, pieces)
        if isinstance(found, Flyable):
            return found
        attempts.append(found)
    for attempt in attempts:
        if isinstance(attempt, _Tight):
            return attempt.flyable
    return _not_flyable(mission, [attempt for attempt in attempts if isinstance(attempt, _Stuck)])


def _attempt(mission: Mission, trace: Trace, pieces: int) -> Flyable | _Tight | _Stuck:
    course, times = _course(mission, trace, pieces)
    if course.fixed.size < 3:
        return _Stuck((), None, "a trajectory of one piece cannot be uploaded")
    planes: list[Plane] = []
    known: set[Near] = set()
    stale = {agent.index for agent in mission.agents}
    coefficients = np.zeros((len(mission.agents), times.size - 1, mission.dimension, 8))
    for _ in range(ROUNDS):
        for group in _groups(planes, stale):
            points = _fit(mission, course, planes, group)
            if not isinstance(points, NoFit):
                coefficients[group] = _rounded(points, times[1])
            elif not known:
                why = f"no curve of {pieces} piece{'s' if pieces > 1 else ''} for each step stays near the plan"
                return _Stuck(tuple(group), None, why)
        found = conflicts(mission, Curves(times, coefficients))
        new = [plane for near in found if near not in known for plane in planes_for(mission, course, times, near)]
        radius = _narrowed(course.radius, [near for near in found if near in known])
        if not new and np.array_equal(radius, course.radius):
            break
        course, planes = replace(course, radius=radius), planes + new
        known.update(found)
        stale = {near.first for near in found} | {near.other for near in found if isinstance(near.other, int)}
    files = _texts(mission, coefficients, times)
    certificate = verify_polynomials(mission, trace, files)
    if not certificate.passed:
        return _refused(mission, certificate.failures[0])
    return _Tight(Flyable(files, certificate)) if found else Flyable(files, certificate)


def _refused(mission: Mission, check: Check) -> _Stuck:
    index = {agent.name: agent.index for agent in mission.agents}
    at = "" if check.at is None else f" at {check.at:.2f} s"
    short = f"{max(0.0, -check.margin):.3g} {check.unit}"
    why = f"{check.name} of {check.subject} fails by {short}{at}"
    return _Stuck(tuple(index[name] for name in check.agents), check.at, why)


def _course(mission: Mission, trace: Trace, pieces: int) -> tuple[Course, Array]:
    """Segments to stay near, and the times of the joints; all pieces last the same float32 number of seconds."""
    planned = motion(mission, trace)
    bulge = _bulge(mission, planned)
    if bulge > 0:
        # So many chords that a parabola leaves its tube at least half of the width.
        pieces *= max(1, math.ceil(math.sqrt(bulge / (TUBE / 2))))
    steps = planned.durations.size
    duration = float(np.float32(trace.step / pieces))
    share = np.arange(pieces) / pieces * trace.step
    inner = values(planned.coefficients[:, :, None], np.broadcast_to(share, (len(mission.agents), steps, pieces)))
    last = trace.position[:, -1:]
    joint = np.concatenate([inner.reshape(len(mission.agents), -1, mission.dimension), last], axis=1)
    fixed = np.arange(steps * pieces + 1) % pieces == 0
    joint[:, fixed] = trace.position
    if bulge > 0:
        start, end = joint[:, :-1], joint[:, 1:]
        radius = np.full(start.shape[:2], TUBE - bulge / pieces**2)
    else:
        start = np.repeat(trace.position[:, :-1], pieces, axis=1)
        end = np.repeat(trace.position[:, 1:], pieces, axis=1)
        radius = np.full(start.shape[:2], TUBE)
    times: Array = duration * np.arange(steps * pieces + 1, dtype=np.float64)
    return Course(joint, fixed, start, end, radius), times


def _bulge(mission: Mission, planned: Curves) -> float:
    """How far any parabola of a step leaves its chord, metres."""
    if planned.coefficients.shape[-1] < 3:
        return 0.0
    chosen = [agent.index for agent in mission.agents if isinstance(agent.dynamics, DoubleIntegrator)]
    bend = np.linalg.norm(planned.coefficients[chosen, :, :, 2], axis=-1) * 2
    return float((bend * planned.durations**2 / 8).max())


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


def _fit(mission: Mission, course: Course, planes: list[Plane], group: list[int]) -> Array | NoFit:
    place = {index: position for position, index in enumerate(group)}
    own = Course(course.joint[group], course.fixed, course.start[group], course.end[group], course.radius[group])
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
                radius[index, near.piece] = max(NARROWEST, radius[index, near.piece] / 2)
    return radius


def _rounded(points: Array, duration: float) -> Array:
    """Control points to coefficients in float32: (..., 8) to the same shape, ascending powers of seconds."""
    difference = points
    columns = []
    for power in range(8):
        columns.append(difference[..., 0] * math.comb(7, power) / duration**power)
        difference = np.diff(difference, axis=-1)
    return np.stack(columns, axis=-1).astype(np.float32).astype(np.float64)


def _texts(mission: Mission, coefficients: Array, times: Array) -> dict[str, str]:
    """Nine significant digits tell every float32 number from every other."""
    pieces = times.size - 1
    files = {}
    for agent in mission.agents:
        rows = np.zeros((pieces, 4, 8))
        rows[:, : mission.dimension] = coefficients[agent.index]
        if mission.dimension == 2:
            rows[:, 2, 0] = np.float32(agent.altitude)
        lines = [",".join(COLUMNS)]
        table = np.concatenate([np.full((pieces, 1), times[1]), rows.reshape(pieces, -1)], axis=1)
        # Adding zero turns -0 into 0.
        lines += [",".join(f"{number + 0.0:.9g}" for number in row) for row in table.tolist()]
        files[agent.name] = "\n".join(lines) + "\n"
    return files


def _not_flyable(mission: Mission, attempts: list[_Stuck]) -> Diagnostic:
    last = attempts[-1]
    agents = [mission.agents[index] for index in last.agents or (0,)]
    names = " and ".join(f"`{agent.name}`" for agent in agents[:2]) + (" and others" if len(agents) > 2 else "")
    when = "" if last.at is None else f" at {last.at:.2f} s"
    return Diagnostic(
        NOT_FLYABLE,
        f"no polynomials fly the plan of {names}{when}",
        Label(agents[0].span),
        notes=(
            last.why,
            f"they start and end at rest, and stay within {TUBE:g} m of the verified motion",
        ),
        help="give the agents more room, or time to come to speed: a larger `separation` or `clearance`, other starts",
    )
