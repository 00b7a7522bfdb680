"""Syntax tree of shapes, and of their motion."""

from __future__ import annotations

from typing import TypeAlias

from missionc.base.late_dataclass import dataclass
from missionc.base.source import Span
from missionc.frontend.syntax.ast.quantities import File, Name, Point, Quantity


@dataclass(frozen=True, slots=True)
class Height:
    """``height a..b``"""

    span: Span
    low: Quantity
    high: Quantity


@dataclass(frozen=True, slots=True)
class Box:
    span: Span
    low: Point
    high: Point
    height: Height | None = None


@dataclass(frozen=True, slots=True)
class Disc:
    span: Span
    centre: Point
    radius: Quantity
    height: Height | None = None


@dataclass(frozen=True, slots=True)
class Ball:
    span: Span
    centre: Point
    radius: Quantity


@dataclass(frozen=True, slots=True)
class Cylinder:
    span: Span
    centre: Point
    radius: Quantity
    height: Height


@dataclass(frozen=True, slots=True)
class Polygon:
    span: Span
    corners: tuple[Point, ...]
    height: Height | None = None


@dataclass(frozen=True, slots=True)
class Combined:
    """``left op right`` with ``op`` one of ``+`` (union), ``*`` (intersection), ``-`` (difference)."""

    span: Span
    operator: str
    left: Shape
    right: Shape


Shape: TypeAlias = "Name | Box | Disc | Ball | Cylinder | Polygon | Combined"


@dataclass(frozen=True, slots=True)
class Moving:
    """``moving (2, 0) m/s``: constant velocity from time 0. ``unit`` is the one after the bracket."""

    span: Span
    velocity: Point
    unit: str | None = None
    unit_span: Span | None = None


@dataclass(frozen=True, slots=True)
class Waypoint:
    """``(4 s: 3, 0)``: the shape's offset at a time."""

    span: Span
    time: Quantity
    offset: tuple[Quantity, ...]


@dataclass(frozen=True, slots=True)
class Along:
    """``along (0 s: 0, 0), (4 s: 3, 0)``: offsets over time, straight in between, at rest before and after."""

    span: Span
    waypoints: tuple[Waypoint, ...]


@dataclass(frozen=True, slots=True)
class AlongFile:
    """``along from "route.csv"``: the waypoints are in the file."""

    span: Span
    file: File


Motion: TypeAlias = "Moving | Along | AlongFile"
