"""The world of a page's data: what a map draws of a mission before anything moves.

in   Mission, its Kernel; of a world that changes, what is there from when to when
out  a dict that JSON can hold
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

from missionc.ir import Agent, Mission, Obstacle, Path, Region
from missionc.ir.kernel.nodes import Kernel
from missionc.output.region_roles import region_roles
from missionc.output.report.outlines import inner_point, solids
from missionc.output.report.pack import PER_METRE


@dataclass(frozen=True, slots=True, eq=False)
class Span:
    """Something of the world, and from when to when it is there, s; None for the end."""

    thing: Region | Obstacle
    since: float = 0.0
    until: float | None = None


def world_data(mission: Mission, kernel: Kernel, spans: Sequence[Span] = ()) -> dict[str, Any]:
    """Times in seconds, lengths in metres; ``per_metre`` is of the numbers that are packed.

    Args:
        spans: what is there in the place of the mission's own regions and obstacles, and when.
    """
    roles = region_roles(mission, kernel)
    own: tuple[Region | Obstacle, ...] = (*mission.regions, *mission.obstacles)
    things = spans or [Span(each) for each in own]
    regions = [(each, each.thing) for each in things if isinstance(each.thing, Region)]
    obstacles = [(each, each.thing) for each in things if isinstance(each.thing, Obstacle)]
    return {
        "mission": mission.name,
        "step": mission.step,
        "steps": mission.steps,
        "per_metre": PER_METRE,
        "world": {"low": list(mission.world.low), "high": list(mission.world.high)},
        "regions": [
            {**_shape(mission, region.name, region.shape), **_when(span), "role": roles.get(region.name, "plain")}
            for span, region in regions
        ],
        "obstacles": [{**_obstacle(mission, obstacle), **_when(span)} for span, obstacle in obstacles],
        "beacons": [{"name": beacon.name, "position": list(beacon.position)} for beacon in mission.beacons],
        "agents": [_agent(agent) for agent in mission.agents],
    }


def _when(span: Span) -> dict[str, float | None]:
    """From when to when it is there; nothing of what always is."""
    return {"from": span.since, "until": span.until} if span.since or span.until is not None else {}


def _agent(agent: Agent) -> dict[str, Any]:
    return {"name": agent.name, "team": agent.team, "radius": agent.radius}


def _shape(mission: Mission, name: str, shape: Any) -> dict[str, Any]:
    parts = solids(mission.world, shape)
    return {"name": name, "parts": parts, "inner": inner_point(mission.world, parts)}


def _obstacle(mission: Mission, obstacle: Obstacle) -> dict[str, Any]:
    path = obstacle.motion
    moves = (
        {"times": list(path.times), "offsets": [list(each) for each in path.offsets]}
        if isinstance(path, Path)
        else None
    )
    return {
        **_shape(mission, obstacle.name, obstacle.shape),
        "path": moves,
        "growth": obstacle.growth,
        "age": obstacle.age,
    }


def world_over_time(worlds: Sequence[tuple[float, Mission]]) -> list[Span]:
    """Regions and obstacles with when they are there."""
    there: dict[tuple[str, str], Span] = {}
    over: list[Span] = []
    for time, mission in worlds:
        things: tuple[Region | Obstacle, ...] = (*mission.regions, *mission.obstacles)
        now = {(type(each).__name__, each.name): each for each in things}
        for key, span in list(there.items()):
            if key not in now or not _same(span.thing, now[key]):
                over.append(replace(span, until=time))
                del there[key]
        for key, thing in now.items():
            there.setdefault(key, Span(thing, time))
    return [*there.values(), *over]


def _same(one: Region | Obstacle, other: Region | Obstacle) -> bool:
    """Whether they are the same but for the words that say so."""
    return replace(one, span=other.span) == other
