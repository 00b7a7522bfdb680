"""Winding of paths round what stands: the angle that each agent sweeps about each part of the standing obstacles.

    in   Mission, positions over time
    out  StandingPart, angles

Of two paths from one place to another, those that pass a part on different sides, or go round it once more, sweep
angles about it that differ by whole turns; nothing that moves a path a little changes that. They are of different
homotopy classes then. Parts that hang together for the smallest agent are one. One that reaches the
world's border has one side and is left out, and so is, in a volume, what does not stand from the floor to the ceiling.

Source:
    Bhattacharya, Likhachev, Kumar, topological constraints in search-based planning, 2012, for the plane.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely

from missionc.base.trace import Array
from missionc.geometry.configuration_space import Atlas
from missionc.ir import Mission, Shape, Still

MOST_PARTS = 64
"""Parts that are told apart: the largest."""

TURN = np.pi
"""Radians by which angles differ at least of paths that pass on different sides."""


@dataclass(frozen=True, slots=True, eq=False)
class StandingPart:
    """A part of the standing obstacles that can be gone round.

    Args:
        name: the obstacles that it is made of.
        point: one in it that nobody passes, (2,), metres.
        solid: what stands, as a shapely geometry.
    """

    name: str
    point: Array
    solid: shapely.Geometry


def standing_parts(mission: Mission) -> tuple[StandingPart, ...]:
    """The parts of a mission's standing obstacles that can be gone round."""
    standing = [obstacle for obstacle in mission.obstacles if isinstance(obstacle.motion, Still)]
    if not standing or mission.world.flat:
        return ()
    solids = {each.name: outline(mission, each.shape) for each in standing}
    room = least_room(mission)
    grown = shapely.union_all([solid.buffer(room) for solid in solids.values()])
    inside = shapely.box(*mission.world.low[:2], *mission.world.high[:2])
    parts = [
        part
        for part in shapely.get_parts(grown)
        if part.area > 0 and inside.contains(part) and not part.touches(inside.exterior)
    ]
    made: list[StandingPart] = []
    for part in sorted(parts, key=lambda each: (-each.area, each.bounds))[:MOST_PARTS]:
        own = {name: solid.intersection(part) for name, solid in solids.items()}
        own = {name: solid for name, solid in own.items() if not solid.is_empty}
        solid = shapely.union_all(list(own.values()))
        middle = solid.representative_point()
        made.append(StandingPart(" and ".join(own), np.array([middle.x, middle.y]), solid))
    return tuple(made)


def least_room(mission: Mission) -> float:
    """What the smallest agent keeps from its centre to what stands, metres."""
    return float(mission.clearance) + min(float(agent.radius) for agent in mission.agents)


def outline(mission: Mission, shape: Shape) -> shapely.Geometry:
    """What a shape bars in the plane; in a volume, what it bars at every height."""
    atlas = Atlas.of(mission.world, [shape])
    layers = [
        geometry
        for geometry, (low, high) in zip(atlas.outer(shape).geometry(), atlas.heights, strict=True)
        if low < high
    ]
    return shapely.intersection_all(layers) if layers else shapely.Point()


def swept_angles(parts: tuple[StandingPart, ...], position: Array) -> Array:
    """What agents at these places, (agents, steps + 1, dim), sweep about each part: (agents, parts), radians.

    Positive where a part is on the left of who passes it.
    """
    swept = np.zeros((len(position), len(parts)))
    for number, part in enumerate(parts):
        away = position[..., :2] - part.point
        angle = np.unwrap(np.arctan2(away[..., 1], away[..., 0]), axis=1)
        swept[:, number] = angle[:, -1] - angle[:, 0]
    return swept
