"""Syntax tree of quantities: names, numbers with their units, and arithmetic over them."""

from __future__ import annotations

from typing import TypeAlias

from missionc.base.late_dataclass import dataclass
from missionc.base.source import Source, Span


@dataclass(frozen=True, slots=True)
class Name:
    span: Span
    text: str


@dataclass(frozen=True, slots=True)
class Number:
    """A number and the unit written after it, if any."""

    span: Span
    value: float
    unit: str | None = None
    unit_span: Span | None = None


@dataclass(frozen=True, slots=True)
class Negative:
    span: Span
    body: Quantity


@dataclass(frozen=True, slots=True)
class Arithmetic:
    """``left op right`` with ``op`` one of ``+ - * /``."""

    span: Span
    operator: str
    left: Quantity
    right: Quantity


@dataclass(frozen=True, slots=True)
class Member:
    """``drone[2]`` or ``drone[0..2]``: members of a team by index."""

    span: Span
    team: Name
    low: Quantity
    high: Quantity | None = None


@dataclass(frozen=True, slots=True)
class Distance:
    """``distance(base)`` or ``distance(drone[0], drone[1])``."""

    span: Span
    ends: tuple[Name | Member, ...]


Quantity: TypeAlias = "Name | Number | Negative | Arithmetic | Distance"
"""``Distance`` and the state words (``x``, ``speed``, as ``Name``) only fit inside a comparison; resolve says so."""


@dataclass(frozen=True, slots=True)
class Point:
    span: Span
    coordinates: tuple[Quantity, ...]


@dataclass(frozen=True, slots=True)
class File:
    """``"hall.yaml"``, the words; ``sources`` are the file and what it rests on, once they have been read."""

    span: Span
    path: str
    sources: tuple[Source, ...] = ()
