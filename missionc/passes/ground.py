"""Where agents can be: the world less the obstacles."""

from __future__ import annotations

from dataclasses import dataclass, field

from missionc.ir import Mission, Obstacle, Still
from missionc.world.areas import Area, Atlas, common, covers, moved, union, without
from missionc.world.crowd import displaced

HAIR = 0.01
"""Metres around an obstacle that count as its inside, where all bodies are larger: more than circles are off by."""

SLACK = 1e-6
"""Metres by which obstacles are taken smaller, so that a place that just touches one still counts as free."""


@dataclass(frozen=True, slots=True, eq=False)
class Ground:
    """Outer bounds of where an agent's centre can be, by its radius."""

    mission: Mission
    atlas: Atlas
    standing: Area
    """At most the points of the obstacles that never move."""
    filled: Area
    """The same, and a hair's breadth around them, which no agent's centre can be in either."""
    known: dict[tuple[float, float | None], Area] = field(default_factory=dict)

    @staticmethod
    def of(mission: Mission) -> Ground:
        dimension = mission.dimension
        shapes = [region.shape for region in mission.regions]
        for obstacle in mission.obstacles:
            times = (0.0,) if isinstance(obstacle.motion, Still) else (0.0, float(mission.horizon))
            shapes.extend(moved(obstacle.shape, displaced(obstacle, time, dimension)) for time in times)
        atlas = Atlas.of(mission.world, shapes)
        still = [obstacle.shape for obstacle in mission.obstacles if isinstance(obstacle.motion, Still)]
        standing = union([atlas.inner(shape) for shape in still], len(atlas.heights))
        return Ground(mission, atlas, standing, atlas.grown(standing, _hair(mission), outer=False))

    def fills(self, obstacle: Obstacle, area: Area) -> bool:
        """Whether an obstacle that stands still covers an area by itself, but for a hair's breadth."""
        body = self.atlas.inner(obstacle.shape)
        return covers(self.atlas.grown(body, _hair(self.mission), outer=False), area)

    def free(self, radius: float, time: float | None = None) -> Area:
        """Where the centre of an agent can be: ever, or (moving obstacles regarded too) at a time, in seconds."""
        key = (radius, time)
        if key not in self.known:
            self.known[key] = self._free(radius, time)
        return self.known[key]

    def _free(self, radius: float, time: float | None) -> Area:
        mission, atlas = self.mission, self.atlas
        if time is None:
            taken = self.standing
        else:
            shapes = [
                moved(obstacle.shape, displaced(obstacle, time, mission.dimension)) for obstacle in mission.obstacles
            ]
            taken = union([atlas.inner(shape) for shape in shapes], len(atlas.heights))
        blocked = atlas.grown(taken, radius + mission.clearance - SLACK, outer=False)
        return common(without(atlas.whole(), blocked), atlas.whole())


def _hair(mission: Mission) -> float:
    body = min((agent.radius for agent in mission.agents), default=0.0) + mission.clearance
    return max(min(HAIR, body - SLACK), 0.0)
