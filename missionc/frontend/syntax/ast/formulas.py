"""Syntax tree of formulas."""

from __future__ import annotations

from typing import TypeAlias

from missionc.base.late_dataclass import dataclass
from missionc.base.source import Span
from missionc.base.units import Metric
from missionc.frontend.syntax.ast.quantities import Index, Member, Name, Quantity


@dataclass(frozen=True, slots=True)
class Truth:
    span: Span
    value: bool


@dataclass(frozen=True, slots=True)
class Call:
    """``inside(field)``, ``touches(field)``, ``connected(radio, east)``, ``connected(radio, 2)``.

    No argument is a ``Distance``.
    """

    span: Span
    name: Name
    arguments: tuple[Quantity | Member, ...]


@dataclass(frozen=True, slots=True)
class Compare:
    """``left op right`` with ``op`` one of ``<= < >= >``, over the agent's state and distances."""

    span: Span
    operator: str
    left: Quantity
    right: Quantity


@dataclass(frozen=True, slots=True)
class Facing:
    """``heading within 10 deg of 90 deg``; ``towards`` may be the ``Name`` of a beacon."""

    span: Span
    within: Quantity
    towards: Quantity


@dataclass(frozen=True, slots=True)
class Window:
    """``[2 s, 12 s]``; ``high`` is None for ``end``."""

    span: Span
    low: Quantity
    high: Quantity | None


@dataclass(frozen=True, slots=True)
class Period:
    """The ``40 s`` of ``every 40 s: f``."""

    span: Span
    length: Quantity


@dataclass(frozen=True, slots=True)
class Length:
    """``[hops 0..2 on radio]``.

    ``low`` is None for ``<= 2``, ``high`` for ``2..``, ``graph`` where it is left out. ``unit`` names the weight that
    a length is measured in, if it is one.
    """

    span: Span
    metric: Metric
    low: Quantity | None
    high: Quantity | None
    graph: Name | None
    unit: Name | None = None

    @property
    def word(self) -> str:
        """``hops``, ``distance`` or the name of a weight."""
        return self.metric.value if self.unit is None else self.unit.text


@dataclass(frozen=True, slots=True)
class Apply:
    """An operator on its operands, by its canonical word (``and``, ``always``, ``reach``, …).

    ``count`` keeps the comparison after it: ``>=`` and ``2`` in ``count[…] f >= 2``.
    """

    span: Span
    operator: str
    operator_span: Span
    operands: tuple[Formula, ...]
    bounds: Window | Length | Period | None = None
    comparison: str | None = None
    number: Quantity | None = None


@dataclass(frozen=True, slots=True)
class Quantified:
    """``every G: f``, ``some G: f``, ``at least 2 G: f``, ``without any 1 G: f``; ``kind`` is the words before."""

    span: Span
    kind: str
    number: Quantity | None
    agents: Name | Member
    body: Formula


@dataclass(frozen=True, slots=True)
class OneAgent:
    """``drone[0]: f`` (or ``truck7: f``, an agent by its own name)."""

    span: Span
    agent: Name | Member
    body: Formula


@dataclass(frozen=True, slots=True)
class ForEach:
    """``for i in 0..9: f``, ``for some i in 0..9: f``: a conjunction, or a disjunction, once resolve has spelt it out.

    ``kind`` is ``every`` or ``some``, ``word_span`` that of ``for``.
    """

    span: Span
    kind: str
    word_span: Span
    indices: tuple[Index, ...]
    body: Formula


Formula: TypeAlias = "Truth | Name | Member | Call | Compare | Facing | Apply | Quantified | OneAgent | ForEach"
"""A ``Name`` may be a region, team, group, agent, formation or ``let``; resolve tells which."""
