"""Verification of a whole flight: the columns above the pads, the ways to the starts and home, and the time it takes.

in   Mission, the texts of the polynomials that fly it, those of its ways
out  Certificate: the checks of each way by its word, `out` or `home`, and those of the columns

A way is judged as the mission's own flight is, along its polynomials and by the same claims. In a column a vehicle may
be at any height at any time while all rise or sink; that is what is proved clear.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from itertools import combinations

import numpy as np

from missionc.base.trace import Array
from missionc.curves.crazyflie_csv import Pieces, read
from missionc.curves.piecewise_polynomials import values
from missionc.ir import Agent, Mission
from missionc.verify.certificate import Certificate, Check, Figure, judged
from missionc.verify.flight.continuity_and_fidelity import check_level, check_smooth, exactness
from missionc.verify.flight.flight_curves import Flight
from missionc.verify.flight.flight_phases import Phases, phases_of
from missionc.verify.flight.joint_claims import downwash, world
from missionc.verify.flight.landing_in_turns import above_pads, landing_margins, pad_turns
from missionc.verify.flight.vehicle_claims import limits
from missionc.verify.flight.verify_polynomials import check_apart, check_file, prove_all
from missionc.verify.flight.way_missions import Stage, Way, Ways, has_risen, is_whole, way_mission, ways_of
from missionc.verify.proof.proof_boxes import Boxes
from missionc.verify.tolerances import MOTION, WAYPOINT
from missionc.world.columns import column_clearance

WHOLE = "whole flight"
"""The figure that says how long it takes."""


def verify_whole_flight(mission: Mission, files: Mapping[str, str], ways: Ways) -> Certificate:
    """Judge the ways of a mission that comes from the floor, and its columns.

    Args:
        files: the text of each agent's polynomials, by its name; they were verified.
    """
    flown = pieces_of(mission, files)
    if isinstance(flown, Check):
        return Certificate(mission.name, (flown,))
    wanted = ways_of(mission, flown)
    whole = Certificate(mission.name, ())
    for stage, way in wanted.items():
        if stage not in ways:
            detail = "nobody is anywhere else at the end of it, or there is a file of each agent"
            there = Check(f"{stage.value} way", "ways", 0.0, "", 0.0, not way.needed, detail=detail)
            whole = whole.joined(Certificate(mission.name, (there,)))
            continue
        whole = whole.joined(_way(mission, stage, way, ways[stage]))
    durations = {stage: _seconds(mission, ways.get(stage, {})) for stage in Stage}
    seconds = sum(durations.values()) + float(next(iter(flown.values())).times[-1])
    lasting = whole_phases(mission, wanted, seconds)
    begins = {Stage.OUT: -durations[Stage.OUT], Stage.HOME: mission.horizon + durations[Stage.HOME]}
    checks = [*_columns(mission, wanted, begins, lasting), *_endurance(mission, lasting)]
    lasts = Figure(WHOLE, "floor to floor", round(lasting.whole, 6), "s")
    return whole.joined(Certificate(mission.name, tuple(checks), (lasts,)))


def as_one(mission: Mission, files: Mapping[str, str], ways: Ways) -> tuple[dict[str, Pieces], float, float]:
    """The way out, the mission and the way home of each agent as one, texts that were verified.

    Returns:
        Them by the agents' names; the seconds before the mission begins; those from the take-off to the first of them,
        0 of a mission that begins in the air.
    """
    flown = pieces_of(mission, files)
    assert not isinstance(flown, Check), "polynomials that were verified can be read"
    parts = {stage: pieces_of(mission, texts) for stage, texts in ways.items()}
    whole: dict[str, Pieces] = {}
    before = _seconds(mission, ways.get(Stage.OUT, {}))
    for agent in mission.agents:
        own = [flown[agent.name]]
        for stage, part in parts.items():
            assert not isinstance(part, Check), "polynomials that were verified can be read"
            own.insert(0 if stage is Stage.OUT else len(own), part[agent.name])
        durations = np.concatenate([each.duration for each in own])
        whole[agent.name] = Pieces(durations, np.concatenate([each.coefficients for each in own]))
    if not is_whole(mission):
        return whole, before, 0.0
    lasting = whole_phases(mission, ways_of(mission, flown), float(durations.sum()))
    return whole, before, lasting.before


def pieces_of(mission: Mission, files: Mapping[str, str]) -> dict[str, Pieces] | Check:
    """Every agent's polynomials, or the check that one cannot be read."""
    flown: dict[str, Pieces] = {}
    for agent in mission.agents:
        own = read(files.get(agent.name, ""))
        if isinstance(own, str):
            return check_file(agent, own)
        flown[agent.name] = own
    return flown


