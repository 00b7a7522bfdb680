"""Place files as values: how a declaration reads a map file, and a summary of what the file contains."""

from __future__ import annotations

from typing import TypeAlias

from missionc.base.late_dataclass import Record
from missionc.base.limits import Limits
from missionc.base.source import Source, Span

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
