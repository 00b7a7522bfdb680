"""Features: what a file of places holds, as plain numbers in metres, each with its place in the file."""

from __future__ import annotations

from typing import TypeAlias

from missionc.base.late_dataclass import Record
from missionc.base.source import Span

Corners: TypeAlias = tuple[tuple[float, float], ...]


class Area(Record):
    """Polygons less their holes: ``(outer, hole, …)`` of each, corners in order, either way round."""

    polygons: tuple[tuple[Corners, ...], ...]


class Circle(Record):
    centre: tuple[float, float]
    radius: float


class MapPoint(Record):
    """A point, with two coordinates or three."""

    position: tuple[float, ...]


class Feature(Record):
    """``name`` is empty where the file gives none; ``height`` is the band that it stands in, if the file says it."""

    name: str
    shape: Area | Circle | MapPoint
    span: Span
    name_span: Span
    height: tuple[float, float] | None = None
