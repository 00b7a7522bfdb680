"""What can be true of an agent, or of the team, at one step."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

from missionc.ir.couplings import Formation, Graph
from missionc.ir.places import Beacon, Region


@dataclass(frozen=True, slots=True)
class Inside:
    """The agent's centre is in the region (``body`` False), or its whole body is."""

    region: Region
    body: bool


@dataclass(frozen=True, slots=True)
class Touches:
    """Some part of the agent's body is in the region."""

    region: Region


@dataclass(frozen=True, slots=True)
class Coordinate:
    axis: int


@dataclass(frozen=True, slots=True)
class Speed:
    """The speed at a step: of the motion that starts there (of the last motion, at the last step)."""


@dataclass(frozen=True, slots=True)
class Altitude:
    """The third coordinate in a volume; the team's ``altitude`` in a plane."""


@dataclass(frozen=True, slots=True)
class DistanceTo:
    """From the agent's centre to a region's border (negative inside), to a beacon, or to another agent's centre."""

    target: Region | Beacon | int


@dataclass(frozen=True, slots=True)
class DistanceBetween:
    first: int
    second: int


Feature: TypeAlias = Coordinate | Speed | Altitude | DistanceTo | DistanceBetween


@dataclass(frozen=True, slots=True)
class Compare:
    """``constant + sum(weight * feature) >= 0``, or ``> 0`` where ``strict``."""

    terms: tuple[tuple[float, Feature], ...]
    constant: float
    strict: bool


@dataclass(frozen=True, slots=True)
class Connected:
    """The graph, over these of its agents, is connected."""

    graph: Graph
    agents: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class InFormation:
    formation: Formation


Predicate: TypeAlias = Inside | Touches | Compare | Connected | InFormation
