"""Cells: boxes that contain every possible position of an agent's centre, cut along borders.

    in   Mission, its relaxed kernel, a kind of agent
    out  Cells

The world is halved repeatedly. A box that a border crosses is halved before others, and along the border if the border
is parallel to an axis. A box is omitted only if the agent is clear of the obstacles at no position in it.

A border is a set of positions at which the truth of a predicate changes. Each cut is slightly beyond its border, so
that the cells beyond the cut are certainly on the other side.

Source:
    Latombe, "Robot Motion Planning", 1991, chapter 6: approximate cell decomposition.
"""

from __future__ import annotations

import heapq
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from missionc import ir
from missionc.backends.cover.bodies import SLACK, bodies, standing_room
from missionc.base.late_dataclass import Record
from missionc.base.trace import Array, Flags
from missionc.geometry.distance_ranges import Range, length_range, signed_distance_range
from missionc.ir.kernel.nodes import Atom, Kernel, Not
from missionc.ir.kernel.walk import postorder

BEYOND = 3e-5
"""Distance of a cut from its border, metres; it exceeds the tolerance of a predicate."""


class Border(Record):
    """Border of a predicate or obstacle: all points ``away`` metres outside of a shape (inside if negative)."""

    shape: ir.Shape
    away: float

    def crosses(self, low: Array, high: Array) -> bool:
        """Return true if a box, given by its corners (dim,), metres, has points on both sides of the border."""
        distance = signed_distance_range(self.shape, low, high)
        return bool(distance.low < self.away - BEYOND / 10 and distance.high > self.away + BEYOND / 10)

    def edges(self, axis: int) -> Iterator[float]:
        """Yield the coordinates of axis-parallel parts of the border along an axis, metres."""
        yield from _edges(self.shape, self.away, axis)

    def box(self, low: Array, high: Array) -> tuple[Array, Array]:
        """Bounding box of the border's axis-parallel parts within another box; corners (dim,), metres."""
        begin, end = low.copy(), high.copy()
        for axis in range(len(low)):
            edges = np.clip([*self.edges(axis)], low[axis], high[axis])
            if edges.size:
                begin[axis], end[axis] = edges.min(), edges.max()
        return begin, end


def borders_of_obstacles(mission: ir.Mission, agent: ir.Agent) -> tuple[Border, ...]:
    """Distinct borders of the positions at which an agent is too close to a static obstacle."""
    away = agent.radius + mission.clearance - 2 * SLACK
    standing = (each.shape for each in mission.obstacles if each.constant)
    return tuple(dict.fromkeys(Border(body, away) for shape in standing for body in bodies(shape)))


def borders_asked(mission: ir.Mission, kernel: Kernel, agent: ir.Agent) -> tuple[Border, ...]:
    """Distinct borders of start and finish regions, and of the predicates in requirements."""
    found: dict[Border, None] = {}
    for other in mission.agents:
        for place in other.ends:
            if place.region is not None:
                found[Border(place.shape, BEYOND)] = None
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


def _of_predicate(
    predicate: ir.Predicate, mission: ir.Mission, agent: ir.Agent
) -> Iterator[tuple[ir.Shape, float, float]]:
    """Shapes at whose borders a predicate changes its truth: shape, growth in metres, and 1 if true inside, -1 if true
    outside."""
    match predicate:
        case ir.Inside(region, body):
            yield region.shape, -agent.radius if body else 0.0, 1.0
        case ir.Touches(region):
            yield region.shape, agent.radius, 1.0
        case ir.Flagged(flag):
            yield flag.set_in.shape, 0.0, 1.0
            if flag.cleared_in is not None:
                yield flag.cleared_in.shape, 0.0, -1.0
        case ir.Compare(((weight, feature),), constant) if weight:
            bound, side = -constant / weight, -math.copysign(1.0, weight)
            match feature:
                case ir.Coordinate(axis):
                    yield _below(mission, axis, bound), 0.0, side
                case ir.Altitude() if mission.dimension == 3:
                    yield _below(mission, 2, bound), 0.0, side
                case ir.DistanceTo(ir.Region(shape=shape)):
                    yield shape, bound, side
                case ir.DistanceTo(ir.Beacon(position=centre)):
                    yield ir.Ball(centre, 0.0) if mission.dimension == 3 else ir.Disc(centre, 0.0), bound, side
                case _:
                    pass
        case _:
            pass


def _below(mission: ir.Mission, axis: int, bound: float) -> ir.Box:
    """Box that contains the part of the world with a coordinate below ``bound`` along an axis."""
    low, high = mission.world.low, mission.world.high
    far = max(one - other for one, other in zip(high, low, strict=True)) + 1.0
    begin, end = [each - far for each in low], [each + far for each in high]
    begin[axis], end[axis] = min(low[axis], bound) - far, bound
    return ir.Box(tuple(begin), tuple(end))


