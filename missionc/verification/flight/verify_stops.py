"""Verification of stops: the polynomials of every agent until the beginning of a plan made in flight.

    in   Stops: the mission from that plan on, the flight before it, the polynomials up to its beginning
    out  Certificate: correct initial state, no jumps, all limits satisfied, no contact

Only contact of bodies and vehicle limits are checked, not the mission's separation and clearance: an agent off its path
may already be nearer than these distances.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from missionc.base.late_dataclass import Record
from missionc.base.trace import Array, Trace
from missionc.base.units import Metres
from missionc.geometry.curves.piecewise_polynomials import Curves, Pieces, curves_of, derivatives_at, read
from missionc.ir import Agent, Mission
from missionc.verification.certificate import WAYPOINT, Certificate, Check, judged
from missionc.verification.flight.continuity_and_fidelity import check_level, check_smooth, clock, exactness
from missionc.verification.flight.joint_claims import Flight, world
from missionc.verification.flight.verify_polynomials import limits, prove_all
from missionc.verification.plan.clearances import check_obstacles, check_separation
from missionc.verification.proof.proof_boxes import Boxes

ENDS = 1e-3
"""Tolerance of the end state: speed, m/s, below which an agent is at rest, and distance, metres."""


class Stops(Record, eq=False):
    """Polynomials of every agent that end at the beginning of a plan made in flight.

    Args:
        mission: its step 0 is the end of the stops; its vehicles have their speeds before the stops.
        told: (agents, steps + 1): the states before the plan; the last is the plan's first state.
        until: seconds of ``told`` that were flown; later states are predictions of the stops.
        begins: by agent name, the initial state of its stop from position to snap, (5, 4).
        files: text of each agent's polynomials, by agent name.
    """

    mission: Mission
    told: Trace
    until: float
    begins: Mapping[str, Array]
    files: Mapping[str, str]


def verify_stops(stops: Stops) -> Certificate:
    """Certificate of the stops of all agents, each by itself and all together.

    Contact of bodies is checked only if every stop is flyable.
    """
    mission = stops.mission
    own = {name: read(text) for name, text in stops.files.items()}
    wrong = [name for name, pieces in own.items() if isinstance(pieces, str)]
    flown = [own.get(agent.name) for agent in mission.agents]
    pieces = [each for each in flown if isinstance(each, Pieces)]
    alike = {each.duration.tobytes() for each in pieces}
    if wrong or len(pieces) != len(mission.agents) or len(alike) != 1:
        detail = "one stop for each agent, with pieces of equal durations"
        return Certificate(mission.name, (Check("stop", "files", 0.0, "", 0.0, False, detail=detail),))
    with np.errstate(over="ignore", invalid="ignore"):
        smooth = [
            check
            for agent, each in zip(mission.agents, pieces, strict=True)
            for check in (*_smooth(stops, agent, each), _told(stops, agent, each))
        ]
        found = Certificate(mission.name, tuple(smooth)).joined(vehicle_checks(mission, pieces)).under("stop")
    end = float(pieces[0].times[-1])
    on_the_clock = (check if check.at is None else replace(check, at=check.at - end) for check in found.checks)
    found = replace(found, checks=tuple(on_the_clock))
    if found.passed:
        found = found.joined(Certificate(mission.name, tuple(body_checks(mission, pieces))))
    ends = (_end(mission, agent, each) for agent, each in zip(mission.agents, pieces, strict=True))
    return found.joined(Certificate(mission.name, tuple(ends)))


def vehicle_checks(mission: Mission, pieces: Sequence[Pieces]) -> Certificate:
    """Certificate that centres stay in the world and vehicles within their limits, for stops of equal durations."""
    flight = Flight(pieces[0].duration, np.stack([each.coefficients for each in pieces]))
    bare = (replace(each, vehicle=replace(each.vehicle, tracking=0.0, fence_inset=0.0)) for each in mission.agents)
    checks: list[Check] = []
    boxes: list[Boxes] = []
    prove_all(mission, [world(replace(mission, agents=tuple(bare)), flight), *limits(mission, flight)], checks, boxes)
    return Certificate(mission.name, tuple(checks), boxes=tuple(boxes))


def body_checks(mission: Mission, pieces: Sequence[Pieces]) -> list[Check]:
    """Checks that no bodies touch, and that vehicles keep their pair distances, for stops of equal durations."""
    curves = stop_curves(mission, pieces)
    bare = replace(mission, separation=Metres(0.0), clearance=Metres(0.0))
    return [
        replace(check, name=f"stop {check.name}", detail=f"before the plan begins: {check.detail}")
        for check in (*check_separation(bare, curves), *check_obstacles(bare, curves))
    ]


def _smooth(stops: Stops, agent: Agent, own: Pieces) -> list[Check]:
    """Checks of the first state, of continuity at every joint, and of rest at the end unless the plan begins in motion.

    In a plane mission they include the altitude.
    """
    begin = stops.begins.get(agent.name)
    if begin is None:
        detail = "`past.json` states the first position and its derivatives up to snap"
        return [Check("begins", agent.name, 0.0, "", 0.0, False, agents=(agent.name,), detail=detail)]
    checks = check_smooth(replace(agent, begins=tuple(map(tuple, begin.tolist()))), own, stops=True)
    smooth = [check for check in checks if check.name != "rest" or not agent.begins]
    return [*smooth, *(check for check in check_level(stops.mission, agent, own) if check.name == "altitude")]


def _told(stops: Stops, agent: Agent, own: Pieces) -> Check:
    """Check that at each step after the stop began, the agent is at the position stated in ``past.json``."""
    position, late = stops.told.position[agent.index], clock(stops.mission)
    times = float(stops.told.step) * np.arange(len(position), dtype=np.float64)
    begin = float(times[-1] - own.times[-1])
    told = (times > max(stops.until, begin) + late) & (times < times[-1])
    places = curves_of([own], slice(stops.mission.dimension)).at(times[told] - begin)[0]
    off = np.linalg.norm(places - position[told], axis=-1)
    worst = float(off.max(initial=0.0)) if stops.until <= max(begin, 0.0) + late else np.inf
    detail = "it follows the recorded states and matches `past.json` at the sample times"
    return judged("told", agent.name, -worst, "m", exactness(own), agents=(agent.name,), detail=detail)


def _end(mission: Mission, agent: Agent, own: Pieces) -> Check:
    """Check that a stop ends in the plan's initial state, at rest or in motion."""
    end = derivatives_at(curves_of([own], slice(None)), np.array([np.inf]), max(2, len(agent.begins)))[0, 0]
    place = end[0, : mission.dimension]
    off = float(np.linalg.norm(place - agent.start.point)) if agent.start.point is not None else np.inf
    margin = min(WAYPOINT - off, ENDS - _jump(agent, end))
    motion = "in the state in which" if agent.begins else "at rest where"
    detail = f"it ends {motion} the plan begins"
    return Check("stop", agent.name, margin, "m", 0.0, margin >= 0, 0.0, (agent.name,), detail)


def _jump(agent: Agent, end: Array) -> float:
    """Speed of an end state; if the agent is in motion there, the largest jump of a derivative from the plan's initial
    state.

    Args:
        end: (orders, 4), metres and seconds.
    """
    if not agent.begins:
        return float(np.linalg.norm(end[1, :3]))
    return float(np.linalg.norm(end - np.array(agent.begins), axis=-1).max())


def stop_curves(mission: Mission, pieces: Sequence[Pieces]) -> Curves:
    """Trajectories of the stops, with times relative to the mission's step 0, at which the stops end."""
    times = pieces[0].times - pieces[0].times[-1]
    return Curves(times, np.stack([own.coefficients[:, : mission.dimension] for own in pieces]))
