"""May labels: cells and pairs of cells in which a predicate may be true, and may be false.

The labels follow from the ranges of measured values, such as distances, over the agents' cells. The pairs of cells with
a possible line of sight past obstacles are computed likewise.

Relaxed formulas: consequences of the requirements about the positions of one or two agents.

    in   Kernel
    out  a weaker Kernel without links and routes

A link between two agents becomes a bound on their distance, and a route becomes a sequence of links between named
agents. Conditions on motion, earlier steps or more than two positions are dropped.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterator, Mapping
from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np

from missionc import ir
from missionc.backends.cover.bodies import bodies, must_be_apart
from missionc.backends.cover.cells import Cells
from missionc.backends.smt.encode.metric_bounds import without_metres
from missionc.backends.smt.roadmap.labels import Labels, Unexpressible
from missionc.backends.smt.roadmap.roadmap import Roadmap
from missionc.base.late_dataclass import dataclass
from missionc.base.trace import Array, Flags
from missionc.geometry.distance_ranges import Range, larger, length_range, outward, signed_distance_range
from missionc.ir import (
    Beacon,
    Box,
    Compare,
    Feature,
    Flag,
    FormationEdge,
    Graph,
    Mission,
    Predicate,
    Region,
    Resource,
    Sight,
)
from missionc.ir.couplings import all_ranges, range_of
from missionc.ir.kernel import nodes as k
from missionc.ir.kernel.normal_form import YES
from missionc.ir.kernel.walk import bottom_up, rebuilt

INSIDE = 1e-5
"""Depth inside a body, metres, from which the body blocks a line of sight."""


@dataclass(frozen=True, slots=True)
class SightLink(Compare):
    """Comparison that bounds the distance of two agents which see each other on a graph."""

    terms: tuple[tuple[float, Feature], ...]
    constant: float
    strict: bool
    sight: Sight


def hidden(graph: Sight, one: Cells, other: Cells) -> Flags:
    """Return true for each pair of cells without any line of sight: (cells of one, cells of the other)."""
    found: Flags = np.zeros((len(one), len(other)), dtype=np.bool_)
    for body in (body for shape in graph.shapes for body in bodies(shape)):
        if isinstance(body, Box):
            for axis, (low, high) in enumerate(zip(body.low, body.high, strict=True)):
                for at in (low + INSIDE, (low + high) / 2, high - INSIDE):
                    found |= _hides(body, axis, at, one, other) | _hides(body, axis, at, other, one).T
    return found


def _hides(body: Box, axis: int, at: float, one: Cells, other: Cells) -> Flags:
    """Return true for each pair of cells whose connecting lines all cross a plane within a body: (cells of one, cells
    of the other)."""
    hides: Flags = (one.high[:, None, axis] < at) & (other.low[None, :, axis] > at)
    least, most = (_share(at - one_end, other_end - at) for one_end, other_end in _ends(axis, one, other))
    for across in range(len(body.low)):
        if across != axis:
            low = np.minimum(*(_between(one.low, other.low, across, share) for share in (least, most)))
            high = np.maximum(*(_between(one.high, other.high, across, share) for share in (least, most)))
            hides &= (low > body.low[across] + INSIDE) & (high < body.high[across] - INSIDE)
    return hides


def _ends(axis: int, one: Cells, other: Cells) -> tuple[tuple[Array, Array], tuple[Array, Array]]:
    """Cell corners for which a line crosses the plane at its least and at its greatest fraction: (cells,) arrays,
    metres."""
    return (
        (one.high[:, None, axis], other.high[None, :, axis]),
        (one.low[:, None, axis], other.low[None, :, axis]),
    )


def _share(before: Array, after: Array) -> Array:
    """Fraction of a line before a plane, (...), from the distances of its ends to the plane; arbitrary without a
    crossing."""
    whole = before + after
    return np.clip(np.divide(before, whole, out=np.zeros_like(whole), where=whole > 0), 0.0, 1.0)


def _between(first: Array, second: Array, axis: int, share: Array) -> Array:
    return (1 - share) * first[:, None, axis] + share * second[None, :, axis]


Boxes = tuple[Array, Array]
"""Lowest and highest corners of boxes, (..., dim) each, metres."""


def margin_range(
    predicate: Predicate, mission: Mission, places: Mapping[int, Boxes], speed: Range | None = None
) -> Range:
    """Range of a predicate's margin for the first of some agents, each at any point of its boxes: (...).

    Args:
        places: boxes of each agent, (..., dim), metres.
        speed: speed of the first agent, m/s, if known.

    Raises:
        ValueError: the predicate depends on another agent, or on more than positions.
    """
    margin: Range = predicate.margin(_CellView(mission, places, speed))
    return margin


class _CellView:
    """View of a few agents in cells, evaluated for the first; other agents are unknown."""

    def __init__(self, mission: Mission, places: Mapping[int, Boxes], speed: Range | None) -> None:
        self.known_speed = speed
        self.mission, self.dimension, self.places = mission, mission.dimension, places
        self.agent = mission.agents[next(iter(places))]

    def place(self, agent: int | None) -> Boxes:
        agent = self.agent.index if agent is None else agent
        if agent not in self.places:
            raise ValueError("the cells of these agents do not decide the predicate")
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

    def of_place(self, value: Callable[[Any, Array], Array]) -> Range:
        """Range of a 1-Lipschitz function over boxes, (..., dim), metres, from its value at their centres: (...)."""
        low, high = self.place(None)
        middle, reach = np.asarray(value(np, (low + high) / 2)), np.linalg.norm(high - low, axis=-1) / 2
        return outward(middle - reach, middle + reach)

    def apart(self, first: int | None, second: int) -> Range:
        """Range of the distance of two agents; different agents have at least their required separation."""
        distance = length_range(self._between(first, second))
        first = self.agent.index if first is None else first
        if first == second:
            return distance
        needed = must_be_apart(self.mission, first, second)
        return Range(np.maximum(distance.low, needed), np.maximum(distance.high, needed))

    def formation_error(self, edge: FormationEdge) -> Range:
        between = self._between(edge.first, edge.second)
        if not isinstance(edge.target, tuple):
            return (length_range(between) - edge.target).magnitude()
        return length_range([each - offset for each, offset in zip(between, edge.target, strict=True)])

    def _between(self, first: int | None, second: int) -> list[Range]:
        """Ranges of the second agent's coordinates relative to the first agent, metres."""
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
            raise ValueError("the cover represents no speeds")
        return self.known_speed

    def least_in_motion(self, margin: Callable[[Any], Array]) -> Range:
        raise ValueError("the cover represents no motions")

    def weakest_link(self, graph: Graph) -> Range:
        raise ValueError("the cover represents no connectivity")

    def level(self, resource: Resource) -> Range:
        raise ValueError("the cover represents no earlier steps")

    def flagged(self, flag: Flag) -> Range:
        raise ValueError("the cover represents no earlier steps")

    def facing(self, towards: float | Beacon, within: float) -> Range:
        raise ValueError("the cover represents no headings")


