"""Check of vehicles: flight volume, positions within it, reachable speeds, time in the air, tracking margins.

    in   Mission, its Kernel
    out  nothing but findings
    says MC509 MC518 MC519 MC520 MC522 MC551 MC731

The flight volume of a vehicle is the world minus its fence inset, within its altitude band. Only the bounding box of a
region is compared with it, so a region that passes may still lie outside.

A tracking margin holds for flights within the limits of the vehicle's profile, at which `bench/tracking.py` measured
it. A vehicle with higher limits has to state a margin of its own.

Goals are checked with the speeds that vehicles fly: a goal may be within reach of the dynamics but not of any flight.
Only goals due before the last step count, since a window to the end, like a finish, moves with a time-scaled plan.
"""

from __future__ import annotations

import math
from dataclasses import replace

from missionc.base.diagnostics import code as codes
from missionc.base.diagnostics.model import Diagnostic, Label
from missionc.base.source import Span
from missionc.base.units import Dimension
from missionc.frontend.checks.check_goals import requirements_out_of_reach
from missionc.frontend.checks.free_space import FreeSpace
from missionc.frontend.resolve.resolve_quantities import SI
from missionc.geometry.configuration_space import empty
from missionc.ir import FIGURES, Agent, InitialSet, Mission, Vector
from missionc.ir.dynamics import at_most
from missionc.ir.kernel.nodes import Kernel
from missionc.ir.vehicle_profiles import profiles
from missionc.ir.wording import listed, metres, number, speed

LIMITS = ("speed", "vertical_speed", "acceleration", "jerk")
"""Parameters of a vehicle that increase its tracking error."""


def check_tracking(mission: Mission) -> list[Diagnostic]:
    """Findings about teams whose vehicle has higher limits than its profile but the profile's tracking margin, one for
    each.
    """
    teams = {agent.team: agent for agent in reversed(mission.agents)}
    return [finding for agent in reversed(teams.values()) for finding in _tracking_beyond(agent)]


def _tracking_beyond(agent: Agent) -> list[Diagnostic]:
    own, profile = agent.vehicle, profiles()[agent.vehicle.name]
    raised = [name for name in LIMITS if getattr(own, name) > getattr(profile, name)]
    if not (profile.tracking and raised and own.tracking == profile.tracking):
        return []
    name = raised[0]
    unit = SI[FIGURES[name].dimension]
    return [
        Diagnostic(
            codes.TRACKING_NOT_MEASURED,
            f"`{agent.team}` may fly with {_words(name)} of {number(getattr(own, name))}{unit}; the tracking margin of "
            f"`{profile.name}` was measured up to {number(getattr(profile, name))}{unit}",
            Label(agent.span, f"vehicle `{own.name}`"),
            notes=(f"the proof assumes a tracking error of at most {metres(own.tracking)}",),
            help=f"set `tracking` in `vehicle`{_enough(agent)}",
        )
    ]


def _words(name: str) -> str:
    return {"speed": "a speed", "vertical_speed": "a vertical speed", "acceleration": "an acceleration"}.get(
        name, "a jerk"
    )


def _enough(agent: Agent) -> str:
    """Text on the tracking margin in proportion to the speed; empty if the speed limit was not raised."""
    profile = profiles()[agent.vehicle.name]
    times = max(getattr(agent.vehicle, name) / getattr(profile, name) for name in ("speed", "vertical_speed"))
    if times <= 1 or times > 10:
        return ""
    return f"; the simulated error at this speed is up to {metres(round(profile.tracking * times, 3))}"


