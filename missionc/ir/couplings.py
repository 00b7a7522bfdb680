"""Couplings between agents: graphs and formations."""

from __future__ import annotations

from collections.abc import Hashable
from typing import TypeAlias

from missionc.base.late_dataclass import Record
from missionc.base.source import Span
from missionc.base.units import Metres
from missionc.ir.shapes import Shape, Vector


class PairRange(Record):
    """Range of the links from each agent of one set to each agent of another."""

    senders: frozenset[int]
    receivers: frozenset[int]
    radius: Metres


class PairWeight(Record):
    """Weight of the links from each agent of one set to each agent of another."""

    senders: frozenset[int]
    receivers: frozenset[int]
    weight: int


class Weight(Record):
    """Weights of links, at least 1: ``pairs`` lists exceptions, each link in at most one.

    ``others`` is the rest.
    """

    name: str
    others: int
    pairs: tuple[PairWeight, ...]


class Proximity(Record, eq=False):
    """Graph with an edge if two agents are strictly closer than the range of their pair: [strel] ε-proximity graph."""

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
    """Graph with an edge if two agents are strictly closer than ``radius`` to one beacon: [strel] ε-connectivity."""

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
    """Proximity graph whose links also need a line of sight more than ``room`` clear of ``shapes``."""

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
"""A communication graph. ``by_distance``: a link is never longer than the range of its pair. This range is ``radius``
for pairs in none of the ``ranges``; each pair is in at most one of them. ``rule``: the condition for a link between two
agents, independent of other agents."""


class FormationEdge(Record):
    """Edge of a formation between two agents (mission indices): a required distance or offset ``second - first``."""

    first: int
    second: int
    target: float | Vector


class Formation(Record, eq=False):
    """Formation: each edge's absolute error, or with ``total`` their sum, is at most the tolerance.

    [clot] III-C, F_form.
    """

    name: str
    kind: str
    agents: tuple[int, ...]
    edges: tuple[FormationEdge, ...]
    tolerance: Metres
    total: bool
    span: Span