BORDER = 1e-5
"""Margin, metres, within which a predicate counts both as possibly true and as possibly false."""


class MayLabels(Labels):
    """Labels of cells; a predicate and its negation may both be possible in one cell.

    Args:
        cells: cells of each roadmap's states.
    """

    def __init__(self, mission: Mission, roadmaps: tuple[Roadmap, ...], cells: tuple[Cells, ...]) -> None:
        super().__init__(mission, roadmaps)
        self.cells = cells
        self._ranges: dict[Hashable, Range] = {}
        self._blind: dict[Hashable, Flags] = {}

    def of_places(self, predicate: Predicate) -> bool:
        """Return False, since in one cell a predicate may be true at one position and false at another."""
        return False

    def moves(self, predicate: Predicate, number: int, holds: bool, *, at_end: bool) -> Flags:
        """Return true for each move in whose first cell (``at_end``: last) the predicate may be true, or if not
        ``holds``, false: (moves,)."""
        key = predicate, number, at_end
        if key not in self._ranges:
            cells, (source, target) = self.cells[number], self.roadmaps[number].moves.T
            where = target if at_end else source
            agent = self.roadmaps[number].agents[0]
            way = cells.distance
            speed = Range(way.low[source, target], way.high[source, target]) / self.mission.step
            box = cells.low[where], cells.high[where]
            self._ranges[key] = margin_range(predicate, self.mission, {agent: box}, speed)
        return _may(self._ranges[key], holds, (len(self.roadmaps[number].moves),))

    def states_where(self, predicate: Predicate, number: int, truth: bool) -> Flags:
        """Return true for each cell in which the predicate may have this truth: (cells,)."""
        cells = self.cells[number]
        key = predicate, number
        if key not in self._ranges:
            agent = self.roadmaps[number].agents[0]
            self._ranges[key] = margin_range(predicate, self.mission, {agent: (cells.low, cells.high)})
        return _may(self._ranges[key], truth, (len(cells),))

    def pairs_where(self, predicate: Predicate, agents: tuple[int, int], first: int, second: int, truth: bool) -> Flags:
        """Return true for each pair of cells in which the predicate may have this truth for the first agent: (cells,
        cells)."""
        key = predicate, agents, first, second
        one, other = self.cells[first], self.cells[second]
        if key not in self._ranges:
            here = one.low[:, None, :], one.high[:, None, :]
            there = other.low[None, :, :], other.high[None, :, :]
            try:
                self._ranges[key] = margin_range(predicate, self.mission, {agents[0]: here, agents[1]: there})
            except ValueError as error:
                raise Unexpressible(f"a comparison: {error}") from error
        may = _may(self._ranges[key], truth, (len(one), len(other)))
        if truth and isinstance(predicate, SightLink):
            return may & ~self._hidden(predicate.sight, first, second)
        return may

    def _hidden(self, graph: Sight, first: int, second: int) -> Flags:
        key = graph, first, second
        if key not in self._blind:
            self._blind[key] = hidden(graph, self.cells[first], self.cells[second])
        return self._blind[key]


