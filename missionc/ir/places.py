"""Geometry of the world: its bounds, regions, obstacles and beacons."""

from __future__ import annotations

from typing import TYPE_CHECKING

from missionc.base.late_dataclass import Record
from missionc.base.source import Span
from missionc.base.units import Seconds
from missionc.ir.shapes import Shape, Vector

if TYPE_CHECKING:  # few missions read files
    from missionc.ir.place_files import FileRequest, ReadSummary


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
