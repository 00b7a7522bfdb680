"""Free space: outer bounds on agents' positions, the world minus the obstacles, and conclusions from them alone."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import field
from enum import Enum

from missionc.base.late_dataclass import Record
from missionc.frontend.checks.literals import LiteralPlaces
from missionc.frontend.checks.path_bounds import LeastWays
from missionc.geometry.configuration_space import Area, Atlas, common, covers, disjoint, empty, without
from missionc.geometry.displacement import displaced, moved
from missionc.ir import Agent, Mission, Obstacle, Shape, Still

HAIR = 0.01
"""Margin in metres around an obstacle that counts as its inside, if all bodies are larger."""

SLACK = 1e-6
"""Shrinkage of obstacles in metres, so that a position that just touches an obstacle still counts as free."""


class Containment(Enum):
    """Location of a shape relative to the world and the obstacles; only ``OPEN`` shapes may contain an agent."""

    NOWHERE = "it is empty"
    ELSEWHERE = "outside the world"
    COVERED = "within obstacles"
    OPEN = "somewhere in the world"


class FreeSpace(Record, eq=False):
    """Outer bounds on the positions of an agent's centre, by its radius; the result of each query is cached."""

    mission: Mission
    atlas: Atlas
    standing: Area
    """Inner bound of the obstacles that never move, with growing obstacles at their initial size."""
    filled: Area
    """Inner bound of the obstacles that never move, with a small margin around them that no agent's centre can be in
    either.
    """
    ways: LeastWays
    known_free: dict[tuple[float, float | None], Area] = field(default_factory=dict)
    known_lies: dict[Shape, Containment] = field(default_factory=dict)
    known_places: dict[tuple[float, float], LiteralPlaces] = field(default_factory=dict)

    @staticmethod
    def of(mission: Mission) -> FreeSpace:
        """Free space of a mission, whose world must not be flat."""
        dimension = mission.dimension
        shapes = [region.shape for region in mission.regions]
        for obstacle in mission.obstacles:
            times = (0.0,) if obstacle.constant else (0.0, float(mission.horizon))
            shapes.extend(moved(obstacle.shape, displaced(obstacle, time, dimension)) for time in times)
        atlas = Atlas.of(mission.world, shapes)
        still = [obstacle.shape for obstacle in mission.obstacles if isinstance(obstacle.motion, Still)]
        standing = atlas.union([atlas.inner(shape) for shape in still])
        filled = atlas.grown(standing, _hair(mission), outer=False)
        return FreeSpace(mission, atlas, standing, filled, LeastWays(mission, atlas, standing))

    def fills(self, obstacle: Obstacle, area: Area) -> bool:
        """Return whether a static obstacle covers an area by itself, except for a tiny margin."""
        body = self.atlas.inner(obstacle.shape)
        return covers(self.atlas.grown(body, _hair(self.mission), outer=False), area)

    def lies(self, shape: Shape) -> Containment:
        """Location of a static shape, which states whether any agent's centre may be in the shape."""
        if shape not in self.known_lies:
            self.known_lies[shape] = self._lies(shape)
        return self.known_lies[shape]

    def _lies(self, shape: Shape) -> Containment:
        area = self.atlas.outer(shape)
        if empty(area):
            return Containment.NOWHERE
        if disjoint(area, self.atlas.whole()):
            return Containment.ELSEWHERE
        return Containment.COVERED if covers(self.filled, area) else Containment.OPEN

    def places(self, agents: Sequence[Agent]) -> LiteralPlaces:
        """Positions that literals allow for the centre of any of these agents."""
        radii = [agent.radius for agent in agents]
        between = min(radii), max(radii)
        if between not in self.known_places:
            self.known_places[between] = LiteralPlaces(self.atlas, *between)
        return self.known_places[between]

    def free(self, radius: float, time: float | None = None) -> Area:
        """Outer bound on the positions of an agent's centre, for a body with this radius in metres.

        Args:
            time: time in seconds, to take moving obstacles into account; None for all times.
        """
        if (radius, time) not in self.known_free:
            self.known_free[radius, time] = self._free(radius, time)
        return self.known_free[radius, time]

    def _free(self, radius: float, time: float | None) -> Area:
        mission, atlas = self.mission, self.atlas
        if time is None:
            taken = self.standing
        else:
            taken = atlas.union([self._then(obstacle, time) for obstacle in mission.obstacles])
        blocked = atlas.grown(taken, radius + mission.clearance - SLACK, outer=False)
        return common(without(atlas.whole(), blocked), atlas.whole())

    def _then(self, obstacle: Obstacle, time: float) -> Area:
        """Inner bound of a moving obstacle at a time, in seconds."""
        there = self.atlas.inner(moved(obstacle.shape, displaced(obstacle, time, self.mission.dimension)))
        grown = obstacle.grown(time)
        return self.atlas.grown(there, grown, outer=False) if grown else there


def _hair(mission: Mission) -> float:
    body = min((agent.radius for agent in mission.agents), default=0.0) + mission.clearance
    return max(min(HAIR, body - SLACK), 0.0)
