"""Couplings between agents: graphs and formations."""

from __future__ import annotations

from typing import TypeAlias

from missionc.base.late_dataclass import dataclass
from missionc.base.source import Span
from missionc.base.units import Metres
from missionc.ir.shapes import Vector


@dataclass(frozen=True, slots=True, eq=False)
class Proximity:
    """An edge where two agents are strictly closer than ``radius``. [strel] ε-proximity graphs."""

    name: str
    radius: Metres
    agents: tuple[int, ...]
    span: Span


@dataclass(frozen=True, slots=True, eq=False)
class BeaconCover:
    """Two agents both strictly closer than ``radius`` to one beacon. [strel] ε-connectivity graphs."""

    name: str
    radius: Metres
    beacons: tuple[Vector, ...]
    agents: tuple[int, ...]
    span: Span


Graph: TypeAlias = Proximity | BeaconCover


@dataclass(frozen=True, slots=True)
class FormationEdge:
    """What two agents (by mission index) keep: their distance, or their offset ``second - first``."""

    first: int
    second: int
    target: float | Vector


@dataclass(frozen=True, slots=True, eq=False)
class Formation:
    """Each edge's absolute error is at most the tolerance; ``total``: their sum is. [clot] III-C, F_form."""

    name: str
    kind: str
    agents: tuple[int, ...]
    edges: tuple[FormationEdge, ...]
    tolerance: Metres
    total: bool
    span: Span
