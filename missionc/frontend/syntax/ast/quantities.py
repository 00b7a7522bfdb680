"""Syntax tree of quantities: names (of families and their members too), numbers with their units, and arithmetic."""

from __future__ import annotations

from typing import TypeAlias

from missionc.base.late_dataclass import dataclass
from missionc.base.source import Source, Span


@dataclass(frozen=True, slots=True)
class Name:
    span: Span
    text: str


@dataclass(frozen=True, slots=True)
class Index:
    """``i in 0..9``: an index, and the whole numbers that it is, both ends among them."""

    span: Span
    name: Name
    low: Quantity
    high: Quantity


@dataclass(frozen=True, slots=True)
class FamilyName(Name):
    """``w[i in 0..9]`` where a family is declared: ``span`` and ``text`` are those of ``w``, ``whole_span`` of all."""

    span: Span
    text: str
    indices: tuple[Index, ...]
    whole_span: Span


@dataclass(frozen=True, slots=True)
class Indexed(Name):
    """``rack[i, j + 1]``, a member of a family: ``span`` and ``text`` are those of ``rack``, ``whole_span`` of all.

    A single index after the name of agents is a ``Member``, whichever of the two is meant.
    """

    span: Span
    text: str
    indices: tuple[Quantity, ...]
    whole_span: Span


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
class Extreme:
    """``min(a, b)`` or ``max(a, b)``, by its ``word``."""

    span: Span
    word: str
    parts: tuple[Quantity, ...]


@dataclass(frozen=True, slots=True)
class Member:
    """``drone[2]``, ``drone[0..2]`` or ``t[i][2]``: members of a team by index.

    Until families are spelt out, ``drone[2]`` may be a member of a family too.
    """

    span: Span
    team: Name
    low: Quantity
    high: Quantity | None = None


@dataclass(frozen=True, slots=True)
class Distance:
    """``distance(base)`` or ``distance(drone[0], drone[1])``."""

    span: Span
    ends: tuple[Name | Member, ...]


Quantity: TypeAlias = "Name | Number | Negative | Arithmetic | Extreme | Distance"
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
