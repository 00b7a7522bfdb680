"""Place files as values: what a declaration asks of a file, and the summary of what was read."""

from __future__ import annotations

from typing import TypeAlias

from missionc.base.late_dataclass import Record
from missionc.base.limits import Limits
from missionc.base.source import Source, Span

Extents: TypeAlias = tuple[tuple[float, float], tuple[float, float]]
"""``(x, y)`` of the lower left and of the upper right corner, metres."""


class FileRequest(Record):
    """File that a declaration names, and how it is to be read.

    Args:
        kind: ``obstacle``, ``region`` or ``beacon``.
        sources: the file, and what it rests on.
        span: of the words that name it.
        at: where the file's own (0, 0), or its ``origin``, is, in metres.
        origin: longitude and latitude in degrees that coordinates are taken from; None for those of a plane.
        unit: metres in one of the file's; None where nothing is said.
        resolution: metres of a cell; None for what the file says.
        within: metres that a polygon may stray from occupied cells; None for half a cell.
        layers: of a drawing; none for all.
        unknown_free: whether a cell of which nothing is known is free.
        plane: whether the world is a plane, so that no heights are read.
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
    """Parts of a file that make no place.

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
