"""Shapes of regions as plain numbers; as sets of points they are in ``world.signed_distance``."""

from __future__ import annotations

from typing import TypeAlias

from missionc.base.late_dataclass import Record

Vector: TypeAlias = tuple[float, ...]
"""Two or three coordinates in metres, as many as the world has."""

# Plain numbers; what they mean as sets of points is ``world.signed_distance``.


class Prism(Record):
    """The height band a plane shape has in a volume; absent in a plane mission."""

    low: float
    high: float


class Box(Record):
    """Axis-aligned, over all coordinates of the world."""

    low: Vector
    high: Vector


class Disc(Record):
    """A disc in the plane (``centre`` has two coordinates); a standing cylinder where ``band`` is given."""

    centre: Vector
    radius: float
    band: Prism | None = None


class Ball(Record):
    centre: Vector
    radius: float


class Polygon(Record):
    """A simple polygon in the plane, corners in order (either way round); a prism where ``band`` is given."""

    corners: tuple[tuple[float, float], ...]
    band: Prism | None = None


class Union(Record):
    left: Shape
    right: Shape


class Intersection(Record):
    left: Shape
    right: Shape


class Difference(Record):
    left: Shape
    right: Shape


Shape: TypeAlias = "Box | Disc | Ball | Polygon | Union | Intersection | Difference"
