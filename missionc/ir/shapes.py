"""Shapes of regions as plain numbers; as sets of points they are in ``world.signed_distance``."""

from __future__ import annotations

from typing import TypeAlias

from missionc.base.late_dataclass import dataclass

Vector: TypeAlias = tuple[float, ...]
"""Two or three coordinates in metres, as many as the world has."""

# Plain numbers; what they mean as sets of points is ``world.signed_distance``.


@dataclass(frozen=True, slots=True)
class Prism:
    """The height band a plane shape has in a volume; absent in a plane mission."""

    low: float
    high: float


@dataclass(frozen=True, slots=True)
class Box:
    """Axis-aligned, over all coordinates of the world."""

    low: Vector
    high: Vector


@dataclass(frozen=True, slots=True)
class Disc:
    """A disc in the plane (``centre`` has two coordinates); a standing cylinder where ``band`` is given."""

    centre: Vector
    radius: float
    band: Prism | None = None


@dataclass(frozen=True, slots=True)
class Ball:
    centre: Vector
    radius: float


@dataclass(frozen=True, slots=True)
class Polygon:
    """A simple polygon in the plane, corners in order (either way round); a prism where ``band`` is given."""

    corners: tuple[tuple[float, float], ...]
    band: Prism | None = None


@dataclass(frozen=True, slots=True)
class Union:
    left: Shape
    right: Shape


@dataclass(frozen=True, slots=True)
class Intersection:
    left: Shape
    right: Shape


@dataclass(frozen=True, slots=True)
class Difference:
    left: Shape
    right: Shape


Shape: TypeAlias = "Box | Disc | Ball | Polygon | Union | Intersection | Difference"
