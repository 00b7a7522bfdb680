"""Planning of the transfers: from above the pads to the starts, and from the finishes back to the pads.

in   Mission, the texts of its polynomials, Budget
out  the texts of both transfers; or the reason for none
says MC740

All agents first move at once on straight lines. If these conflict with each other or with obstacles, the roadmap
planner follows; if no polynomials fly its plan, agents move straight one after the other. Each transfer is fitted and
proved like a mission's flight, and time-scaled for the vehicles.
"""

from __future__ import annotations

import math
import time
from collections.abc import Iterator, Mapping
from dataclasses import replace
from itertools import product

import numpy as np

from missionc.backends.api import Budget, Planned, Progress, discard_plan, discard_snapshot, ignore
from missionc.backends.load import load
from missionc.backends.options import Options
from missionc.base.diagnostics.code import NEEDS_MORE_TIME, NO_WAY
from missionc.base.diagnostics.model import Diagnostic, Label
from missionc.base.trace import Array, Trace
from missionc.base.units import Metres
from missionc.compiler.plan_with_margin import plan_with_margin
from missionc.flight.trajectories.crazyflie import Flyable, crazyflie
from missionc.flight.trajectories.safe_end import safe_ends
from missionc.ir import Mission
from missionc.ir.wording import listed
from missionc.output.output_files import WholeFlight
from missionc.verification.certificate import TUBE, Certificate, Check
from missionc.verification.flight.verify_polynomials import PIECE_BYTES
from missionc.verification.flight.verify_safe_end import has_safe_end, verify_safe_end
from missionc.verification.flight.verify_whole_flight import as_one, pieces_of, rest_to_rest, verify_whole_flight
from missionc.verification.flight.way_missions import (
    NOTHING_REQUIRED,
    Stage,
    Way,
    Ways,
    distance_of,
    has_risen,
    is_whole,
    way_mission,
    ways_of,
)
from missionc.verification.verify_plan import verify

AT_ONCE = 2
"""Number of steps of a transfer in which all agents move on straight lines."""
QUICK = 0.6
"""Fraction of a vehicle's speed used on a roadmap, since the vehicle has to accelerate from rest."""
BEFORE = (1.5, 2.5, 4.0)
"""Durations of a transfer on a roadmap that are tried, as multiples of the time for the longest straight line."""
ROOM = ((TUBE, TUBE), (TUBE, 0.0), (0.0, 0.0))
"""Additional clearance and separation of a plan, metres, so that polynomials may deviate from the plan by them."""
SLOWER, TIMES = 1.25, 8
"""Time-scaling factor of a transfer that is too fast, and maximum number of scalings."""
FEWEST = 3
"""Minimum number of polynomial pieces allowed for a transfer before more memory is used."""
SEARCH, LONGEST = 8.0, 90.0
"""Time limits in seconds: for one search on roadmaps, and for planning a transfer."""
IN_FLIGHT = 0.6
"""Fraction of the remaining time for planning a return transfer in flight."""
LEAST_STEP = 0.5
"""Shortest time step on roadmaps, seconds."""
UNLIMITED = 2.0
"""Speed for vehicles without a speed limit, m/s."""
NO_WAYS: Ways = {}
COLUMNS = ("column world", "column separation", "rise obstacle", "sink obstacle")
"""Checks that fail for every transfer to the pads: an obstacle or another agent blocks the column above a pad."""


def plan_ways(mission: Mission, files: Mapping[str, str], budget: Budget) -> WholeFlight | Diagnostic | None:
    """Transfers of a mission that starts on the floor, its safe ends, and their verification, or a diagnostic.

    A mission that begins in the air has no transfers; without a vehicle it has no safe ends either, and the result is
    None.
    """
    if not is_whole(mission):
        return _safe_end(mission, files, budget) if has_safe_end(mission) else None
    flown = pieces_of(mission, files)
    assert not isinstance(flown, Check), "polynomials that were verified can be read"
    standing = replace(mission, obstacles=tuple(each for each in mission.obstacles if each.constant))
    columns = [each for each in verify_whole_flight(standing, files, NO_WAYS).failures if each.name in COLUMNS]
    if columns:
        return _refused(mission, Certificate(mission.name, tuple(columns)))
    found: dict[Stage, Mapping[str, str]] = {}
    memory = min(agent.vehicle.memory for agent in mission.agents)
    left = memory // PIECE_BYTES - next(iter(flown.values())).duration.size
    for stage, way in ways_of(mission, flown).items():
        if not way.needed:
            continue
        budget.on_progress(Progress("emit", detail=f"path {WORDS[stage]}"))
        own = _plan(mission, stage, way, budget, left)
        if isinstance(own, Diagnostic):
            return own
        found[stage] = own
    judged = verify_whole_flight(mission, files, found)
    if not judged.passed:
        return _refused(mission, judged)
    ends = _safe_end(mission, files, budget, found)
    joined = judged.joined(ends.certificate)
    return replace(ends, certificate=joined) if joined.passed else _refused(mission, ends.certificate)


