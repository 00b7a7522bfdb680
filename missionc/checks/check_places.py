"""Check of obstacles, regions and beacons, and of the files they come from: none lies outside the world unnoticed.

    in   Mission, its Kernel
    out  findings, and the names of the places of files that lie outside altogether
    says MC037 MC558

An obstacle lies outside if it is too far from the world to touch a body in it. A beacon, and a region whose distance is
measured, may lie beside the world, up to the length of its diagonal away.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, TypeAlias

from missionc.diagnostics.code import FILE_OUTSIDE_WORLD, PLACE_OUTSIDE_WORLD
from missionc.diagnostics.model import Diagnostic, Label
from missionc.ir import Beacon, Compare, DistanceTo, Mission, Obstacle, Path, PlacesFile, Region
from missionc.ir.wording import metres, point
from missionc.kernel.nodes import Atom, Kernel
from missionc.kernel.walk import postorder
from missionc.world.bounding_box import between, gap

if TYPE_CHECKING:
    from missionc.maps.feature import Asked
    from missionc.maps.read_summary import Extents

Place: TypeAlias = "Obstacle | Region | Beacon"


def check_places(mission: Mission, kernel: Kernel, entered: set[str]) -> tuple[list[Diagnostic], frozenset[str]]:
    """A finding for each place outside the world, one for all of a file.

    Args:
        entered: the regions that an agent is to enter or to avoid, which are an error there (MC504).
    """
    measured = _measured(kernel)
    places: tuple[Place, ...] = (*mission.obstacles, *mission.regions, *mission.beacons)
    outside = {place.name: place for place in places if _outside(mission, place, place.name in measured)}
    findings: list[Diagnostic] = []
    misplaced: set[str] = set()
    world = mission.world.low[:2], mission.world.high[:2]
    for file in mission.files:
        there = [outside.pop(name) for name in sorted(file.names & outside.keys())]
        extents, asked = file.summary.extents, file.asked
        if not there or extents is None or asked is None:
            continue
        if len(there) == len(file.names) and between(extents, world) > 0:
            findings.append(_all_outside(mission, file, asked, extents))
            misplaced |= file.names
        else:
            findings.append(_some_outside(mission, file, asked, there))
    findings += [_one_outside(mission, place) for name, place in outside.items() if name not in entered]
    return findings, frozenset(misplaced)


def _outside(mission: Mission, place: Place, measured: bool) -> bool:
    away = _away(mission, place)
    if isinstance(place, Obstacle):
        return away > max(agent.radius for agent in mission.agents) + mission.clearance
    diagonal = math.dist(mission.world.low, mission.world.high)
    return away > (diagonal if measured or isinstance(place, Beacon) else 0.0)


def _away(mission: Mission, place: Place) -> float:
    """Metres from the world, at most; those of an obstacle over all its motion."""
    low, high = mission.world.low, mission.world.high
    if isinstance(place, Beacon):
        return between((place.position, place.position), (low, high))
    if isinstance(place, Obstacle) and isinstance(place.motion, Path):
        offsets = [(*each, *(0.0,) * (mission.dimension - len(each))) for each in place.motion.offsets]
        low = tuple(least - max(moved) for least, *moved in zip(low, *offsets, strict=True))
        high = tuple(most - min(moved) for most, *moved in zip(high, *offsets, strict=True))
    grown = place.grown(mission.horizon) if isinstance(place, Obstacle) else 0.0
    return max(gap(place.shape, low, high) - grown, 0.0)


def _measured(kernel: Kernel) -> set[str]:
    """The regions whose distance a formula measures."""
    atoms = [node.predicate for node in postorder(kernel.meanings.values()) if isinstance(node, Atom)]
    features = [feature for atom in atoms if isinstance(atom, Compare) for _, feature in atom.terms]
    targets = [feature.target for feature in features if isinstance(feature, DistanceTo)]
    return {target.name for target in targets if isinstance(target, Region)}


# ------------------------------------------------------------------ messages


def _all_outside(mission: Mission, file: PlacesFile, asked: Asked, extents: Extents) -> Diagnostic:
    from missionc.maps.feature import MapError  # few missions read files
    from missionc.maps.likely_cause import likely_cause

    low, high = extents
    (west, south, *_), (east, north, *_) = mission.world.low, mission.world.high
    try:
        way_out = likely_cause(asked, extents, ((west, south), (east, north)))
    except MapError as error:
        return error.finding
    every = f"the {file.kind}" if len(file.names) == 1 else f"all {len(file.names)} {file.kind}s"
    return Diagnostic(
        FILE_OUTSIDE_WORLD,
        f"{every} of `{file.path}` lie{'s' if len(file.names) == 1 else ''} outside the world, from {point(low)} to "
        f"{point(high)} m",
        Label(asked.span),
        (Label(mission.world.span, "the world"),),
        help=way_out,
    )


def _some_outside(mission: Mission, file: PlacesFile, asked: Asked, outside: list[Place]) -> Diagnostic:
    first = outside[0].span
    beside = () if first == asked.span else (Label(first, f"`{outside[0].name}`"),)
    return Diagnostic(
        PLACE_OUTSIDE_WORLD,
        f"{len(outside)} of {len(file.names)} {file.kind}s of `{file.path}` lie outside the world",
        Label(asked.span),
        (Label(mission.world.span, "the world"), *beside),
        help="make the world larger, or leave out what lies beside it",
    )


def _one_outside(mission: Mission, place: Place) -> Diagnostic:
    kind = type(place).__name__.lower()
    return Diagnostic(
        PLACE_OUTSIDE_WORLD,
        f"{kind} `{place.name}` lies outside the world, {metres(round(_away(mission, place), 1))} away",
        Label(place.span),
        (Label(mission.world.span, "the world"),),
        help=f"move the {kind} into the world, or make the world larger",
    )
