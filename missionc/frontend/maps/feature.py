"""Features of a map file: shapes and points with coordinates in metres, each with its location in the file."""

from __future__ import annotations

from typing import TypeAlias

from missionc.base.late_dataclass import Record
from missionc.base.source import Span

Corners: TypeAlias = tuple[tuple[float, float], ...]


class Area(Record):
    """Area composed of polygons with holes: ``(outer, hole, …)`` of each, with corners in order in either direction."""

    polygons: tuple[tuple[Corners, ...], ...]


class Circle(Record):
    centre: tuple[float, float]
    radius: float


class MapPoint(Record):
    """Point of a map file with two or three coordinates, metres."""

    position: tuple[float, ...]


class Feature(Record):
    """Shape or point of a map file; ``name`` is empty if the file gives none.

    ``height`` is its lowest and highest altitude in metres, if the file states them.
    """

    name: str
    shape: Area | Circle | MapPoint
    span: Span
    name_span: Span
    height: tuple[float, float] | None = None
