"""A world that changes while a mission is flown: what of it is there from when to when.

in   the mission as it reads from each time on
out  Spans: its regions and obstacles
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from missionc.ir import Mission, Obstacle, Region


@dataclass(frozen=True, slots=True, eq=False)
class Span:
    """Something of the world, and from when to when it is there, s; None for the end."""

    thing: Region | Obstacle
    since: float = 0.0
    until: float | None = None


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
