"""Data of the world for a page: the static content of a mission's map.

in   Mission, its Kernel; for a changing world, its contents with their times
out  a dict for JSON
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from missionc.base.late_dataclass import Record
from missionc.ir import Agent, Mission, Obstacle, Path, Region
from missionc.ir.kernel.nodes import Kernel
from missionc.output.region_roles import region_roles
from missionc.output.report.outlines import inner_point, solids
from missionc.output.report.pack import PER_METRE


class Span(Record, eq=False):
    """Region or obstacle with the times between which it exists, s; None for the end of the mission."""

    thing: Region | Obstacle
    since: float = 0.0
    until: float | None = None


def world_data(mission: Mission, kernel: Kernel, spans: Sequence[Span] = ()) -> dict[str, Any]:
    """Data of a mission's map, with times in seconds and lengths in metres.

    ``per_metre`` is the scale of packed numbers.

    Args:
        spans: contents with their times, instead of the mission's own regions and obstacles.
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
    """Start and end time of an item for JSON; empty for a permanent one."""
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
    """Regions and obstacles of missions that replace each other, with the times between which each exists."""
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
    """Return whether two items are equal except for their text spans."""
    return replace(one, span=other.span) == other
