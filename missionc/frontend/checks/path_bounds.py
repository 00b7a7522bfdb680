"""Lower bounds on path lengths of an agent's centre between areas, around obstacles.

In the plane the bound is the geodesic around the obstacles that never move, at their initial size; in a volume it is
the straight line. Both bound any motion, at the steps and between them.
"""

from __future__ import annotations

import math
from dataclasses import field
from itertools import islice
from typing import TYPE_CHECKING, Any

from missionc.base.late_dataclass import Record, dataclass
from missionc.geometry.clear_ways import ClearWays
from missionc.geometry.configuration_space import SURE, Area, Atlas, common
from missionc.ir import Agent, Mission, Region, Shape, Still, Vector

if TYPE_CHECKING:
    from missionc.geometry.geodesic_bounds import VisibilityGraph

ROUNDING = 1e-9

PLACES = 9
"""Number of sample points in an area between which paths are computed without arrays."""

MOST_SEARCHES = 400
"""Maximum number of searches around obstacles; beyond that, straight lines are used."""


MANY_CORNERS = 400
"""Number of obstacle corners from which a grid is faster than exact geometry, once the grid's library is loaded."""


class Way(Record):
    """Lower bound on a path length in metres, infinite if there is no path.

    ``bent`` is True if obstacles determine it.
    """

    length: float
    bent: bool = False


@dataclass(slots=True, eq=False)
class LeastWays:
    """Lower bounds on the shortest paths of a mission's agents, cached.

    Args:
        standing: inner bound of the obstacles that never move.
    """

    mission: Mission
    atlas: Atlas
    standing: Area
    starts: dict[Region | Vector | None, Area] = field(default_factory=dict)
    known: dict[tuple[float, Area, Area, float], Way | None] = field(default_factory=dict)
    found: dict[tuple[float, Area, Area, float], bool] = field(default_factory=dict)
    """Cached results of the searches without arrays."""
    straight: dict[tuple[Area, Area, float], bool] = field(default_factory=dict)
    """Cached answers of ``_near``."""
    clear: dict[float, ClearWays] = field(default_factory=dict)
    graphs: dict[float, VisibilityGraph] = field(default_factory=dict)
    searches: int = 0

    def start(self, agent: Agent) -> Area:
        """Outer bound of an agent's start region."""
        key = agent.start.point or agent.start.region
        if key not in self.starts:
            self.starts[key] = self.atlas.initial(agent.start)
        return self.starts[key]

    def too_long(self, agent: Agent, start: Area, goal: Area, longest: float) -> Way | None:
        """Lower bound on the shortest path between two areas if it exceeds ``longest`` metres.

        None if the path may be shorter.
        """
        return self._straight(start, goal, longest) or self.bent(agent, start, goal, longest)

    def shown(self, agent: Agent, start: Area, goal: Area, longest: float) -> bool:
        """Return whether sample points prove, without geometry, that a path of at most ``longest`` metres exists."""
        asked = start, goal, longest
        if asked not in self.straight:
            self.straight[asked] = _near(*asked)
        if not self.straight[asked]:
            return False
        return not self.shapes or self._clear_way(self._room(agent), start, goal, longest)

    def bent(self, agent: Agent, start: Area, goal: Area, longest: float) -> Way | None:
        """Lower bound on the path around obstacles if it exceeds ``longest`` metres; None if the path may be shorter.

        The straight distance of the two areas is at most ``longest``.
        """
        if not self.shapes:
            return None
        asked = self._room(agent), start, goal, longest
        if asked not in self.known:
            self.known[asked] = self._bent(*asked)
        return self.known[asked]

    def _bent(self, room: float, start: Area, goal: Area, longest: float) -> Way | None:
        if self.searches >= MOST_SEARCHES:
            return None
        self.searches += 1
        if self._clear_way(room, start, goal, longest):
            return None
        if self._geodesic(room, start, goal, longest) <= longest:
            return None
        return Way(self._geodesic(room, start, goal, math.inf), bent=True)

    def _clear_way(self, room: float, start: Area, goal: Area, longest: float) -> bool:
        asked = room, start, goal, longest
        if asked not in self.found:
            if room not in self.clear:
                self.clear[room] = ClearWays(self.mission.world, self.shapes, room)
            graph = self.graphs.get(room)
            winding = graph is None or len(graph.points) > MANY_CORNERS
            places = _places(start), _places(goal), longest * (1 - ROUNDING)
            self.found[asked] = self.clear[room].found(*places, winding=winding)
        return self.found[asked]

    def passage(self, agent: Agent, start: Area, goal: Area) -> float:
        """Width in metres that the widest passage between two areas leaves for the agent's centre, if the agent has no
        path.
        """
        from missionc.geometry.geodesic_bounds import widest_passage  # with shapely

        ends = (self._flat(start), self._flat(goal))
        return widest_passage(self._flat(self.standing), self._room(agent), self._flat(None), *ends)

    def _straight(self, start: Area, goal: Area, longest: float) -> Way | None:
        if _near(start, goal, longest):
            return None
        length = self.atlas.distance(start, goal)
        return Way(length) if longest < length < math.inf else None

    def _geodesic(self, room: float, start: Area, goal: Area, longest: float) -> float:
        from missionc.geometry.geodesic_bounds import around  # with numpy and shapely, if no sample places show a path

        if room not in self.graphs:
            self.graphs[room] = around(self._flat(self.standing), room, self._flat(None))
        return self.graphs[room].geodesic(self._flat(start), self._flat(goal), longest)

    def _flat(self, area: Area | None) -> Any:
        """Plane geometry of an area, clipped to the world; for None, of the world."""
        whole = self.atlas.whole()
        return (whole if area is None else common(area, whole)).geometry()[0]

    def _room(self, agent: Agent) -> float:
        """Required distance of an agent's centre from every obstacle, metres."""
        return agent.radius + self.mission.clearance

    @property
    def shapes(self) -> tuple[Shape, ...]:
        """Shapes that paths avoid: static obstacles of a plane mission."""
        mission = self.mission
        if mission.dimension != 2:
            return ()
        return tuple(each.shape for each in mission.obstacles if isinstance(each.motion, Still))


def reach(mission: Mission, agent: Agent, steps: int) -> float:
    """Maximum distance in metres that an agent covers in ``steps`` steps, rounded up."""
    return agent.dynamics.top_speed * steps * mission.step * (1 + ROUNDING) + ROUNDING


def _near(start: Area, goal: Area, longest: float) -> bool:
    """Return whether a sample point of the start area is certainly within ``longest`` metres of the goal area."""
    return any(start.depth(place) >= 0 and goal.depth(place) > SURE - longest for place in start.seeds())


def _places(area: Area) -> tuple[Vector, ...]:
    """Some points that are certainly in an area."""
    return tuple(islice((seed for seed in area.seeds() if area.depth(seed) >= 0), PLACES))