def _may(margin: Range, truth: bool, shape: tuple[int, ...]) -> Flags:
    may = margin.high >= -BORDER if truth else margin.low <= BORDER
    return np.broadcast_to(may, shape)


MOST_PAIRS = 300
"""Maximum number of pairs of agents times links for which a route is expanded."""


def relaxed(mission: ir.Mission, kernel: k.Kernel) -> k.Kernel:
    """Kernel with weaker requirements, without links and routes, and mostly without conditions on motion and the
    past."""
    weaker = without_metres(kernel)
    speeds = mission.steps > 0 and not any(agent.dynamics.has_momentum for agent in mission.agents)
    required = replace(weaker, preferences=())
    made = bottom_up(required.formulas, lambda node, parts: _relaxed(node, parts, speeds=speeds))
    return required.with_formulas(made.__getitem__)


def _relaxed(node: k.Node, parts: tuple[k.Node, ...], *, speeds: bool) -> k.Node:
    match node:
        case k.Atom(predicate) if predicate.restricted is not None and not predicate.reads_past:
            return _connected(predicate.restricted)
        case k.Atom(predicate) | k.Not(k.Atom(predicate)) if not _of_places(predicate, speeds=speeds):
            return YES
        case k.PathLength() | k.Not(k.PathLength()) | k.RouteNode():
            return YES
        case k.NeighbourNode(graph):
            return _neighbour(graph, parts[0], node.every)
        case k.ReachNode(graph, hops=hops):
            through, end = parts
            return _route(graph, through, end, min(hops, max(len(graph.agents) - 1, 0)), node.every)
        case _:
            return rebuilt(node, parts) if parts else node


def _of_places(predicate: ir.Predicate, *, speeds: bool) -> bool:
    """Return true if positions decide the predicate: of at most two agents, or for a speed, of one agent at two
    steps."""
    if isinstance(predicate, ir.Flagged):
        return True
    if predicate.reads_past or predicate.reads_heading or predicate.graph is not None:
        return False
    if predicate.reads_speed:
        return speeds and not predicate.others
    return all(len(part.others) + (not part.about_team) <= 2 for part in predicate.parts)