def whole_phases(mission: Mission, wanted: Mapping[Stage, Way], seconds: float) -> Phases:
    """The phases of a whole flight, whose polynomials and ways last so many seconds."""
    up, down = wanted[Stage.OUT].begin[:, 2].tolist(), wanted[Stage.HOME].end[:, 2].tolist()
    rounds = max(1, len(pad_turns(mission, wanted[Stage.HOME].end)))
    return phases_of(mission.agents, up, down, seconds, rounds, has_risen(mission))


def _seconds(mission: Mission, files: Mapping[str, str]) -> float:
    flown = pieces_of(mission, files)
    return 0.0 if isinstance(flown, Check) else float(next(iter(flown.values())).times[-1])


# ----------------------------------------------------------------------- ways


def _way(mission: Mission, stage: Stage, way: Way, files: Mapping[str, str]) -> Certificate:
    """One way, on the claims of flights; every name has the word of its stage before it."""
    read_files = {agent.name: read(files.get(agent.name, "")) for agent in mission.agents}
    checks = [check_file(agent, read_files[agent.name]) for agent in mission.agents]
    boxes: list[Boxes] = []
    warnings: list[str] = []
    own = [each for each in read_files.values() if isinstance(each, Pieces)]
    same = len(own) == len(read_files) and all(np.array_equal(each.duration, own[0].duration) for each in own)
    checks.append(Check("clock", "polynomials", 0.0, "s", 0.0, same, detail="all files have the same durations"))
    if same:
        flown = way_mission(mission, stage, way, float(own[0].times[-1]), 1, math.inf)
        flight = Flight(own[0].duration, np.stack([each.coefficients for each in own]))
        with np.errstate(over="ignore", invalid="ignore"):
            for agent, each in zip(flown.agents, own, strict=True):
                checks += [*check_smooth(agent, each), *_ends(agent, each, way), *check_level(flown, agent, each)]
            prove_all(flown, [world(flown, flight)], checks, boxes)
            warnings += check_apart(flown, flight, checks, boxes)
            prove_all(flown, [*downwash(flown, flight), *limits(flown, flight)], checks, boxes)
    word = stage.value
    said = tuple(f"on the way {word}: {warning}" for warning in warnings)
    return Certificate(mission.name, tuple(checks), warnings=said, boxes=tuple(boxes)).under(word)


def _ends(agent: Agent, own: Pieces, way: Way) -> list[Check]:
    """That it begins and ends where the way does."""
    first, last = own.coefficients[0, :3, 0], values(own.coefficients[-1, :3], own.duration[-1])
    found = []
    for name, here, wanted, time in (
        ("begin", first, way.begin[agent.index], 0.0),
        ("end", last, way.end[agent.index], float(own.times[-1])),
    ):
        off = float(np.linalg.norm(here - wanted))
        detail = f"it {name}s at ({', '.join(f'{value:.4g}' for value in wanted.tolist())})"
        found.append(judged(name, agent.name, -off, "m", exactness(own), at=time, agents=(agent.name,), detail=detail))
    return found


# -------------------------------------------------------------------- columns


