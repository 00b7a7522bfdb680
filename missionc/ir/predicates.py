"""Predicates: atomic propositions about an agent, or about the team, at one step."""

from __future__ import annotations

from typing import TypeAlias

from missionc.base.late_dataclass import dataclass
from missionc.ir.couplings import Formation, Graph
from missionc.ir.places import Beacon, Region


class PredicateFacts:
    """What is asked of a predicate whichever it is; a kind says otherwise where it differs."""

    __slots__ = ()

    @property
    def about_team(self) -> bool:
        """Whether it has one truth at a step, whichever agent it is asked of."""
        return False

    @property
    def reads_speed(self) -> bool:
        return False

    @property
    def open_border(self) -> bool:
        """Whether it is false where its margin is exactly 0."""
        return False


@dataclass(frozen=True, slots=True)
class Inside(PredicateFacts):
    """The agent's centre is in the region (``body`` False), or its whole body is."""

    region: Region
    body: bool


@dataclass(frozen=True, slots=True)
class Touches(PredicateFacts):
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
class Compare(PredicateFacts):
    """``constant + sum(weight * feature) >= 0``, or ``> 0`` where ``strict``."""

    terms: tuple[tuple[float, Feature], ...]
    constant: float
    strict: bool

    @property
    def about_team(self) -> bool:
        """Whether it reads the distances of named pairs alone."""
        return bool(self.terms) and all(isinstance(feature, DistanceBetween) for _, feature in self.terms)

    @property
    def reads_speed(self) -> bool:
        return any(isinstance(feature, Speed) for _, feature in self.terms)

    @property
    def open_border(self) -> bool:
        return self.strict


@dataclass(frozen=True, slots=True)
class Connected(PredicateFacts):
    """The graph, over these of its agents, is connected."""

    graph: Graph
    agents: tuple[int, ...]

    @property
    def about_team(self) -> bool:
        return True

    @property
    def open_border(self) -> bool:
        return True


@dataclass(frozen=True, slots=True)
class InFormation(PredicateFacts):
    formation: Formation

    @property
    def about_team(self) -> bool:
        return True


Predicate: TypeAlias = Inside | Touches | Compare | Connected | InFormation