def _safe_end(mission: Mission, files: Mapping[str, str], budget: Budget, ways: Ways = NO_WAYS) -> WholeFlight:
    """Verified safe ends of a flight, with its verified transfers."""
    budget.on_progress(Progress("emit", detail="safe stops"))
    whole, before, risen = as_one(mission, files, ways)
    stops = safe_ends(mission, whole, before, risen)
    judged = verify_safe_end(mission, whole, before, risen, stops)
    if not judged.passed and not is_whole(mission):
        # An unproved result counts as none; for a mission that begins in the air this is also an answer.
        stops = ()
        judged = verify_safe_end(mission, whole, before, risen, stops)
    return WholeFlight(ways, stops, judged)


def _plan(mission: Mission, stage: Stage, way: Way, budget: Budget, left: int) -> Mapping[str, str] | Diagnostic:
    """Texts of the trajectory files of one transfer, or a diagnostic if none is found.

    Args:
        left: number of polynomial pieces that fit into the vehicles' memories besides the mission's.
    """
    now = time.monotonic()
    # In flight, time must be left for a plan without a return transfer.
    share = IN_FLIGHT if has_risen(mission) else 1.0
    until = min(now + share * (budget.deadline - now), now + LONGEST)
    nearest: Diagnostic | None = None
    for position, seconds in _candidates(mission, stage, way, replace(budget, deadline=until)):
        fitted = _flown(mission, stage, way, position, seconds, left)
        if isinstance(fitted, Flyable):
            return fitted.files
        nearest = fitted
        if time.monotonic() > until:
            break
    return _no_way(mission, stage, nearest)


def _candidates(mission: Mission, stage: Stage, way: Way, budget: Budget) -> Iterator[tuple[Array, float]]:
    """Yield collision-free plans of a transfer, (agents, steps + 1, dim), metres, with their durations in seconds."""
    lasts = _seconds(mission, way)
    straight = _straight(mission, way)
    if _clear(way_mission(mission, stage, way, lasts, AT_ONCE, math.inf), straight):
        yield straight, lasts
    yield from _on_roadmaps(mission, stage, way, budget)
    turns = one_by_one(mission, stage, way, lasts)
    if turns is not None:
        yield turns, lasts * (turns.shape[1] - 1) / AT_ONCE


def _on_roadmaps(mission: Mission, stage: Stage, way: Way, budget: Budget) -> Iterator[tuple[Array, float]]:
    """Yield plans of a transfer on roadmaps, (agents, steps + 1, dim), metres, with their durations in seconds.

    Clearance decreases and durations increase from plan to plan.
    """
    backend = load("smt", Options())
    assert not isinstance(backend, Diagnostic), "the roadmap planner needs nothing that may be missing"
    speed, step = QUICK * _speed(mission), max(float(mission.step), LEAST_STEP)
    least = max(1, math.ceil(distance_of(way) / (speed * step)))
    for times, (clear, apart) in product(BEFORE, ROOM):
        steps = math.ceil(times * least) + 2
        asked = way_mission(mission, stage, way, steps * step, steps, speed)
        asked = replace(asked, clearance=Metres(asked.clearance + clear), separation=Metres(asked.separation + apart))
        deadline = min(budget.deadline, time.monotonic() + SEARCH)
        own = replace(
            budget,
            deadline=deadline,
            on_snapshot=discard_snapshot,
            resume=None,
            on_incumbent=discard_plan,
            on_progress=ignore,
        )
        outcome = plan_with_margin(backend, asked, NOTHING_REQUIRED, Options(), own)
        if isinstance(outcome, Planned):
            yield outcome.trace.position, steps * step
        if time.monotonic() > budget.deadline:
            return


def one_by_one(mission: Mission, stage: Stage, way: Way, lasts: float) -> Array | None:
    """Plan in which agents move straight one after the other, (agents, steps + 1, dim), metres.

    None if at some time no waiting agent can move without a collision.

    Args:
        lasts: duration of each move, seconds.
    """
    begin, end = (points[:, : mission.dimension] for points in (way.begin, way.end))
    here, waiting = begin.copy(), list(range(len(begin)))
    rows = [here.copy()]
    while waiting:
        for agent in waiting:
            there = here.copy()
            there[agent] = end[agent]
            middle = (here + there) / 2
            asked = way_mission(mission, stage, Way(_level(way, here), _level(way, there), way.yaw), lasts, 2, math.inf)
            if _clear(asked, np.stack([here, middle, there], axis=1)):
                rows += [middle, there]
                here = there
                waiting.remove(agent)
                break
        else:
            return None
    return np.stack(rows, axis=1)


def _level(way: Way, points: Array) -> Array:
    """Points in three dimensions, (agents, 3), metres; points of a plane mission get the transfer's altitudes."""
    return points if points.shape[1] == 3 else np.column_stack([points, way.begin[:, 2]])