def check_flown_speeds(mission: Mission, kernel: Kernel) -> list[Diagnostic]:
    """Findings about goals that are out of reach at the speeds that vehicles fly.

    Only missions with vehicles slower than their dynamics are checked.
    """
    agents = tuple(
        replace(agent, dynamics=at_most(agent.dynamics, _most(mission, agent), math.inf)) for agent in mission.agents
    )
    slower = {
        agent.team: f"the vehicle of `{agent.team}` flies at most {speed(flown.dynamics.top_speed)}"
        for agent, flown in zip(mission.agents, agents, strict=True)
        if flown.dynamics != agent.dynamics
    }
    if not slower:
        return []
    flown = replace(mission, agents=agents)
    found = requirements_out_of_reach(flown, kernel, FreeSpace.of(flown), mission.steps - 1)
    return [replace(each, notes=(*each.notes, listed(list(slower.values())))) for each in found]


def _most(mission: Mission, agent: Agent) -> float:
    """Maximum speed in any direction, m/s, from the horizontal and vertical limits."""
    vehicle = agent.vehicle
    return vehicle.speed if mission.dimension == 2 else math.hypot(vehicle.speed, vehicle.vertical_speed)


ROUNDING = 1e-9
"""Tolerance in metres for a position that seems to lie outside."""


def check_vehicles(mission: Mission, ground: FreeSpace) -> list[Diagnostic]:
    """Findings about everything in a mission that its vehicles cannot do."""
    findings: list[Diagnostic] = []
    for team in _teams(mission):
        findings += _slower_than_planned(team[0])
        findings += _longer_than_it_flies(mission, team[0])
        cramped = _without_room(mission, team[0])
        findings += cramped or _outside(mission, ground, team)
    return findings


def _teams(mission: Mission) -> list[list[Agent]]:
    teams: dict[str, list[Agent]] = {}
    for agent in mission.agents:
        teams.setdefault(agent.team, []).append(agent)
    return list(teams.values())


def _slower_than_planned(agent: Agent) -> list[Diagnostic]:
    vehicle, dynamics = agent.vehicle, agent.dynamics
    findings = []
    if dynamics.top_speed > vehicle.speed:
        findings.append(_faster(agent, "speed", "move", dynamics.top_speed, vehicle.speed, Dimension.SPEED))
    if vehicle.acceleration < dynamics.top_acceleration < math.inf:
        planned, flown = dynamics.top_acceleration, vehicle.acceleration
        findings.append(_faster(agent, "acceleration", "accelerate", planned, flown, Dimension.ACCELERATION))
    return findings


def _longer_than_it_flies(mission: Mission, agent: Agent) -> list[Diagnostic]:
    return [] if mission.horizon <= agent.vehicle.endurance else [_outlasted(mission, agent)]


def _without_room(mission: Mission, agent: Agent) -> list[Diagnostic]:
    low, high = mission.room(agent.index)
    band = agent.vehicle.height
    if any(a > b + ROUNDING for a, b in zip(low, high, strict=True)):
        return [_no_room(mission, agent)]
    if mission.dimension == 2 and not band.low <= agent.altitude <= band.high:
        return [_wrong_altitude(agent)]
    return []


def _outside(mission: Mission, ground: FreeSpace, team: list[Agent]) -> list[Diagnostic]:
    findings = []
    members = {agent.index for agent in team}
    for verb, ends in (("starts", mission.starts), ("finishes", mission.finishes)):
        by_span: dict[Span, list[tuple[Agent, InitialSet]]] = {}
        for agent, place in ends:
            if agent.index in members and _beyond(mission, ground, agent, place):
                by_span.setdefault(place.span, []).append((agent, place))
        findings += [_beyond_the_fence(mission, verb, there) for there in by_span.values()]
    return findings


def _beyond(mission: Mission, ground: FreeSpace, agent: Agent, place: InitialSet) -> bool:
    """Return whether a start or finish meets the world but not the flight volume of the vehicle."""
    if place.point is not None:
        low = high = place.point
    else:
        area = ground.atlas.outer(place.shape)
        if empty(area):
            return False
        low, high = ground.atlas.bounds(area)
    world, room = (mission.world.low, mission.world.high), mission.room(agent.index)
    return _meets(world, (low, high)) and not _meets(room, (low, high))


