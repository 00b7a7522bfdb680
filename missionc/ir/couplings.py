"""Couplings between agents: graphs and formations."""

from __future__ import annotations

from collections.abc import Hashable
from typing import TypeAlias

from missionc.base.late_dataclass import Record
from missionc.base.source import Span
from missionc.base.units import Metres
from missionc.ir.shapes import Shape, Vector


class PairRange(Record):
    """The range of the links from each of some agents to each of some others."""

    senders: frozenset[int]
    receivers: frozenset[int]
    radius: Metres


class PairWeight(Record):
    """What the links from each of some agents to each of some others weigh."""

    senders: frozenset[int]
    receivers: frozenset[int]
    weight: int


class Weight(Record):
    """What links weigh, at least 1: those of ``pairs``, each in one of them at most, and ``others``."""

    name: str
    others: int
    pairs: tuple[PairWeight, ...]


class Proximity(Record, eq=False):
    """An edge where two agents are strictly closer than the range of their pair. [strel] ε-proximity graphs."""

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
    """Two agents both strictly closer than ``radius`` to one beacon. [strel] ε-connectivity graphs."""

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
    """Two agents strictly closer than the range of their pair, their line more than ``room`` clear of ``shapes``."""

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
"""``by_distance``: a link is never longer than the range of its pair, which is the ``radius`` of all whose pair is in
none of the ``ranges``; each is in one of them at most. ``rule``: what links two, whoever else is on the graph."""


class FormationEdge(Record):
    """What two agents (by mission index) keep: their distance, or their offset ``second - first``."""

    first: int
    second: int
    target: float | Vector


class Formation(Record, eq=False):
    """Each edge's absolute error is at most the tolerance; ``total``: their sum is. [clot] III-C, F_form."""

    name: str
    kind: str
    agents: tuple[int, ...]
    edges: tuple[FormationEdge, ...]
    tolerance: Metres
    total: bool
    span: Span
