"""Temporal and spatial formulas over predicates; their operators are objects and their windows are in steps."""

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
    """Interface of an operator, as formulas use it; ``language.operators`` defines each operator, by name."""

    @property
    def name(self) -> str: ...

    @property
    def spatial(self) -> bool: ...

    @property
    def arity(self) -> int: ...

    @property
    def reads(self) -> str: ...


class Window(Record):
    """Time window of an operator: ``low`` to ``high`` steps ahead, both included; ``high`` None is the mission's last
    step."""

    low: Steps
    high: Steps | None
    span: Span


class Length(Record):
    """Bounds of a route's length, both included: in hops, metres, or total weight of the links.

    ``high`` is ``math.inf`` if the mission gives no upper bound. ``weight`` is the link weight that measures the route;
    None for hops and metres.
    """

    graph: Graph
    metric: Metric
    low: float
    high: float
    span: Span
    weight: Weight | None = None

    @property
    def word(self) -> str:
        """Word of the length measure in missions: ``hops``, ``distance`` or the name of a weight."""
        return self.metric.value if self.weight is None else self.weight.name


class Period(Record):
    """Length of the periods of a recurrence (``every 40 s``), in steps, at least 1."""

    steps: Steps
    span: Span


class About(Enum):
    """Subject of a formula: one agent, the team, or either; the value is its name in messages."""

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
    """Membership formula: the evaluated agent is in this agent set."""

    agents: AgentSet
    span: Span


class Apply(Record, eq=False, weakref_slot=True):
    """Application of an operator to operand formulas.

    Only the operator ``count`` uses ``comparison`` and ``number`` (``>=``, 2).
    """

    operator: Operator
    operands: tuple[Formula, ...]
    bounds: Window | Length | Period | None
    span: Span
    comparison: str = ""
    number: int = 0


class AtLeastOf(Record, eq=False, weakref_slot=True):
    """Quantifier: ``body`` is true for at least ``number`` of the agents; ``every`` means all of them, ``some`` means
    one."""

    kind: str
    number: int
    agents: AgentSet
    body: Formula
    span: Span


class OfAgent(Record, eq=False, weakref_slot=True):
    """Formula ``body`` evaluated for the agent with this mission index."""

    agent: int
    body: Formula
    span: Span


class Without(Record, eq=False, weakref_slot=True):
    """Fault tolerance: ``body`` is true for the team after the loss of any ``number`` of the agents.

    ``lost`` lists the sets of lost agents. ``cases`` has, for each set, ``body`` resolved for the remaining agents.
    """

    number: int
    agents: AgentSet
    body: Formula
    lost: tuple[tuple[int, ...], ...]
    cases: tuple[Formula, ...]
    span: Span


Formula: TypeAlias = "Truth | Holds | Belongs | Apply | AtLeastOf | OfAgent | Without"
"""Resolved formula, an acyclic graph: a ``let`` is resolved once, and all its uses are the same object."""
