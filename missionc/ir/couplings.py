"""Couplings between agents: communication graphs and formations."""

from __future__ import annotations

from collections.abc import Hashable
from typing import TypeAlias

from missionc.base.late_dataclass import Record
from missionc.base.source import Span
from missionc.base.units import Metres
from missionc.ir.shapes import Shape, Vector


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
