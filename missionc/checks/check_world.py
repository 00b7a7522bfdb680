"""Check of a mission against its world: starts, goals, resources, regions, graphs, formations and vehicles.

    in   Mission, its Kernel
    out  nothing but findings
    says MC037 MC221 MC501 MC502 MC503 MC504 MC505 MC506 MC507 MC508 MC509 MC512 MC516 MC518 MC519 MC520 MC531 MC541
         MC731 MC542 MC543 MC558

Only what no plan can mend is an error: whatever is said to be out of reach or
without room is so by an outer bound.
"""

from __future__ import annotations

from missionc.checks.check_goals import check_goals
from missionc.checks.check_graphs import check_graphs
from missionc.checks.check_lanes import check_lanes
from missionc.checks.check_pads import check_pads
from missionc.checks.check_places import check_places
from missionc.checks.check_resources import check_resources
from missionc.checks.check_starts import check_starts
from missionc.checks.check_tracking import check_tracking
from missionc.checks.check_vehicles import check_vehicles
from missionc.checks.flown_speeds import check_flown_speeds
from missionc.checks.free_space import FreeSpace, Lies
from missionc.diagnostics.code import NO_AREA, REGION_IN_OBSTACLE, REGION_OUTSIDE_WORLD
from missionc.diagnostics.model import Diagnostic, Label, has_errors
from missionc.diagnostics.text_order import in_text_order
from missionc.ir import Anywhere, Mission, Obstacle, Region, Still
from missionc.ir.wording import listed, number
from missionc.kernel.nodes import Atom, Kernel
from missionc.kernel.walk import postorder
from missionc.world.configuration_space import disjoint


def check_world(mission: Mission, kernel: Kernel, ground: FreeSpace | None = None) -> list[Diagnostic]:
    """All about the world and who is in it that cannot be meant; ``ground`` is the mission's where it is known."""
    if mission.world.flat:
        return [_flat_world(mission)]
    ground = ground or FreeSpace.of(mission)
    entered = _entered(mission, kernel)
    outside, misplaced = check_places(mission, kernel, entered)
    found = [
        *outside,
        *_check_regions(mission, ground, entered - misplaced),
        *check_graphs(mission),
        *check_starts(mission, ground),
        *check_goals(mission, kernel, ground),
        *check_resources(mission, kernel, ground),
        *check_vehicles(mission, ground),
        *check_tracking(mission),
        *check_pads(mission),
        *check_lanes(mission),
    ]
    return in_text_order(found if has_errors(found) else [*found, *check_flown_speeds(mission, kernel)])


def _check_regions(mission: Mission, ground: FreeSpace, entered: set[str]) -> list[Diagnostic]:
    findings = []
    for region in mission.regions:
        match ground.lies(region.shape):
            case Lies.NOWHERE:
                findings.append(_nothing_left(region))
            case Lies.ELSEWHERE if region.name in entered:
                findings.append(_elsewhere(mission, region))
            case Lies.COVERED if region.name in entered:
                findings.append(_swallowed(region, _around(mission, ground, region)))
            case _:
                pass
    return findings


def _entered(mission: Mission, kernel: Kernel) -> set[str]:
    """The regions of which it is asked who is in them; a distance, or a shape, may be that of any other."""
    atoms = (node.predicate.region for node in postorder(kernel.meanings.values()) if isinstance(node, Atom))
    ends = (
        place.region for agent in mission.agents for place in (agent.start, agent.finish) if isinstance(place, Anywhere)
    )
    return {region.name for region in (*atoms, *ends) if region}


def _around(mission: Mission, ground: FreeSpace, region: Region) -> list[Obstacle]:
    """The standing obstacle that covers the region, or else all that meet it."""
    atlas = ground.atlas
    area = atlas.outer(region.shape)
    still = [obstacle for obstacle in mission.obstacles if isinstance(obstacle.motion, Still)]
    single = [obstacle for obstacle in still if ground.fills(obstacle, area)]
    return single[:1] or [obstacle for obstacle in still if not disjoint(atlas.inner(obstacle.shape), area)]


# ------------------------------------------------------------------ messages


def _flat_world(mission: Mission) -> Diagnostic:
    low, high = (f"({', '.join(map(number, corner))})" for corner in (mission.world.low, mission.world.high))
    return Diagnostic(
        NO_AREA,
        f"the world from {low} to {high} has no room",
        Label(mission.world.span),
        help="let the second corner be larger in every coordinate",
    )


def _nothing_left(region: Region) -> Diagnostic:
    return Diagnostic(
        NO_AREA,
        f"region `{region.name}` is empty: the shapes it is made of leave nothing",
        Label(region.span),
        help="look at what it intersects or takes away",
    )


def _elsewhere(mission: Mission, region: Region) -> Diagnostic:
    return Diagnostic(
        REGION_OUTSIDE_WORLD,
        f"region `{region.name}` lies outside the world",
        Label(region.span),
        (Label(mission.world.span, "the world"),),
        help="move the region into the world, or make the world larger",
    )


def _swallowed(region: Region, obstacles: list[Obstacle]) -> Diagnostic:
    names = listed([f"`{obstacle.name}`" for obstacle in obstacles])
    return Diagnostic(
        REGION_IN_OBSTACLE,
        f"region `{region.name}` lies inside {'obstacle' if len(obstacles) == 1 else 'obstacles'} {names}",
        Label(region.span, "no agent can be here"),
        tuple(Label(obstacle.span, f"`{obstacle.name}`") for obstacle in obstacles[:3]),
        help="move the region, or make it larger than the obstacle",
    )
