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
    """Facts of a formula about its operator; ``language.operators`` defines each operator, under its name."""

    @property
    def name(self) -> str: ...

    @property
    def spatial(self) -> bool: ...

    @property
    def arity(self) -> int: ...

    @property
    def reads(self) -> str: ...


class Window(Record):
    """Window of steps ahead, both ends included; ``high`` None means the mission's last step."""

    low: Steps
    high: Steps | None
    span: Span


class Length(Record):
    """Bounds of a route, both included: in hops, metres, or total weight of its links.

    ``high`` is ``math.inf`` if left out; ``weight`` is the weight that measures the route, if any.
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
    """Length of the periods of a recurrence, in steps; at least 1."""

    steps: Steps
    span: Span


class About(Enum):
    """Subject of a formula; the value is also its wording in messages."""

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
    """Membership: the agent is in this set."""

    agents: AgentSet
    span: Span


class Apply(Record, eq=False, weakref_slot=True):
    """Application of an operator to operands.

    Only ``count`` uses ``comparison`` and ``number`` (``>=``, 2).
    """

    operator: Operator
    operands: tuple[Formula, ...]
    bounds: Window | Length | Period | None
    span: Span
    comparison: str = ""
    number: int = 0


class AtLeastOf(Record, eq=False, weakref_slot=True):
    """``body`` for at least ``number`` of the agents; ``every`` means all of them, ``some`` means one."""

    kind: str
    number: int
    agents: AgentSet
    body: Formula
    span: Span


class OfAgent(Record, eq=False, weakref_slot=True):
    """``body`` evaluated for that agent."""

    agent: int
    body: Formula
    span: Span


class Without(Record, eq=False, weakref_slot=True):
    """``body`` for the team without any ``number`` of the agents.

    ``cases`` has the body for the remaining agents, one for each entry of ``lost``: the same text, for fewer agents.
    """

    number: int
    agents: AgentSet
    body: Formula
    lost: tuple[tuple[int, ...], ...]
    cases: tuple[Formula, ...]
    span: Span


Formula: TypeAlias = "Truth | Holds | Belongs | Apply | AtLeastOf | OfAgent | Without"
"""A formula. A ``let`` is resolved once and each use is the same object, so a formula is an acyclic graph."""