def _neighbour(graph: ir.Graph, body: k.Node, every: bool) -> k.Node:
    """Relaxed ``Neighbour``: the body at some agent that may be linked; if ``every``, at each agent that must be
    linked."""
    inner, outer = (k.Any, k.All) if not every else (k.All, k.Any)
    cases: list[k.Node] = []
    for agent in graph.agents:
        here: k.Node = k.Is(frozenset((agent,)))
        beside = [
            outer((_linked(graph, agent, other, not every), k.At(other, body)))
            for other in graph.agents
            if other != agent
        ]
        cases.append(outer((k.Not(here) if every else here, inner(tuple(beside)))))
    return inner(tuple(cases))


def _linked(graph: ir.Graph, sender: int, receiver: int, holds: bool) -> k.Node:
    """Formula that a link from ``sender``, for which it is evaluated, to ``receiver`` may exist (``holds``) or may be
    absent."""
    match graph:
        case ir.BeaconCover(beacons=beacons):
            of_each, of_all = (k.All, k.Any) if holds else (k.Any, k.All)
            near = [near_beacon(graph, position, holds) for position in beacons]
            return of_all(tuple(of_each((here, k.At(receiver, here))) for here in near))
        case ir.Sight() if not holds:
            return YES
        case ir.Sight():
            return seen(graph, sender, receiver)
        case _:
            near_by = nearer(sender, receiver, float(range_of(graph, sender, receiver)))
            return near_by if holds else k.Not(near_by)


@lru_cache(maxsize=256)
def near_beacon(graph: ir.BeaconCover, position: ir.Vector, holds: bool) -> k.Node:
    near = k.Atom(
        ir.Compare(((-1.0, ir.DistanceTo(ir.Beacon(graph.name, position, graph.span))),), float(graph.radius), True)
    )
    return near if holds else k.Not(near)


@lru_cache(maxsize=4096)
def seen(graph: ir.Sight, sender: int, receiver: int) -> k.Atom:
    first, second = sorted((sender, receiver))
    reach = float(range_of(graph, sender, receiver))
    return k.Atom(SightLink(((-1.0, ir.DistanceBetween(first, second)),), reach, True, graph))


@lru_cache(maxsize=4096)
def nearer(one: int, other: int, metres: float) -> k.Atom:
    first, second = sorted((one, other))
    return k.Atom(ir.Compare(((-1.0, ir.DistanceBetween(first, second)),), metres, True))


def _route(graph: ir.Graph, through: k.Node, end: k.Node, hops: int, every: bool) -> k.Node:
    """Relaxed ``Reach``: some possible route of at most ``hops`` links; if ``every``, each certain route.

    Source:
        [strel] Definition 5, unrolled.
    """
    if hops * len(graph.agents) ** 2 > MOST_PAIRS:
        return end if every else _within(graph, end, hops)
    both, either = (k.All, k.Any) if not every else (k.Any, k.All)
    made = end
    for _ in range(hops):
        made = either((end, both((through, _neighbour(graph, made, every)))))
    return made if every or hops < 2 else k.All((made, _within(graph, end, hops)))


def _within(graph: ir.Graph, end: k.Node, hops: int) -> k.Node:
    """Formula that some agent within ``hops`` times the longest link range satisfies ``end``."""
    if isinstance(graph, ir.BeaconCover):
        return YES
    reach = hops * float(max(all_ranges(graph), default=0.0))
    cases = []
    for agent in graph.agents:
        near = [nearer(agent, other, reach) if other != agent else YES for other in graph.agents]
        ends = tuple(k.All((k.At(other, end), there)) for other, there in zip(graph.agents, near, strict=True))
        cases.append(k.All((k.Is(frozenset((agent,))), k.Any(ends))))
    outside = k.Not(k.Is(frozenset(graph.agents)))
    return k.Any((*cases, k.All((outside, end))))


def _connected(graph: ir.Graph) -> k.Node:
    """Formula that there are routes from the first agent to all others."""
    first, *others = graph.agents
    return k.All(tuple(k.At(first, route) for route in _to_each(graph, others)))


def _to_each(graph: ir.Graph, others: list[int]) -> Iterator[k.Node]:
    for other in others:
        yield _route(graph, YES, k.Is(frozenset((other,))), len(graph.agents) - 1, False)
