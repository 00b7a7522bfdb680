"""Shapes of regions as plain numbers; ``ir.distances.signed_distance`` defines them as sets of points."""

from __future__ import annotations

from typing import TypeAlias

from missionc.base.late_dataclass import Record

Vector: TypeAlias = tuple[float, ...]
"""Two or three coordinates in metres, according to the world's dimension."""

# Plain numbers; ``world.signed_distance`` defines them as sets of points.


class Prism(Record):
    """Height range of a plane shape in a volume, metres; absent in a plane mission."""

    low: float
    high: float


class Box(Record):
    """Axis-aligned box between two corners, over all coordinates of the world, metres."""

    low: Vector
    high: Vector


class Disc(Record):
    """Disc in the plane (``centre`` has two coordinates), or with a ``band`` an upright cylinder; metres."""

    centre: Vector
    radius: float
    band: Prism | None = None


class Ball(Record):
    centre: Vector
    radius: float


class Polygon(Record):
    """Simple polygon in the plane, corners in order (either orientation), or with a ``band`` a prism; metres."""

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
