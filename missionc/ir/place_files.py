"""Place files as values: the request of a declaration, and the summary of the file's contents."""

from __future__ import annotations

from typing import TypeAlias

from missionc.base.late_dataclass import Record
from missionc.base.limits import Limits
from missionc.base.source import Source, Span

Extents: TypeAlias = tuple[tuple[float, float], tuple[float, float]]
"""``(x, y)`` of the lower left and the upper right corner, metres."""


class FileRequest(Record):
    """A file that a declaration names, and the settings for reading it.

    Args:
        kind: ``obstacle``, ``region`` or ``beacon``.
        sources: the file and the files that it refers to.
        span: source text of its name.
        at: position of the file's own (0, 0), or of its ``origin``, metres.
        origin: reference longitude and latitude, degrees; None for plane coordinates.
        unit: metres per unit of the file; None if not given.
        resolution: cell size, metres; None for the file's own.
        within: maximum distance between a polygon and occupied cells, metres; None for half a cell.
        layers: layers of a drawing; empty for all.
        unknown_free: True if unknown cells are free.
        plane: True if the world is a plane and heights are ignored.
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
    """Parts of a file that define no place.

    Args:
        kind: the file's own word for them, such as ``TEXT`` or ``LineString``.
        reason: a phrase for the reader, such as ``not an area``.
    """

    kind: str
    reason: str
    count: int


class ReadSummary(Record):
    """``count`` is the number of features read; ``extents`` is None if there are none."""

    count: int
    left_out: tuple[LeftOut, ...]
    extents: Extents | None
