"""Check of starts and finishes: in the world, clear of obstacles and each other, in large enough regions.

    says MC501 MC502 MC503 MC516

An agent is in the world if its centre is. Obstacles are taken at their positions at time 0 for starts and at the
horizon for finishes. Two agents never touch: a distance of exactly the separation is too small.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

from missionc.base.diagnostics.code import AGENTS_OVERLAP, IN_OBSTACLE, NO_ROOM, OUTSIDE_WORLD
from missionc.base.diagnostics.model import Diagnostic, Label
from missionc.base.late_dataclass import Record
from missionc.base.source import Span
from missionc.frontend.checks.free_space import Containment, FreeSpace
from missionc.geometry.configuration_space import common, empty
from missionc.geometry.surely_clear import all_apart, near_to
from missionc.ir import Agent, InitialSet, Mission, Obstacle, Region, Still, Vector
from missionc.ir.agents import ends_by_region
from missionc.ir.wording import at_least_metres, listed, metres, number, spaced

MOST_PAIRS = 2_000
"""Maximum number of pairs of agents that are too close; one finding names the first pair and counts the others."""


class Stage(Record):
    """All starts, or all finishes: the region or point of each agent, and the time in seconds."""

    verb: str
    verbs: str
    time: float
    places: list[tuple[Agent, InitialSet]]

    @property
    def exact(self) -> list[tuple[Agent, InitialSet, Vector]]:
        return [(agent, place, place.point) for agent, place in self.places if place.point is not None]


def check_starts(mission: Mission, ground: FreeSpace) -> list[Diagnostic]:
    """All findings about the starts and finishes of agents."""
    starts = Stage("start", "starts", 0.0, mission.starts)
    finishes = Stage("finish", "finishes", float(mission.horizon), mission.finishes)
    return [
        finding
        for stage in (starts, finishes)
        for check in (_outside, _in_obstacles, _overlapping, _without_room)
        for finding in check(mission, ground, stage)
    ]


def _outside(mission: Mission, ground: FreeSpace, stage: Stage) -> list[Diagnostic]:
    low, high = mission.world.low, mission.world.high
    outside = [
        (agent, place)
        for agent, place, point in stage.exact
        if not all(a <= value <= b for a, value, b in zip(low, point, high, strict=True))
    ]
    return [_beyond_the_world(mission, stage, there) for there in _by_span(outside)]


def _in_obstacles(mission: Mission, ground: FreeSpace, stage: Stage) -> list[Diagnostic]:
    exact = stage.exact
    findings: list[Diagnostic] = []
    for obstacle in mission.obstacles:
        near = _too_near(mission, stage, obstacle)
        distances = {exact[place][0].index: distance for place, distance in near.items()}
        findings.extend(
            _touches_obstacle(mission, stage, obstacle, there, distances[there[0][0].index])
            for there in _by_span(exact[place][:2] for place in near)
        )
    return findings


def _too_near(mission: Mission, stage: Stage, obstacle: Obstacle) -> dict[int, float]:
    """Agents at exact positions closer to an obstacle than allowed, by index, with their distance in metres."""
    places = [point for *_, point in stage.exact]
    margins = [agent.radius + mission.clearance for agent, *_ in stage.exact]
    open_ = near_to(obstacle, stage.time, places, margins)
    if not open_:
        return {}
    from missionc.geometry.placement_conflicts import too_near  # with numpy and shapely

    conflicts = too_near(obstacle, stage.time, [places[at] for at in open_], [margins[at] for at in open_])
    return {open_[at]: distance for at, distance in conflicts}


def _overlapping(mission: Mission, ground: FreeSpace, stage: Stage) -> list[Diagnostic]:
    exact = stage.exact
    points, who = [point for *_, point in exact], [agent.index for agent, *_ in exact]
    if all_apart(points, who, mission):
        return []
    from missionc.geometry.placement_conflicts import too_close  # with numpy and shapely
    from missionc.geometry.required_separation import SpacingTable

    pairs = too_close(points, who, SpacingTable.of(mission), MOST_PAIRS)
    by_spans: dict[tuple[Span, Span], list[tuple[int, int, float]]] = {}
    for first, second, distance in pairs:
        by_spans.setdefault((exact[first][1].span, exact[second][1].span), []).append((first, second, distance))
    return [
        _too_close(mission, stage, exact[overlaps[0][0]][:2], exact[overlaps[0][1]][:2], overlaps[0][2], len(overlaps))
        for overlaps in by_spans.values()
    ]


def _without_room(mission: Mission, ground: FreeSpace, stage: Stage) -> list[Diagnostic]:
    findings = []
    for region, there in ends_by_region(stage.places).items():
        if ground.lies(region.shape) is not Containment.OPEN:
            continue
        findings.extend(
            _no_room_for_one(ground, stage, region, there) or _no_room_for_all(ground, stage, region, there)
        )
    return findings


def _no_room_for_one(
    ground: FreeSpace, stage: Stage, region: Region, there: list[tuple[Agent, InitialSet]]
) -> list[Diagnostic]:
    area = ground.atlas.outer(region.shape)
    radii = {agent.radius for agent, _ in there}
    stuck = {radius for radius in radii if empty(common(area, ground.free(radius, stage.time)))}
    return [
        _no_place(ground.mission, stage, region, group)
        for group in _by_span(entry for entry in there if entry[0].radius in stuck)
    ]


def _no_room_for_all(
    ground: FreeSpace, stage: Stage, region: Region, there: list[tuple[Agent, InitialSet]]
) -> list[Diagnostic]:
    """Findings about start or finish regions that are too small for their agents.

    The area of the region and its rim is compared with the area of the bodies, each with half the separation around it.
    """
    mission = ground.mission
    sizes = [agent.radius + mission.separation / 2 for agent, _ in there]
    free = ground.free(min(agent.radius for agent, _ in there), stage.time)
    body = math.pi if mission.dimension == 2 else 4 / 3 * math.pi
    bodies = sum(body * size**mission.dimension for size in sizes)
    there_free = common(ground.atlas.outer(region.shape), free)
    if there_free.holds_ball((bodies / body) ** (1 / mission.dimension) - max(sizes)):
        return []
    room = ground.atlas.size(there_free, max(sizes))
    if bodies <= room * (1 + 1e-9):
        return []
    return [_too_many(stage, region, there, math.floor(room / (bodies / len(there))))]


def _by_span(entries: Iterable[tuple[Agent, InitialSet]]) -> list[list[tuple[Agent, InitialSet]]]:
    """Entries grouped by the source span at which their start or finish was written."""
    groups: dict[Span, list[tuple[Agent, InitialSet]]] = {}
    for agent, place in entries:
        groups.setdefault(place.span, []).append((agent, place))
    return list(groups.values())


# ------------------------------------------------------------------ messages


def _others(there: list[tuple[Agent, InitialSet]]) -> tuple[str, ...]:
    names = [f"`{agent.name}`" for agent, _ in there[1:]]
    return (f"also {listed(names)}",) if names else ()


def _point(place: InitialSet) -> str:
    return f"({', '.join(map(number, place.point or ()))})"


def _beyond_the_world(mission: Mission, stage: Stage, there: list[tuple[Agent, InitialSet]]) -> Diagnostic:
    (agent, place), low, high = there[0], mission.world.low, mission.world.high
    extent = f"({', '.join(map(number, low))}) to ({', '.join(map(number, high))})"
    return Diagnostic(
        OUTSIDE_WORLD,
        f"`{agent.name}` {stage.verbs} at {_point(place)}, outside the world",
        Label(place.span),
        (Label(mission.world.span, f"the world is {extent}"),),
        _others(there),
        "move this position into the world",
    )


def _touches_obstacle(
    mission: Mission, stage: Stage, obstacle: Obstacle, there: list[tuple[Agent, InitialSet]], distance: float
) -> Diagnostic:
    agent, place = there[0]
    needed = agent.radius + mission.clearance
    if distance <= 0:
        message = f"`{agent.name}` {stage.verbs} in obstacle `{obstacle.name}`"
    else:
        message = (
            f"`{agent.name}` {stage.verbs} {metres(distance)} from obstacle `{obstacle.name}`;"
            f" its radius and the clearance need {metres(needed)}"
        )
    moves = [] if isinstance(obstacle.motion, Still) else ["moved there"]
    grows = [f"grown by {metres(obstacle.grown(stage.time))}"] if obstacle.growth else []
    changed = " and ".join(moves + grows)
    moving = f", which has {changed} by {number(stage.time)} s" if changed and stage.time > 0 else ""
    return Diagnostic(
        IN_OBSTACLE,
        message,
        Label(place.span, f"at {_point(place)}"),
        (Label(obstacle.span, f"this obstacle{moving}"),),
        _others(there),
        f"move the agent at least {at_least_metres(needed - distance)} away from the obstacle",
    )


def _too_close(
    mission: Mission,
    stage: Stage,
    first: tuple[Agent, InitialSet],
    second: tuple[Agent, InitialSet],
    distance: float,
    pairs: int,
) -> Diagnostic:
    (one, here), (other, there) = first, second
    needed = mission.spacing(one.index, other.index)
    where = f"{metres(distance)} apart" if distance > 0 else "at the same point"
    counted = f"more than {pairs - 1:,}" if pairs >= MOST_PAIRS else f"{pairs - 1:,}"
    more = (
        ()
        if pairs == 1
        else (f"{counted} more {'pair of agents is' if pairs == 2 else 'pairs of agents are'} too close",)
    )
    takes = f"the radii and the separation need {spaced(needed)}"
    if needed.most > one.radius + other.radius + mission.separation:
        takes = f"their vehicles need {spaced(needed)} between centres"
    return Diagnostic(
        AGENTS_OVERLAP,
        f"`{one.name}` and `{other.name}` {stage.verb} {where}",
        Label(there.span, f"`{other.name}`" if there.span != here.span else ""),
        (Label(here.span, f"`{one.name}`"),) if there.span != here.span else (),
        (takes, *more),
        f"place the agents more than {spaced(needed)} apart",
    )


def _no_place(mission: Mission, stage: Stage, region: Region, there: list[tuple[Agent, InitialSet]]) -> Diagnostic:
    agent, place = there[0]
    needed = agent.radius + mission.clearance
    return Diagnostic(
        NO_ROOM,
        f"no free position in `{region.name}` for the {stage.verb} of `{agent.name}`",
        Label(place.span),
        (Label(region.span, f"every position is closer than {metres(needed)} to an obstacle or outside the world"),),
        _others(there),
        "make the region larger",
    )


def _too_many(stage: Stage, region: Region, there: list[tuple[Agent, InitialSet]], room: int) -> Diagnostic:
    holds = "no agent" if room == 0 else "at most one agent" if room == 1 else f"at most {room:,} agents"
    return Diagnostic(
        NO_ROOM,
        f"{len(there):,} agents {stage.verb} in `{region.name}`, which has room for {holds}",
        Label(there[0][1].span),
        (Label(region.span, "this region"),),
        ("the count includes the radii and the separation of the agents",),
        "make the region larger",
    )
