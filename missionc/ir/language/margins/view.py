"""View of the team that computes the measures of predicates from agent positions, on any array library."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable
from typing import Any

from missionc.ir import Beacon, Flag, FormationEdge, Graph, Region, Resource
from missionc.ir.distances.signed_distance import Array, Namespace, distance_between, length, signed_distance
from missionc.ir.language.margins.formation import edge_error


class View:
    """Measures of agents for predicates, as arrays (...), metres (speeds m/s); subclasses supply the positions.

    ``xp`` is the array library. A measure that a subclass cannot compute raises ``ValueError``.
    """

    def __init__(self, xp: Namespace, dimension: int) -> None:
        self.xp, self.dimension = xp, dimension

    @abstractmethod
    def own(self) -> Array:
        """Positions of the evaluated agents: (..., dim), metres."""

    @abstractmethod
    def place(self, agent: int) -> Array:
        """Positions of the agent with this mission index: (..., dim), metres; broadcasts with ``own``."""

    def velocity(self) -> Array:
        """Velocity of the evaluated agents: (..., dim), m/s."""
        raise ValueError("no speed is seen here")

    def radius(self) -> Array:
        """Body radii of the evaluated agents: (...) or one number, metres."""
        raise ValueError("no bodies are seen here")

    @abstractmethod
    def plane(self) -> Array | float:
        """Flight altitude of the evaluated agents in a plane mission: (...) or one number, metres."""

    def least_in_motion(self, margin: Callable[[Any], Array]) -> Array:
        """Least value of a margin over the agents' motions to the next step: (...), metres."""
        raise ValueError("no motion is seen here")

    def weakest_link(self, graph: Graph) -> Array:
        """Margin of the worst link of the graph's maximum spanning tree: (...), metres."""
        raise ValueError("no connected graph is seen here")

    def coordinate(self, axis: int) -> Array:
        """Coordinate along ``axis`` of the evaluated agents' positions: (...), metres."""
        return self.own()[..., axis]

    def altitude(self) -> Array:
        """Altitude of the evaluated agents: (...), metres."""
        own = self.own()
        return own[..., 2] if self.dimension == 3 else self.plane() + 0.0 * own[..., 0]

    def speed(self) -> Array:
        """Speed of the evaluated agents: (...), m/s."""
        velocity = self.velocity()
        return length(self.xp, [velocity[..., axis] for axis in range(self.dimension)])

    def outside(self, region: Region) -> Array:
        """Signed distance of the evaluated agents to a region's border, negative inside: (...), metres."""
        return signed_distance(self.xp, region.shape, self.own())

    def to_beacon(self, beacon: Beacon) -> Array:
        """Distance of the evaluated agents to a beacon: (...), metres."""
        return distance_between(self.xp, self.own(), beacon.position)

    def of_place(self, value: Callable[[Any, Array], Array]) -> Array:
        """Value of a function of the array library and the evaluated agents' positions: (...), metres."""
        return value(self.xp, self.own())

    def apart(self, first: int | None, second: int) -> Array:
        """Distance between the centres of two agents (``first`` None is the evaluated agent): (...), metres."""
        return distance_between(self.xp, self.own() if first is None else self.place(first), self.place(second))

    def formation_error(self, edge: FormationEdge) -> Array:
        """Error of a formation edge's distance or offset: (...), metres, at least 0."""
        return edge_error(self.xp, edge, self.place(edge.first), self.place(edge.second))

    def level(self, resource: Resource) -> Array:
        """Level of a resource of the evaluated agents: (...), in the resource's unit."""
        raise ValueError("no steps before are seen here")

    def flagged(self, flag: Flag) -> Array:
        """Margin of a flag of the evaluated agents: (...), metres."""
        raise ValueError("no steps before are seen here")

    def heading(self) -> Array:
        """Headings of the evaluated agents: (...), rad; numpy arrays."""
        raise ValueError("no heading is seen here")

    def facing(self, towards: float | Beacon, within: float) -> Array:
        """Margin of the evaluated agents' headings towards a direction, rad, or a beacon, metres: (...).

        Args:
            within: largest allowed angle, rad.
        """
        from missionc.ir.language.margins import headings  # loads numpy, which no other function here needs

        if not isinstance(towards, Beacon):
            return headings.of_direction(self.heading(), towards, within)
        x, y = (towards.position[axis] - self.coordinate(axis) for axis in (0, 1))
        return headings.of_place(self.heading(), x, y, within)

    def nothing(self, *, of_team: bool = False) -> Array:
        """Zeros of the shape (...) of a result for the evaluated agents, or for the team."""
        return 0.0 * (self.place(0) if of_team else self.own())[..., 0]

    def larger(self, one: Array, other: Array) -> Array:
        """Elementwise maximum of two arrays (...) of the same unit."""
        return self.xp.maximum(one, other)
