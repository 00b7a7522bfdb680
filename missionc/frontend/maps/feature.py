"""Features: what a file of places holds, as plain numbers in metres, each with its place in the file."""

from __future__ import annotations

from typing import TypeAlias

from missionc.base.diagnostics.code import FILE_TOO_LARGE, MAP_FEATURE, MAP_OPTION, MAP_UNREADABLE, Code
from missionc.base.diagnostics.model import Diagnostic, Label
from missionc.base.late_dataclass import dataclass
from missionc.base.limits import MOST, Limits
from missionc.base.source import Source, Span

Corners: TypeAlias = tuple[tuple[float, float], ...]


@dataclass(frozen=True, slots=True)
class Area:
    """Polygons less their holes: ``(outer, hole, …)`` of each, corners in order, either way round."""

    polygons: tuple[tuple[Corners, ...], ...]


@dataclass(frozen=True, slots=True)
class Circle:
    centre: tuple[float, float]
    radius: float


@dataclass(frozen=True, slots=True)
class Place:
    """A point, with two coordinates or three."""

    position: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class Feature:
    """``name`` is empty where the file gives none; ``height`` is the band that it stands in, if the file says it."""

    name: str
    shape: Area | Circle | Place
    span: Span
    name_span: Span
    height: tuple[float, float] | None = None


@dataclass(frozen=True, slots=True)
class Asked:
    """What a declaration asks of a file.

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


class MapError(Exception):
    """A file, or a part of it, that nothing can be made of."""

    def __init__(self, code: Code, message: str, span: Span, way_out: str) -> None:
        super().__init__(message)
        self.finding = Diagnostic(code, message, Label(span), help=way_out)


def unreadable(source: Source, reason: str, span: Span, way_out: str) -> MapError:
    return MapError(MAP_UNREADABLE, f"`{source.name}` cannot be read: {reason}", span, way_out)


def unusable(reason: str, span: Span, way_out: str) -> MapError:
    return MapError(MAP_FEATURE, reason, span, way_out)


def unsaid(message: str, span: Span, way_out: str) -> MapError:
    return MapError(MAP_OPTION, message, span, way_out)


def too_many(source: Source, what: str, name: str, count: int, limits: Limits, span: Span) -> MapError:
    if count > MOST:
        message = f"`{source.name}` has more than {MOST} {what}; the limit is {getattr(limits, name)}"
        return MapError(FILE_TOO_LARGE, message, span, "make the file smaller")
    message = f"`{source.name}` has {count} {what}; the limit is {getattr(limits, name)}"
    return MapError(FILE_TOO_LARGE, message, span, f"allow more with `--limit {name}={count}`")