def _edges(shape: ir.Shape, away: float, axis: int) -> Iterator[float]:
    match shape:
        case ir.Box(low, high):
            yield low[axis] - away
            yield high[axis] + away
        case ir.Polygon(corners) if axis < 2:
            ends = sorted({corner[axis] for corner in corners})
            yield from (each - away for each in ends)
            yield from (each + away for each in ends)
        case ir.Disc(centre, radius) if axis < 2:
            yield centre[axis] - radius - away
            yield centre[axis] + radius + away
        case ir.Ball(centre, radius):
            yield centre[axis] - radius - away
            yield centre[axis] + radius + away
        case ir.Polygon(_, band) | ir.Disc(_, _, band) if band is not None:
            yield band.low - away
            yield band.high + away
        case ir.Union(left, right) | ir.Intersection(left, right):
            yield from _edges(left, away, axis)
            yield from _edges(right, away, axis)
        case ir.Difference(left, right):
            yield from _edges(left, away, axis)
            yield from _edges(right, -away, axis)
        case _:
            pass


CROSSED = 4.0
"""Factor on the length of a box that a border crosses, when the next box to halve is chosen."""

EDGE = 0.1
"""Least distance of a cut from the box's sides, as a fraction of the side length."""


@dataclass(frozen=True, eq=False)
class Cells:
    """Cells of a kind of agent: boxes with lowest and highest corners, (cells, dim) each, metres.

    The last ``points`` cells are single points: starts and finishes. ``left_out`` are the corners of the omitted boxes,
    (boxes, dim) each.
    """

    low: Array
    high: Array
    left_out: tuple[Array, Array]
    points: int = 0

    def __len__(self) -> int:
        return len(self.low)

    @property
    def middle(self) -> Array:
        """Centres of the cells: (cells, dim), metres."""
        return (self.low + self.high) / 2

    @cached_property
    def distance(self) -> Range:
        """Ranges of the distance between a point of one cell and a point of another: (cells, cells), metres."""
        return distance_range(self, self)

    @cached_property
    def touching(self) -> Flags:
        """Return true for each pair of cells with a common point: (cells, cells)."""
        return self.distance.low <= 0.0

    @cached_property
    def before(self) -> NDArray[np.int32]:
        """Predecessor of each cell on the shortest chain of touching cells from another cell: (cells, cells), cell
        indices.

        Chain lengths are measured between cell centres. The index is negative without a chain, and for the first cell
        of a chain.
        """
        ways = np.linalg.norm(self.middle[:, None] - self.middle[None], axis=-1) + SLACK
        return np.asarray(dijkstra(csr_array(np.where(self.touching, ways, 0.0)), return_predecessors=True)[1])


def distance_range(one: Cells, other: Cells) -> Range:
    """Ranges of the distance between points of two cells: (cells of one, cells of the other), metres."""
    return length_range(
        [
            Range(
                one.low[:, None, axis] - other.high[None, :, axis], one.high[:, None, axis] - other.low[None, :, axis]
            )
            for axis in range(one.low.shape[1])
        ]
    )


def cells_of(mission: ir.Mission, agent: ir.Agent, borders: Sequence[Border], count: int) -> Cells:
    """At most ``count`` cells that contain all possible positions of an agent's centre."""
    standing = [each for each in mission.obstacles if each.constant]
    heap: list[tuple[float, int, Array, Array, tuple[Border, ...]]] = []
    left_out: list[tuple[Array, Array]] = []
    number = 0

    def put(low: Array, high: Array, around: Sequence[Border]) -> None:
        nonlocal number
        if not all(bool(standing_room(each, agent, mission, 0, low, high)) for each in standing):
            left_out.append((low, high))
            return
        crossing = tuple(border for border in around if border.crosses(low, high))
        size = float((high - low).max()) * (CROSSED if crossing else 1.0)
        number += 1
        heapq.heappush(heap, (-size, number, low, high, crossing))

    put(np.array(mission.world.low) - SLACK, np.array(mission.world.high) + SLACK, borders)
    while heap and len(heap) < count:
        _, _, low, high, crossing = heapq.heappop(heap)
        axis, at = _cut(crossing, low, high)
        for begin, end in ((low[axis], at), (at, high[axis])):
            part_low, part_high = low.copy(), high.copy()
            part_low[axis], part_high[axis] = begin, end
            put(part_low, part_high, crossing)
    done = [(low, high) for _, _, low, high, _ in sorted(heap, key=lambda each: each[1])]
    return Cells(*_corners(done, mission.dimension), _corners(left_out, mission.dimension))


def _corners(boxes: list[tuple[Array, Array]], dimension: int) -> tuple[Array, Array]:
    """Lowest and highest corners of boxes as arrays, (boxes, dim) each, metres."""
    corners = np.array(boxes, dtype=np.float64).reshape(len(boxes), 2, dimension)
    return corners[:, 0], corners[:, 1]


def _cut(borders: Sequence[Border], low: Array, high: Array) -> tuple[int, float]:
    """Axis and coordinate, metres, at which a box (corners (dim,)) is cut: the border nearest to its centre, or its
    centre."""
    longest = int((high - low).argmax())
    best = (np.inf, longest, float((low + high)[longest] / 2))
    for axis in range(len(low)):
        side = float(high[axis] - low[axis])
        for at in (at for border in borders for at in border.edges(axis)):
            inside = min(at - low[axis], high[axis] - at) / side
            if inside > EDGE:
                # longer sides and cuts near the middle come first
                cost = (0.5 - inside) - side / float((high - low).max())
                best = min(best, (cost, axis, float(at)))
    return best[1], best[2]


def with_points(cells: Cells, points: Array) -> Cells:
    """Cells followed by single-point cells at ``points``, (points, dim), metres."""
    return Cells(np.concatenate([cells.low, points]), np.concatenate([cells.high, points]), cells.left_out, len(points))
