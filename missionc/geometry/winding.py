"""Winding of paths around static obstacles: the angle that each path sweeps about each obstacle part.

    in   Mission, positions over time
    out  StandingPart, angles

If two paths between the same ends pass a part on different sides, or circle it a different number of times, their
angles differ by whole turns. Small changes of a path do not change this, so the paths are of different homotopy
classes. Obstacles whose gaps are too narrow for the smallest agent count as one part. A part that reaches the world's
border has only one side and is omitted. In a volume, parts that do not reach from floor to ceiling are omitted too.

Source:
    Bhattacharya, Likhachev, Kumar, topological constraints in search-based planning, 2012, for the plane.
"""

from __future__ import annotations

import numpy as np
import shapely

from missionc.base.late_dataclass import Record
from missionc.base.trace import Array
from missionc.geometry.configuration_space import Atlas
from missionc.ir import Mission, Shape, Still

MOST_PARTS = 64
"""Maximum number of obstacle parts: the largest are used."""

TURN = np.pi
"""Least difference of angles, radians, of paths in different homotopy classes."""


class StandingPart(Record, eq=False):
    """Connected part of the static obstacles that paths can circle.

    Args:
        name: names of the part's obstacles.
        point: inner point that no agent passes, (2,), metres.
        solid: the obstacles as a shapely geometry.
    """

    name: str
    point: Array
    solid: shapely.Geometry


def standing_parts(mission: Mission) -> tuple[StandingPart, ...]:
    """Connected parts of a mission's static obstacles that paths can circle."""
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
    """Required distance of the smallest agent's centre from static obstacles, metres."""
    return float(mission.clearance) + min(float(agent.radius) for agent in mission.agents)


def outline(mission: Mission, shape: Shape) -> shapely.Geometry:
    """Area that a shape blocks in the plane; in a volume, the area that it blocks at every height."""
    atlas = Atlas.of(mission.world, [shape])
    layers = [
        geometry
        for geometry, (low, high) in zip(atlas.outer(shape).geometry(), atlas.heights, strict=True)
        if low < high
    ]
    return shapely.intersection_all(layers) if layers else shapely.Point()


def swept_angles(parts: tuple[StandingPart, ...], position: Array) -> Array:
    """Angles that agent paths sweep about each obstacle part, positive if the part is on the agent's left.

    Shape: (agents, steps + 1, dim), metres -> (agents, parts), radians.
    """
    swept = np.zeros((len(position), len(parts)))
    for number, part in enumerate(parts):
        away = position[..., :2] - part.point
        angle = np.unwrap(np.arctan2(away[..., 1], away[..., 0]), axis=1)
        swept[:, number] = angle[:, -1] - angle[:, 0]
    return swept
