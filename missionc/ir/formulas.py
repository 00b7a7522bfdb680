"""Temporal and spatial formulas over predicates: operators are objects, windows are whole steps."""

from __future__ import annotations

from enum import Enum
from typing import Protocol, TypeAlias

from missionc.base.late_dataclass import Record
from missionc.base.source import Span
from missionc.base.units import Metric, Steps
from missionc.ir.agents import AgentSet
from missionc.ir.couplings import Graph, Weight
from missionc.ir.predicates import Predicate


class Operator(Protocol):
    """What a formula as meant says of its operator; ``language.operators`` has the whole of each, under its name."""

    @property
    def name(self) -> str: ...

    @property
    def spatial(self) -> bool: ...

    @property
    def arity(self) -> int: ...

    @property
    def reads(self) -> str: ...


class Window(Record):
    """Steps ahead, both ends included; ``high`` None reaches to the mission's last step."""

    low: Steps
    high: Steps | None
    span: Span


class Length(Record):
    """Bounds of a route, both included: whole hops, metres, or the sum of what its links weigh.

    ``high`` is ``math.inf`` where it is left out; ``weight`` is what the route is measured in, if that is one.
    """

    graph: Graph
    metric: Metric
    low: float
    high: float
    span: Span
    weight: Weight | None = None

    @property
    def word(self) -> str:
        """``hops``, ``distance`` or the name of a weight."""
        return self.metric.value if self.weight is None else self.weight.name


class Period(Record):
    """The length of the stretches in which something recurs; at least 1."""

    steps: Steps
    span: Span


class About(Enum):
    """Whom a formula speaks of; the value reads well in a message."""

    AGENT = "one agent"
    TEAM = "the team"
    EITHER = "either"


class Truth(Record, eq=False, weakref_slot=True):
    value: bool
    span: Span


class Holds(Record, eq=False, weakref_slot=True):
    predicate: Predicate
    span: Span


class Belongs(Record, eq=False, weakref_slot=True):
    """The agent is one of these."""

    agents: AgentSet
    span: Span


class Apply(Record, eq=False, weakref_slot=True):
    """An operator on its operands. ``comparison`` and ``number`` are ``count``'s alone (``>=``, 2)."""

    operator: Operator
    operands: tuple[Formula, ...]
    bounds: Window | Length | Period | None
    span: Span
    comparison: str = ""
    number: int = 0


class AtLeastOf(Record, eq=False, weakref_slot=True):
    """``body`` of at least ``number`` of the agents; ``every`` is all of them, ``some`` is one."""

    kind: str
    number: int
    agents: AgentSet
    body: Formula
    span: Span


class OfAgent(Record, eq=False, weakref_slot=True):
    """``body`` of that agent."""

    agent: int
    body: Formula
    span: Span


class Without(Record, eq=False, weakref_slot=True):
    """``body`` of the team without any ``number`` of the agents.

    ``cases`` is what the body says of whoever is left, for each of the ``lost``: the same words, about fewer agents.
    """

    number: int
    agents: AgentSet
    body: Formula
    lost: tuple[tuple[int, ...], ...]
    cases: tuple[Formula, ...]
    span: Span


Formula: TypeAlias = "Truth | Holds | Belongs | Apply | AtLeastOf | OfAgent | Without"
"""A ``let`` is resolved once: every use is the same object, so a formula is a graph without cycles."""
