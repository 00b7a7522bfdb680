"""View of the team from where agents are: what predicates measure, on any array library."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable
from typing import Any

from missionc.ir import Beacon, Flag, FormationEdge, Graph, Region, Resource
from missionc.ir.distances.signed_distance import Array, Namespace, distance_between, length, signed_distance
from missionc.ir.language.margins.formation import edge_error


class View:
    """Measures of agents, (...), metres (speeds m/s); a kind of view says where these are.

    ``xp`` is the library of its arrays. What a view does not see is a ``ValueError``.
    """

    def __init__(self, xp: Namespace, dimension: int) -> None:
        self.xp, self.dimension = xp, dimension

    @abstractmethod
    def own(self) -> Array:
        """Where the agents are that are asked: (..., dim), metres."""

    @abstractmethod
    def place(self, agent: int) -> Array:
        """Where this agent is: (..., dim), metres, and broadcasts with ``own``."""

    def velocity(self) -> Array:
        """The velocity of the agents that are asked: (..., dim), m/s."""
        raise ValueError("no speed is seen here")

    def radius(self) -> Array:
        """The radius of the bodies of the agents that are asked: (...) or one number, metres."""
        raise ValueError("no bodies are seen here")

    @abstractmethod
    def plane(self) -> Array | float:
        """The altitude of the agents that are asked, in a plane: (...) or one number, metres."""

    def weakest_link(self, graph: Graph) -> Array:
        raise ValueError("no connected graph is seen here")

    def coordinate(self, axis: int) -> Array:
        return self.own()[..., axis]

    def altitude(self) -> Array:
        own = self.own()
        return own[..., 2] if self.dimension == 3 else self.plane() + 0.0 * own[..., 0]

    def speed(self) -> Array:
        velocity = self.velocity()
        return length(self.xp, [velocity[..., axis] for axis in range(self.dimension)])

    def outside(self, region: Region) -> Array:
        return signed_distance(self.xp, region.shape, self.own())

    def to_beacon(self, beacon: Beacon) -> Array:
        return distance_between(self.xp, self.own(), beacon.position)

    def of_place(self, value: Callable[[Any, Array], Array]) -> Array:
        return value(self.xp, self.own())

    def apart(self, first: int | None, second: int) -> Array:
        return distance_between(self.xp, self.own() if first is None else self.place(first), self.place(second))

    def formation_error(self, edge: FormationEdge) -> Array:
        return edge_error(self.xp, edge, self.place(edge.first), self.place(edge.second))

    def level(self, resource: Resource) -> Array:
        raise ValueError("no steps before are seen here")

    def flagged(self, flag: Flag) -> Array:
        raise ValueError("no steps before are seen here")

    def heading(self) -> Array:
        """Where the agents face that are asked: (...), rad. These views are of numpy."""
        raise ValueError("no heading is seen here")

    def facing(self, towards: float | Beacon, within: float) -> Array:
        from missionc.ir.language.margins import headings  # numpy, which nothing else here loads

        if not isinstance(towards, Beacon):
            return headings.of_direction(self.heading(), towards, within)
        x, y = (towards.position[axis] - self.coordinate(axis) for axis in (0, 1))
        return headings.of_place(self.heading(), x, y, within)

    def nothing(self, *, of_team: bool = False) -> Array:
        return 0.0 * (self.place(0) if of_team else self.own())[..., 0]

    def larger(self, one: Array, other: Array) -> Array:
        return self.xp.maximum(one, other)
