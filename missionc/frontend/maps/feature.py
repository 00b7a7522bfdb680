"""Features: the contents of a file of places as numbers in metres, each with its place in the file."""

from __future__ import annotations

from typing import TypeAlias

from missionc.base.late_dataclass import Record
from missionc.base.source import Span

Corners: TypeAlias = tuple[tuple[float, float], ...]


class Area(Record):
    """Polygons without their holes: ``(outer, hole, …)`` of each, with corners in order in either direction."""

    polygons: tuple[tuple[Corners, ...], ...]


class Circle(Record):
    centre: tuple[float, float]
    radius: float


class MapPoint(Record):
    """Point with two or three coordinates."""

    position: tuple[float, ...]


class Feature(Record):
    """Feature; ``name`` is empty if the file gives none.

    ``height`` is its height band, if the file states it.
    """

    name: str
    shape: Area | Circle | MapPoint
    span: Span
    name_span: Span
    height: tuple[float, float] | None = None
