"""View of agents from the cells they are in: the ranges of what predicates measure."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from missionc.backends.cover.bodies import must_be_apart
from missionc.base.trace import Array
from missionc.ir import Beacon, Flag, FormationEdge, Graph, Mission, Predicate, Region, Resource
from missionc.world.distance_ranges import Range, larger, length_range, signed_distance_range

Boxes = tuple[Array, Array]
"""The lowest and the highest corners of boxes, (..., dim) each, metres."""


def margin_range(
    predicate: Predicate, mission: Mission, places: Mapping[int, Boxes], speed: Range | None = None
) -> Range:
    """The margins that a predicate may have of the first of some agents that are anywhere in boxes: (...).

    Args:
        speed: of the first of them, m/s, where that is known.

    Raises:
        ValueError: it is about another agent, or about more than where agents are.
    """
    margin: Range = predicate.margin(_CellView(mission, places, speed))
    return margin


class _CellView:
    """Measures of the first of a few agents; nothing is known of any other."""

    def __init__(self, mission: Mission, places: Mapping[int, Boxes], speed: Range | None) -> None:
        self.known_speed = speed
        self.mission, self.dimension, self.places = mission, mission.dimension, places
        self.agent = mission.agents[next(iter(places))]

    def place(self, agent: int | None) -> Boxes:
        agent = self.agent.index if agent is None else agent
        if agent not in self.places:
            raise ValueError("where these agents are does not decide it")
        return self.places[agent]

    def radius(self) -> float:
        return self.agent.radius

    def coordinate(self, axis: int) -> Range:
        low, high = self.place(None)
        return Range(low[..., axis], high[..., axis])

    def altitude(self) -> Range:
        return self.coordinate(2) if self.dimension == 3 else self.nothing() + self.agent.altitude

    def outside(self, region: Region) -> Range:
        return signed_distance_range(region.shape, *self.place(None))

    def to_beacon(self, beacon: Beacon) -> Range:
        return length_range([self.coordinate(axis) - beacon.position[axis] for axis in range(self.dimension)])

    def apart(self, first: int | None, second: int) -> Range:
        """How far two agents are apart: different ones never less than their bodies need."""
        distance = length_range(self._between(first, second))
        first = self.agent.index if first is None else first
        if first == second:
            return distance
        needed = must_be_apart(self.mission, first, second)
        return Range(np.maximum(distance.low, needed), np.maximum(distance.high, needed))

    def amiss(self, edge: FormationEdge) -> Range:
        between = self._between(edge.first, edge.second)
        if not isinstance(edge.target, tuple):
            return (length_range(between) - edge.target).magnitude()
        return length_range([each - offset for each, offset in zip(between, edge.target, strict=True)])

    def _between(self, first: int | None, second: int) -> list[Range]:
        """The coordinates of the second from the first."""
        (low, high), (other_low, other_high) = self.place(first), self.place(second)
        axes = range(self.dimension)
        return [Range(other_low[..., each] - high[..., each], other_high[..., each] - low[..., each]) for each in axes]

    def nothing(self, *, of_team: bool = False) -> Range:
        low, _ = self.place(None)
        zero = np.zeros(low.shape[:-1])
        return Range(zero, zero)

    def larger(self, one: Range, other: Range) -> Range:
        return larger(one, other)

    def speed(self) -> Range:
        if self.known_speed is None:
            raise ValueError("no speed is seen here")
        return self.known_speed

    def weakest_link(self, graph: Graph) -> Range:
        raise ValueError("no connected graph is seen here")

    def level(self, resource: Resource) -> Range:
        raise ValueError("no steps before are seen here")

    def flagged(self, flag: Flag) -> Range:
        raise ValueError("no steps before are seen here")

    def facing(self, towards: float | Beacon, within: float) -> Range:
        raise ValueError("no heading is seen here")
