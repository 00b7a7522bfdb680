"""Borders: where something begins to hold, or stops; cells are cut there.

in   Mission, its relaxed kernel, a kind of agent
out  Borders, each a little beyond the place itself, so that the cells beyond are surely on its other side
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from missionc.backends.cover.bodies import SLACK, bodies
from missionc.base.trace import Array
from missionc.ir import (
    Agent,
    Altitude,
    Anywhere,
    Ball,
    Beacon,
    Box,
    Compare,
    Coordinate,
    Difference,
    Disc,
    DistanceTo,
    Flagged,
    Inside,
    Intersection,
    Mission,
    Polygon,
    Predicate,
    Region,
    Shape,
    Touches,
    Union,
)
from missionc.kernel.nodes import Atom, Kernel, Not
from missionc.kernel.walk import postorder
from missionc.world.distance_ranges import signed_distance_range

BEYOND = 3e-5
"""Metres from a place where a predicate changes to the cut: more than a predicate may be wrong by."""


@dataclass(frozen=True, slots=True)
class Border:
    """All places so many metres outside of a shape; inside, where ``away`` is negative."""

    shape: Shape
    away: float

    def crosses(self, low: Array, high: Array) -> bool:
        """Whether the places of a box, (dim,) corners, are on both its sides."""
        distance = signed_distance_range(self.shape, low, high)
        return bool(distance.low < self.away - BEYOND / 10 and distance.high > self.away + BEYOND / 10)

    def edges(self, axis: int) -> Iterator[float]:
        """Where it runs across an axis."""
        yield from _edges(self.shape, self.away, axis)

    def box(self, low: Array, high: Array) -> tuple[Array, Array]:
        """A box around it within another, (dim,) corners."""
        begin, end = low.copy(), high.copy()
        for axis in range(len(low)):
            edges = np.clip([*self.edges(axis)], low[axis], high[axis])
            if edges.size:
                begin[axis], end[axis] = edges.min(), edges.max()
        return begin, end


def borders_of_obstacles(mission: Mission, agent: Agent) -> tuple[Border, ...]:
    """Those beyond which there is no room beside a standing obstacle, each once."""
    away = agent.radius + mission.clearance - 2 * SLACK
    standing = (each.shape for each in mission.obstacles if each.constant)
    return tuple(dict.fromkeys(Border(body, away) for shape in standing for body in bodies(shape)))


def borders_asked(mission: Mission, kernel: Kernel, agent: Agent) -> tuple[Border, ...]:
    """Those of places where agents start and finish, and of what is asked, each once."""
    found: dict[Border, None] = {}
    for other in mission.agents:
        for place in (other.start, other.finish):
            if isinstance(place, Anywhere):
                found[Border(place.region.shape, BEYOND)] = None
    for node in postorder(goal.formula for goal in kernel.requirements):
        match node:
            case Not(Atom(predicate)):
                asked = _of_predicate(predicate, mission, agent)
                found.update((Border(shape, away - side * BEYOND), None) for shape, away, side in asked)
            case Atom(predicate):
                asked = _of_predicate(predicate, mission, agent)
                found.update((Border(shape, away + side * BEYOND), None) for shape, away, side in asked)
            case _:
                pass
    return tuple(found)


def _of_predicate(predicate: Predicate, mission: Mission, agent: Agent) -> Iterator[tuple[Shape, float, float]]:
    """Shapes, by how many metres they are to be grown, and 1 where it holds inside of that, -1 where outside."""
    match predicate:
        case Inside(region, body):
            yield region.shape, -agent.radius if body else 0.0, 1.0
        case Touches(region):
            yield region.shape, agent.radius, 1.0
        case Flagged(flag):
            yield flag.set_in.shape, 0.0, 1.0
            if flag.cleared_in is not None:
                yield flag.cleared_in.shape, 0.0, -1.0
        case Compare(((weight, feature),), constant) if weight:
            bound, side = -constant / weight, -math.copysign(1.0, weight)
            match feature:
                case Coordinate(axis):
                    yield _below(mission, axis, bound), 0.0, side
                case Altitude() if mission.dimension == 3:
                    yield _below(mission, 2, bound), 0.0, side
                case DistanceTo(Region(shape=shape)):
                    yield shape, bound, side
                case DistanceTo(Beacon(position=centre)):
                    yield Ball(centre, 0.0) if mission.dimension == 3 else Disc(centre, 0.0), bound, side
                case _:
                    pass
        case _:
            pass


def _below(mission: Mission, axis: int, bound: float) -> Box:
    """A box over all of the world where a coordinate is less than a bound."""
    low, high = mission.world.low, mission.world.high
    far = max(one - other for one, other in zip(high, low, strict=True)) + 1.0
    begin, end = [each - far for each in low], [each + far for each in high]
    begin[axis], end[axis] = min(low[axis], bound) - far, bound
    return Box(tuple(begin), tuple(end))


def _edges(shape: Shape, away: float, axis: int) -> Iterator[float]:
    match shape:
        case Box(low, high):
            yield low[axis] - away
            yield high[axis] + away
        case Polygon(corners) if axis < 2:
            ends = sorted({corner[axis] for corner in corners})
            yield from (each - away for each in ends)
            yield from (each + away for each in ends)
        case Disc(centre, radius) if axis < 2:
            yield centre[axis] - radius - away
            yield centre[axis] + radius + away
        case Ball(centre, radius):
            yield centre[axis] - radius - away
            yield centre[axis] + radius + away
        case Polygon(_, band) | Disc(_, _, band) if band is not None:
            yield band.low - away
            yield band.high + away
        case Union(left, right) | Intersection(left, right):
            yield from _edges(left, away, axis)
            yield from _edges(right, away, axis)
        case Difference(left, right):
            yield from _edges(left, away, axis)
            yield from _edges(right, -away, axis)
        case _:
            pass
