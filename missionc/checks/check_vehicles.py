"""Check of vehicles: room to fly in, places within it, speeds that they reach, and time in the air.

    says MC518 MC519 MC520 MC522

The room of a vehicle is the world less its fence inset, within its band of
heights. Of a region only the box around it is looked at, so a region that
passes may still lie outside.
"""

from __future__ import annotations

import math

from missionc.base.source import Span
from missionc.base.units import Dimension
from missionc.checks.free_space import FreeSpace
from missionc.diagnostics.code import FASTER_THAN_VEHICLE, NO_FLYING_ROOM, OUTLASTS_VEHICLE, OUTSIDE_FLYING_ROOM
from missionc.diagnostics.model import Diagnostic, Label
from missionc.ir import Agent, Exactly, Mission, Place, Vector
from missionc.ir.wording import listed, metres, number
from missionc.resolve.resolve_quantities import SI
from missionc.world.configuration_space import empty

ROUNDING = 1e-9
"""Metres by which a place may seem to lie outside and does not."""


def check_vehicles(mission: Mission, ground: FreeSpace) -> list[Diagnostic]:
    """What the vehicles of the mission cannot do in it."""
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
    for verb, places in (
        ("starts", [(agent, agent.start) for agent in team]),
        ("finishes", [(agent, agent.finish) for agent in team if agent.finish is not None]),
    ):
        by_span: dict[Span, list[tuple[Agent, Place]]] = {}
        for agent, place in places:
            if _beyond(mission, ground, agent, place):
                by_span.setdefault(place.span, []).append((agent, place))
        findings += [_beyond_the_fence(mission, verb, there) for there in by_span.values()]
    return findings


def _beyond(mission: Mission, ground: FreeSpace, agent: Agent, place: Place) -> bool:
    """Whether no point of the place is in the room of the vehicle, though some is in the world."""
    if isinstance(place, Exactly):
        low, high = place.point, place.point
    else:
        area = ground.atlas.outer(place.region.shape)
        if empty(area):
            return False
        low, high = ground.atlas.bounds(area)
    world, room = (mission.world.low, mission.world.high), mission.room(agent.index)
    return _meets(world, (low, high)) and not _meets(room, (low, high))


def _meets(first: tuple[Vector, Vector], second: tuple[Vector, Vector]) -> bool:
    """Whether two boxes, by their corners, have a point in common."""
    sides = zip(*first, *second, strict=True)
    return all(a <= d + ROUNDING and c <= b + ROUNDING for a, b, c, d in sides)


# ------------------------------------------------------------------ messages


def _faster(agent: Agent, word: str, verb: str, planned: float, flown: float, dimension: Dimension) -> Diagnostic:
    unit = SI[dimension]
    return Diagnostic(
        FASTER_THAN_VEHICLE,
        f"`{agent.team}` may {verb} at {number(planned)}{unit}; its vehicle flies at most {number(flown)}{unit}",
        Label(agent.span, f"flown as `{agent.vehicle.name}`"),
        notes=("a plan that makes use of it can be flown only in more time",),
        help=f"write `{word} <= {number(flown)}{unit}` in its `dynamics`, or give `vehicle` its own `{word}`",
    )


def _outlasted(mission: Mission, agent: Agent) -> Diagnostic:
    flies = f"{number(agent.vehicle.endurance)}{SI[Dimension.TIME]}"
    return Diagnostic(
        OUTLASTS_VEHICLE,
        f"`{agent.team}` flies {flies} on one charge; the mission lasts {number(mission.horizon)}{SI[Dimension.TIME]}",
        Label(agent.span, f"flown as `{agent.vehicle.name}`"),
        (Label(mission.time_span, "from the first state to the last"),) if mission.time_span else (),
        ("it has to rise before, and to land after",),
        f"shorten `horizon` to less than {flies}, or give `vehicle` its own `endurance`",
    )


def _no_room(mission: Mission, agent: Agent) -> Diagnostic:
    return Diagnostic(
        NO_FLYING_ROOM,
        f"the world leaves `{agent.team}` no room to fly",
        Label(agent.span, f"flown as `{agent.vehicle.name}`"),
        (Label(mission.world.span, f"the world is {_box(mission.world.low, mission.world.high)}"),),
        (_kept(mission, agent),),
        "make the world larger, or give `vehicle` its own `fence_inset` or `height`",
    )


def _wrong_altitude(agent: Agent) -> Diagnostic:
    band = agent.vehicle.height
    return Diagnostic(
        NO_FLYING_ROOM,
        f"`{agent.team}` flies at {metres(agent.altitude)}; its vehicle keeps between {metres(band.low)}"
        f" and {metres(band.high)}",
        Label(agent.span, f"flown as `{agent.vehicle.name}`"),
        help="give it another `altitude`, or `vehicle` its own `height`",
    )


def _beyond_the_fence(mission: Mission, verb: str, there: list[tuple[Agent, Place]]) -> Diagnostic:
    agent, place = there[0]
    others = [f"`{other.name}`" for other, _ in there[1:]]
    where = f"at {_point(place.point)}" if isinstance(place, Exactly) else f"in `{place.region.name}`"
    return Diagnostic(
        OUTSIDE_FLYING_ROOM,
        f"`{agent.name}` {verb} {where}, outside the room of its vehicle, {_box(*mission.room(agent.index))}",
        Label(place.span),
        (Label(agent.span, f"flown as `{agent.vehicle.name}`"),),
        (_kept(mission, agent), *((f"the same goes for {listed(others)}",) if others else ())),
        "move it into that room, or give `vehicle` its own `fence_inset` or `height`",
    )


def _kept(mission: Mission, agent: Agent) -> str:
    vehicle = agent.vehicle
    text = f"`{vehicle.name}` keeps {metres(vehicle.fence_inset + vehicle.tracking)} from the borders of the world"
    if mission.dimension == 2 or math.isinf(vehicle.height.high):
        return text
    return f"{text}, and between {metres(vehicle.height.low)} and {metres(vehicle.height.high)} of height"


def _box(low: Vector, high: Vector) -> str:
    return f"{_point(low)} to {_point(high)}"


def _point(point: Vector) -> str:
    return f"({', '.join(map(number, point))})"
