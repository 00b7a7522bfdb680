"""Couplings between agents: communication graphs and formations.

Link ranges and link weights by ordered pairs of agents, and derived properties of a graph.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterator
from dataclasses import replace
from itertools import product
from typing import TypeAlias

from missionc.base.late_dataclass import Record
from missionc.base.source import Span
from missionc.base.units import Metres
from missionc.ir.places import Shape, Vector


class PairRange(Record):
    """Communication range, metres, of the links from each agent of one set to each agent of another."""

    senders: frozenset[int]
    receivers: frozenset[int]
    radius: Metres


class PairWeight(Record):
    """Weight of the links from each agent of one set to each agent of another, at least 1."""

    senders: frozenset[int]
    receivers: frozenset[int]
    weight: int


class Weight(Record):
    """Weights of links, at least 1: ``others`` for all links except those in ``pairs``; each link is in at most one of
    ``pairs``."""

    name: str
    others: int
    pairs: tuple[PairWeight, ...]


class Proximity(Record, eq=False):
    """Communication graph that links two agents closer than the range of their pair ([strel], ε-proximity graph)."""

    by_distance = True

    name: str
    radius: Metres
    agents: tuple[int, ...]
    span: Span
    ranges: tuple[PairRange, ...] = ()
    weights: tuple[Weight, ...] = ()

    @property
    def rule(self) -> Hashable:
        return type(self), self.radius, self.ranges


class BeaconCover(Record, eq=False):
    """Communication graph that links two agents if both are closer than ``radius`` to one beacon ([strel],
    ε-connectivity)."""

    by_distance = False
    ranges = ()
    name: str
    radius: Metres
    beacons: tuple[Vector, ...]
    agents: tuple[int, ...]
    span: Span
    weights: tuple[Weight, ...] = ()

    @property
    def rule(self) -> Hashable:
        return type(self), self.radius, self.beacons


class Sight(Record, eq=False):
    """Proximity graph whose links also need a line of sight with a clearance of more than ``room`` metres from
    ``shapes``."""

    by_distance = True
    name: str
    radius: Metres
    shapes: tuple[Shape, ...]
    agents: tuple[int, ...]
    span: Span
    room: Metres = Metres(0.0)
    ranges: tuple[PairRange, ...] = ()
    weights: tuple[Weight, ...] = ()

    @property
    def rule(self) -> Hashable:
        return type(self), self.radius, self.ranges, self.shapes, self.room


Graph: TypeAlias = Proximity | BeaconCover | Sight
"""Communication graph of agents. ``radius`` is the range of links, metres, except for pairs in ``ranges``; each pair is
in at most one of ``ranges``. ``by_distance`` is true if no link is longer than the range of its pair. ``rule`` is the
condition for a link between two agents; it does not depend on other agents."""


class FormationEdge(Record):
    """Edge of a formation between two agents (mission indices): the required distance, or the offset ``second -
    first``; metres."""

    first: int
    second: int
    target: float | Vector


class Formation(Record, eq=False):
    """Formation of agents: the absolute error of each edge, or with ``total`` the sum of the errors, is at most the
    tolerance.

    Source:
        [clot] III-C, F_form.
    """

    name: str
    kind: str
    agents: tuple[int, ...]
    edges: tuple[FormationEdge, ...]
    tolerance: Metres
    total: bool
    span: Span


def range_of(graph: Graph, sender: int, receiver: int) -> Metres:
    """Communication range of the link from ``sender`` to ``receiver`` (different agents), metres."""
    for each in graph.ranges:
        if sender in each.senders and receiver in each.receivers:
            return each.radius
    return graph.radius


def kinds(graph: Graph) -> tuple[tuple[int, ...], ...]:
    """Groups of a graph's agents with equal link ranges, in both directions and within the group."""
    return _alike(graph, graph.ranges)


def weigh(weight: Weight, sender: int, receiver: int) -> int:
    """Weight of the link from ``sender`` to ``receiver``."""
    for each in weight.pairs:
        if sender in each.senders and receiver in each.receivers:
            return each.weight
    return weight.others


def kinds_of_weight(graph: Graph, weight: Weight) -> tuple[tuple[int, ...], ...]:
    """Groups of a graph's agents with equal link weights, in both directions and within the group."""
    return _alike(graph, weight.pairs)


def lightest(weight: Weight) -> int:
    """Least weight of any link."""
    return min((weight.others, *(each.weight for each in weight.pairs)))


def heaviest(weight: Weight) -> int:
    """Greatest weight of any link."""
    return max((weight.others, *(each.weight for each in weight.pairs)))


def _alike(graph: Graph, pairs: tuple[PairRange, ...] | tuple[PairWeight, ...]) -> tuple[tuple[int, ...], ...]:
    alike: dict[tuple[tuple[bool, bool], ...], list[int]] = {}
    for agent in graph.agents:
        sides = tuple((agent in each.senders, agent in each.receivers) for each in pairs)
        alike.setdefault(sides, []).append(agent)
    return tuple(map(tuple, alike.values()))


def directed(graph: Graph) -> bool:
    """Return true if some pair of agents has different link ranges in the two directions."""
    firsts = [kind[0] for kind in kinds(graph)] if graph.ranges else []
    return any(range_of(graph, one, other) != range_of(graph, other, one) for one, other in product(firsts, firsts))


def all_ranges(graph: Graph) -> tuple[Metres, ...]:
    """Distinct link ranges of the graph's pairs, metres, in descending order; empty for fewer than two agents."""
    return tuple(sorted(set(_of_pairs(graph)), reverse=True))


def between(graph: Graph, sender: int, receiver: int) -> Graph:
    """Graph in which all links have the range of this pair of agents."""
    if not graph.ranges:
        return graph
    return with_ranges(graph, range_of(graph, sender, receiver), ())


def with_ranges(graph: Graph, radius: Metres, ranges: tuple[PairRange, ...]) -> Graph:
    """Graph with another default range ``radius``, metres, and other pair ranges."""
    if isinstance(graph, Proximity | Sight):
        return replace(graph, radius=radius, ranges=ranges)
    return replace(graph, radius=radius)


def _of_pairs(graph: Graph) -> Iterator[Metres]:
    alike = kinds(graph)
    for one, other in product(alike, alike):
        if one is not other or len(one) > 1:
            yield range_of(graph, one[0], other[-1])
