"""Lower bounds on path lengths: geodesics of an agent's centre between sets of places, around obstacles.

In the plane that is the geodesic between them, round the obstacles that never move, as small as they begin; in a volume
the straight line. Both are lower bounds on what any motion takes, at the steps and between them.
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
"""Places of a set that ways are looked for from and to in plain numbers."""

MOST_SEARCHES = 400
"""Ways that are looked for round obstacles; of more, straight lines are all that is known."""


MANY_CORNERS = 400
"""Corners of obstacles from which on a grid is quicker than their geometry, once that is loaded."""


class Way(Record):
    """At least so many metres, infinite where there is no way; ``bent``: because of obstacles."""

    length: float
    bent: bool = False


@dataclass(slots=True, eq=False)
class LeastWays:
    """The least ways of a mission's agents, each looked for once.

    Args:
        standing: at most the points of the obstacles that never move.
    """

    mission: Mission
    atlas: Atlas
    standing: Area
    starts: dict[Region | Vector | None, Area] = field(default_factory=dict)
    known: dict[tuple[float, Area, Area, float], Way | None] = field(default_factory=dict)
    found: dict[tuple[float, Area, Area, float], bool] = field(default_factory=dict)
    """Ways that plain numbers have found, or not."""
    straight: dict[tuple[Area, Area, float], bool] = field(default_factory=dict)
    """Whether a place of the one set is surely so near to the other."""
    clear: dict[float, ClearWays] = field(default_factory=dict)
    graphs: dict[float, VisibilityGraph] = field(default_factory=dict)
    searches: int = 0

    def start(self, agent: Agent) -> Area:
        """Where an agent starts, at least."""
        key = agent.start.point or agent.start.region
        if key not in self.starts:
            self.starts[key] = self.atlas.initial(agent.start)
        return self.starts[key]

    def too_long(self, agent: Agent, start: Area, goal: Area, longest: float) -> Way | None:
        """The least way from a set to another where none is as short as ``longest``; None where one may be."""
        return self._straight(start, goal, longest) or self.bent(agent, start, goal, longest)

    def shown(self, agent: Agent, start: Area, goal: Area, longest: float) -> bool:
        """Whether places show, without geometry, that there is a way as short as ``longest``."""
        asked = start, goal, longest
        if asked not in self.straight:
            self.straight[asked] = _near(*asked)
        if not self.straight[asked]:
            return False
        return not self.shapes or self._clear_way(self._room(agent), start, goal, longest)

    def bent(self, agent: Agent, start: Area, goal: Area, longest: float) -> Way | None:
        """The same of two sets whose straight distance is not too long: the way round the obstacles."""
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
        """The room of a centre in the widest passage from one set to another, metres, where an agent has no way."""
        from missionc.geometry.geodesic_bounds import widest_passage  # with shapely

        ends = (self._flat(start), self._flat(goal))
        return widest_passage(self._flat(self.standing), self._room(agent), self._flat(None), *ends)

    def _straight(self, start: Area, goal: Area, longest: float) -> Way | None:
        if _near(start, goal, longest):
            return None
        length = self.atlas.distance(start, goal)
        return Way(length) if longest < length < math.inf else None

    def _geodesic(self, room: float, start: Area, goal: Area, longest: float) -> float:
        from missionc.geometry.geodesic_bounds import around  # with numpy and shapely, where no place has shown a way

        if room not in self.graphs:
            self.graphs[room] = around(self._flat(self.standing), room, self._flat(None))
        return self.graphs[room].geodesic(self._flat(start), self._flat(goal), longest)

    def _flat(self, area: Area | None) -> Any:
        """The one geometry of an area of the plane, as far as it is in the world; None is the world."""
        whole = self.atlas.whole()
        return (whole if area is None else common(area, whole)).geometry()[0]

    def _room(self, agent: Agent) -> float:
        """Metres that an agent's centre keeps to every obstacle."""
        return agent.radius + self.mission.clearance

    @property
    def shapes(self) -> tuple[Shape, ...]:
        """The obstacles that ways go round: those that stand, in the plane."""
        mission = self.mission
        if mission.dimension != 2:
            return ()
        return tuple(each.shape for each in mission.obstacles if isinstance(each.motion, Still))


def reach(mission: Mission, agent: Agent, steps: int) -> float:
    """How far an agent gets in so many steps, metres, with what rounding may add."""
    return agent.dynamics.top_speed * steps * mission.step * (1 + ROUNDING) + ROUNDING


def _near(start: Area, goal: Area, longest: float) -> bool:
    """Whether a place of the one set is surely so near to the other, on a straight line."""
    return any(start.depth(place) >= 0 and goal.depth(place) > SURE - longest for place in start.seeds())


def _places(area: Area) -> tuple[Vector, ...]:
    """Some places that are surely in a set."""
    return tuple(islice((seed for seed in area.seeds() if area.depth(seed) >= 0), PLACES))
