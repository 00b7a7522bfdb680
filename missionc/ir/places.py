"""Geometry of the world: its bounds, regions, obstacles and beacons.

Shapes of regions as plain numbers; ``ir.distances.signed_distance`` defines them as sets of points.

Place files as values: how a declaration reads a map file, and a summary of what the file contains.
"""

from __future__ import annotations

from typing import TypeAlias

from missionc.base.late_dataclass import Record
from missionc.base.limits import Limits
from missionc.base.source import Source, Span
from missionc.base.units import Seconds

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


Extents: TypeAlias = tuple[tuple[float, float], tuple[float, float]]
"""``(x, y)`` of the lower left and the upper right corner, metres."""


class FileRequest(Record):
    """Map file that a declaration names, with the settings for reading it.

    Args:
        kind: ``obstacle``, ``region`` or ``beacon``.
        sources: the file and the files that it refers to.
        span: source text of the file's name.
        at: position of the file's (0, 0), or of its ``origin``, in the world, metres.
        origin: reference longitude and latitude, degrees; None for plane coordinates.
        unit: metres per unit of the file; None if not given.
        resolution: cell size, metres; None for the file's own cell size.
        within: maximum distance between a polygon and the occupied cells, metres; None for half a cell.
        layers: layers of a drawing that are read; empty for all.
        unknown_free: True if unknown cells count as free.
        plane: True if the world is a plane, so that heights are ignored.
    """

    kind: str
    sources: tuple[Source, ...]
    span: Span
    limits: Limits
    at: tuple[float, float] = (0.0, 0.0)
    origin: tuple[float, float] | None = None
    unit: float | None = None
    resolution: float | None = None
    within: float | None = None
    layers: tuple[str, ...] = ()
    unknown_free: bool = False
    plane: bool = False


class LeftOut(Record):
    """Elements of a map file that were not read because they define no region, obstacle or beacon.

    Args:
        kind: name of the elements in the file format, such as ``TEXT`` or ``LineString``.
        reason: a phrase for the reader, such as ``not an area``.
    """

    kind: str
    reason: str
    count: int


class ReadSummary(Record):
    """Summary of a map file: number of features read, elements left out, and the extents of the features (None without
    any)."""

    count: int
    left_out: tuple[LeftOut, ...]
    extents: Extents | None


class World(Record):
    low: Vector
    high: Vector
    span: Span

    @property
    def dimension(self) -> int:
        return len(self.low)

    @property
    def flat(self) -> bool:
        """True if the world's box has no extent along some axis."""
        return any(low >= high for low, high in zip(self.low, self.high, strict=True))


class Region(Record, eq=False):
    name: str
    shape: Shape
    span: Span


class Still(Record):
    pass


class Path(Record):
    """Translation of a moving shape over time: linear between the waypoints, constant before the first and after the
    last.

    ``moving V`` becomes two waypoints, (0, 0…) and (horizon, V * horizon). Times in seconds, offsets in metres.
    """

    times: tuple[Seconds, ...]
    offsets: tuple[Vector, ...]


class Obstacle(Record, eq=False):
    """Forbidden set for agent bodies: at time t, all points within ``growth * (t + age)`` metres of the translated
    shape.

    Args:
        growth: growth rate of the obstacle's position uncertainty, m/s, at least 0.
        age: duration of growth before time 0, seconds.
    """

    name: str
    shape: Shape
    motion: Still | Path
    span: Span
    growth: float = 0.0
    age: float = 0.0

    @property
    def constant(self) -> bool:
        """True if the obstacle neither moves nor grows."""
        return isinstance(self.motion, Still) and self.growth == 0

    def grown(self, time: float) -> float:
        """Distance by which the obstacle has grown on all sides at a time in seconds; metres."""
        return self.growth * max(time + self.age, 0.0)


class Beacon(Record, eq=False):
    name: str
    position: Vector
    span: Span


class PlacesFile(Record, eq=False):
    """Regions, obstacles, beacons or points that one declaration reads from a map file.

    Args:
        path: path of the file as the mission writes it.
        kind: ``obstacle``, ``region``, ``beacon`` or ``point``.
        names: names of the resulting objects; empty for points.
        asked: settings of the declaration, with the unit of the file if the file states one; None for points.
    """

    path: str
    kind: str
    summary: ReadSummary
    names: frozenset[str] = frozenset()
    asked: FileRequest | None = None