def _meets(first: tuple[Vector, Vector], second: tuple[Vector, Vector]) -> bool:
    """Return whether two boxes, given by their corners, intersect."""
    sides = zip(*first, *second, strict=True)
    return all(a <= d + ROUNDING and c <= b + ROUNDING for a, b, c, d in sides)


# ------------------------------------------------------------------ messages


def _faster(agent: Agent, word: str, verb: str, planned: float, flown: float, dimension: Dimension) -> Diagnostic:
    unit = SI[dimension]
    return Diagnostic(
        codes.FASTER_THAN_VEHICLE,
        f"`{agent.team}` may {verb} at {number(planned)}{unit}; its vehicle flies at most {number(flown)}{unit}",
        Label(agent.span, f"vehicle `{agent.vehicle.name}`"),
        notes=("a plan at this speed takes longer to fly",),
        help=f"write `{word} <= {number(flown)}{unit}` in its `dynamics`",
    )


def _outlasted(mission: Mission, agent: Agent) -> Diagnostic:
    flies = f"{number(agent.vehicle.endurance)}{SI[Dimension.TIME]}"
    return Diagnostic(
        codes.OUTLASTS_VEHICLE,
        f"`{agent.team}` flies {flies} on one charge; the mission lasts {number(mission.horizon)}{SI[Dimension.TIME]}",
        Label(agent.span, f"vehicle `{agent.vehicle.name}`"),
        (Label(mission.time_span, "duration of the mission"),) if mission.time_span else (),
        ("takeoff and landing take additional time",),
        f"shorten `horizon` to less than {flies}",
    )


def _no_room(mission: Mission, agent: Agent) -> Diagnostic:
    return Diagnostic(
        codes.NO_FLYING_ROOM,
        f"the world has no flight volume for `{agent.team}`",
        Label(agent.span, f"vehicle `{agent.vehicle.name}`"),
        (Label(mission.world.span, f"the world is {_box(mission.world.low, mission.world.high)}"),),
        (_kept(mission, agent),),
        "make the world larger",
    )


def _wrong_altitude(agent: Agent) -> Diagnostic:
    band = agent.vehicle.height
    return Diagnostic(
        codes.NO_FLYING_ROOM,
        f"`{agent.team}` flies at {metres(agent.altitude)}; its vehicle flies between {metres(band.low)}"
        f" and {metres(band.high)}",
        Label(agent.span, f"vehicle `{agent.vehicle.name}`"),
        help="change its `altitude`",
    )


def _beyond_the_fence(mission: Mission, verb: str, there: list[tuple[Agent, InitialSet]]) -> Diagnostic:
    agent, place = there[0]
    others = [f"`{other.name}`" for other, _ in there[1:]]
    where = f"in `{place.region.name}`" if place.region is not None else f"at {_point(place.point or ())}"
    return Diagnostic(
        codes.OUTSIDE_FLYING_ROOM,
        f"`{agent.name}` {verb} {where}, outside the flight volume of its vehicle, {_box(*mission.room(agent.index))}",
        Label(place.span),
        (Label(agent.span, f"vehicle `{agent.vehicle.name}`"),),
        (_kept(mission, agent), *((f"also {listed(others)}",) if others else ())),
        "move this position into the flight volume",
    )


def _kept(mission: Mission, agent: Agent) -> str:
    vehicle = agent.vehicle
    distance = metres(vehicle.fence_inset + vehicle.tracking)
    text = f"`{vehicle.name}` needs a distance of {distance} to the borders of the world"
    if mission.dimension == 2 or math.isinf(vehicle.height.high):
        return text
    return f"{text} and a height between {metres(vehicle.height.low)} and {metres(vehicle.height.high)}"


def _box(low: Vector, high: Vector) -> str:
    return f"{_point(low)} to {_point(high)}"


def _point(point: Vector) -> str:
    return f"({', '.join(map(number, point))})"