def _clear(asked: Mission, position: Array) -> bool:
    """Return whether a plan, (agents, steps + 1, dim), metres, stays in the world without touching bodies or
    obstacles.
    """
    judged = verify(asked, NOTHING_REQUIRED, _trace(asked, position))
    return not {check.name for check in judged.failures} & {"world", "obstacle", "separation"}


def _straight(mission: Mission, way: Way) -> Array:
    """Plan in which all agents move at once on straight lines: (agents, steps + 1, dim), metres."""
    share = np.linspace(0.0, 1.0, AT_ONCE + 1)[None, :, None]
    begin, end = (points[:, None, : mission.dimension] for points in (way.begin, way.end))
    return np.asarray(begin + share * (end - begin))


def _seconds(mission: Mission, way: Way) -> float:
    """Duration of the straight transfer from rest to rest at the vehicles' speeds, seconds."""
    longest = []
    for agent, begin, end in zip(mission.agents, way.begin, way.end, strict=True):
        aside, up = float(np.linalg.norm(end[:2] - begin[:2])), float(abs(end[2] - begin[2]))
        speed = min(agent.vehicle.speed, UNLIMITED)
        vertical = min(agent.vehicle.vertical_speed, UNLIMITED)
        acceleration = min(agent.vehicle.acceleration, UNLIMITED)
        longest += [rest_to_rest(aside, speed, acceleration), rest_to_rest(up, vertical, acceleration)]
    return math.ceil(10 * max(*longest, 2.0)) / 10


def _speed(mission: Mission) -> float:
    return min(min(agent.vehicle.speed, 2 * agent.vehicle.vertical_speed, UNLIMITED) for agent in mission.agents)


def _flown(
    mission: Mission, stage: Stage, way: Way, position: Array, seconds: float, left: int
) -> Flyable | Diagnostic:
    """Polynomials along a plan of a transfer, (agents, steps + 1, dim), metres, in few pieces if possible.

    Args:
        left: number of polynomial pieces that fit into the vehicles' memories.
    """
    memory = min(agent.vehicle.memory for agent in mission.agents)
    few = max(FEWEST, left // 2) * PIECE_BYTES
    fitted = _fitted(mission, stage, way, position, seconds, min(few, memory))
    return fitted if isinstance(fitted, Flyable) else _fitted(mission, stage, way, position, seconds, memory)


def _fitted(
    mission: Mission, stage: Stage, way: Way, position: Array, seconds: float, memory: int
) -> Flyable | Diagnostic:
    """Polynomials within a memory limit in bytes, time-scaled for the vehicles, along a plan (agents, steps + 1, dim),
    metres.
    """
    steps = position.shape[1] - 1
    for _ in range(TIMES):
        asked = _with_memory(way_mission(mission, stage, way, seconds, steps, math.inf), memory)
        fitted = crazyflie(asked, NOTHING_REQUIRED, _trace(asked, position))
        if isinstance(fitted, Flyable) or fitted.code is not NEEDS_MORE_TIME:
            return fitted
        seconds *= SLOWER
    return fitted


def _trace(asked: Mission, position: Array) -> Trace:
    velocity = np.diff(position, axis=1) / asked.step
    velocity = np.concatenate([velocity, velocity[:, -1:]], axis=1)
    return Trace(asked.step, position, velocity, np.zeros(position.shape[:2]))


def _with_memory(mission: Mission, memory: int) -> Mission:
    agents = (replace(agent, vehicle=replace(agent.vehicle, memory=memory)) for agent in mission.agents)
    return replace(mission, agents=tuple(agents))


# ------------------------------------------------------------------ messages

WORDS = {Stage.OUT: "from above the pads to the starts", Stage.HOME: "back above the pads"}


def _no_way(mission: Mission, stage: Stage, nearest: Diagnostic | None) -> Diagnostic:
    return Diagnostic(
        NO_WAY,
        f"no path was found {WORDS[stage]}",
        _where(mission),
        notes=() if nearest is None else (nearest.message, *nearest.notes[:1]),
        help="move the pads",
    )


def _refused(mission: Mission, judged: Certificate) -> Diagnostic:
    """Diagnostic of the worst failed check of a flight from floor to floor."""
    worst = judged.failures[0]
    short = f" by {-worst.margin:.3g} {worst.unit}".rstrip() if worst.margin < 0 else ""
    who = f" of {listed([f'`{name}`' for name in worst.agents])}" if worst.agents else ""
    return Diagnostic(
        NO_WAY,
        f"the whole flight is not proved: `{worst.name}`{who} fails{short}",
        _where(mission),
        notes=(worst.detail,),
        help="move the pads",
    )


def _where(mission: Mission) -> Label:
    return next(Label(agent.pad.span) for agent in mission.agents if agent.pad is not None)