def _columns(
    mission: Mission, wanted: Mapping[Stage, Way], begins: Mapping[Stage, float], lasting: Phases
) -> list[Check]:
    """That all may rise, where they stand on the floor, and sink, in their turns."""
    checks: list[Check] = []
    hovers = wanted[Stage.HOME].end
    fenced = [_fence(mission, agent, hovers[agent.index].tolist()) for agent in mission.agents]
    checks.append(min(fenced, key=lambda check: check.margin))
    checks += [_turns(mission, hovers)] if len(mission.agents) > 1 else []
    size = mission.dimension
    for name, begin, end in (
        ("rise", begins[Stage.OUT], begins[Stage.OUT]),
        ("sink", begins[Stage.HOME], begins[Stage.HOME] + lasting.settle + lasting.rounds * lasting.sink),
    ):
        for obstacle in mission.obstacles if name == "sink" or not has_risen(mission) else ():
            found = []
            for agent in mission.agents:
                need = max(agent.radius + agent.vehicle.tracking, agent.radius + mission.clearance)
                point = tuple(hovers[agent.index, :size].tolist())
                clear = column_clearance(obstacle, point, begin, end)
                detail = "every body that goes straight up or down above its pad keeps clear of it"
                found.append(
                    judged(
                        f"{name} obstacle",
                        obstacle.name,
                        clear - need,
                        "m",
                        WAYPOINT,
                        agents=(agent.name,),
                        detail=detail,
                    )
                )
            checks.append(min(found, key=lambda check: check.margin))
    return checks


def _fence(mission: Mission, agent: Agent, point: list[float]) -> Check:
    low, high = mission.room(agent.index)
    margin = min(min(point[axis] - low[axis], high[axis] - point[axis]) for axis in (0, 1))
    detail = "every pad is inside the world, by the fence inset and the tracking margin of its vehicle"
    return judged("column world", "world", margin, "m", MOTION, agents=(agent.name,), detail=detail)


def _turns(mission: Mission, hovers: Array) -> Check:
    """That nobody comes too near to another on its way, in the turns in which they go; or the worst of those who do."""
    turns = pad_turns(mission, hovers)
    if sum(map(len, turns)) < len(mission.agents):
        pairs = (_pair(mission, *pair, hovers.tolist()) for pair in combinations(range(len(mission.agents)), 2))
        return min(pairs, key=lambda check: check.margin)
    bare = replace(mission, obstacles=())
    margin, index = min((each, index) for index, each in landing_margins(bare, above_pads(hovers, turns)))
    name, count = mission.agents[index].name, len(turns)
    how = "all at once" if count == 1 else f"in {count} turns"
    detail = f"they rise and sink {how}, each far enough from those beside it, who hover, or who stand"
    return judged("column separation", "all pairs", margin, "m", MOTION, agents=(name,), detail=detail)


def _pair(mission: Mission, first: int, second: int, points: list[list[float]]) -> Check:
    """Sideways, whatever their heights: so that neither is in the other's downwash."""
    apart = math.dist(points[first][:2], points[second][:2])
    names = (mission.agents[first].name, mission.agents[second].name)
    detail = "seen from above, pads are as far apart as vehicles have to be, or one hovers well above the other"
    margin = apart - mission.spacing(first, second).sideways
    return judged("column separation", "all pairs", margin, "m", MOTION, agents=names, detail=detail)


def _endurance(mission: Mission, lasting: Phases) -> list[Check]:
    """That everybody is on the floor again before its battery is empty; of a mission in flight with what was flown."""
    aloft = max(agent.pad.risen or 0.0 for agent in mission.agents if agent.pad is not None)
    whole = aloft + lasting.whole
    took = f"after {aloft:g} s of the mission it takes" if has_risen(mission) else "it takes"
    where = "to the floor" if has_risen(mission) else "from the floor to the floor"
    return [
        Check(
            "whole endurance",
            agent.name,
            agent.vehicle.endurance - whole,
            "s",
            0.0,
            whole <= agent.vehicle.endurance,
            agents=(agent.name,),
            detail=f"{took} {lasting.whole:g} s {where}; on one charge it flies {agent.vehicle.endurance:g} s",
        )
        for agent in mission.agents
        if math.isfinite(agent.vehicle.endurance)
    ]
