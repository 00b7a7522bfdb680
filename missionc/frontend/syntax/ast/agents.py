"""Syntax tree of agents: dynamics, starts, finishes and other settings."""

from __future__ import annotations

from typing import TypeAlias

from missionc.base.late_dataclass import dataclass
from missionc.base.source import Span
from missionc.frontend.syntax.ast.quantities import File, Name, Point, Quantity


@dataclass(frozen=True, slots=True)
class Setting:
    """``speed <= 2 m/s``, ``speed 1..2 m/s``, ``turn <= 90 deg/s``, ``nodes = 110``, ``tolerance 0.1 m``.

    ``relation`` is ``<=``, ``=``, ``..`` or empty (a bare value after the word);
    ``low`` is given only for a range.
    """

    span: Span
    name: Name
    relation: str
    high: Quantity
    low: Quantity | None = None


@dataclass(frozen=True, slots=True)
class Dynamics:
    span: Span
    name: Name
    settings: tuple[Setting, ...]


@dataclass(frozen=True, slots=True)
class InRegion:
    span: Span
    region: Name


@dataclass(frozen=True, slots=True)
class AtPoints:
    span: Span
    points: tuple[Point, ...]


@dataclass(frozen=True, slots=True)
class OnLine:
    span: Span
    first: Point
    last: Point


@dataclass(frozen=True, slots=True)
class OnGrid:
    span: Span
    low: Point
    high: Point


@dataclass(frozen=True, slots=True)
class AtListed:
    """``from "starts.csv"``: a point for each agent, in the order of the file."""

    span: Span
    file: File


Places: TypeAlias = "InRegion | AtPoints | OnLine | OnGrid | AtListed"


@dataclass(frozen=True, slots=True)
class Start:
    span: Span
    places: Places


@dataclass(frozen=True, slots=True)
class Finish:
    span: Span
    places: Places


@dataclass(frozen=True, slots=True)
class Vehicle:
    """``vehicle crazyflie21 { speed <= 0.8 m/s }``; the settings take the place of the profile's own figures."""

    span: Span
    name: Name
    settings: tuple[Setting, ...]


@dataclass(frozen=True, slots=True)
class Pads:
    """``pads at (1, 1, 0), (2, 1, 0)``: where the agents of a team stand before they rise, and land."""

    span: Span
    places: Places


@dataclass(frozen=True, slots=True)
class Flight:
    """``flight { pads …  hover 1 m  rise <= 0.3 m/s }``; ``flight`` alone leaves all of it out."""

    span: Span
    items: tuple[Pads | Setting, ...]


@dataclass(frozen=True, slots=True)
class Yaw:
    """``yaw 90 deg``, or ``yaw along path`` where ``angle`` is None."""

    span: Span
    angle: Quantity | None


TeamItem: TypeAlias = "Dynamics | Start | Finish | Vehicle | Flight | Yaw | Setting"
"""In any order inside the braces; ``radius`` and ``altitude`` are settings."""
