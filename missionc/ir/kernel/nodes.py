"""The kernel: formulas about one agent at one step, from a small set of constructors.

Nodes compare by identity, so a shared subformula is one object and every lowering memoises on it. The truth of a
formula about the team does not depend on the agent. ``span`` covers the source text of the node. A node that several
formulas share has no span; its parent's span applies.

The kernel is in negation normal form: ``Not`` appears only on leaves (``Atom``, ``Is``, ``PathLength``), and every
other constructor has a dual. Both have the same kind and fields; ``every`` marks the universal one. A node is ``dual``
if it came from negating the author's formula and therefore means the opposite of its text.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import field, replace
from typing import TypeAlias

from missionc.base.late_dataclass import Record, dataclass
from missionc.base.source import Span
from missionc.ir import Formula, Graph, Predicate


class LeafNode:
    """A constructor without child nodes."""

    __slots__ = ()
    every = False


@dataclass(frozen=True, slots=True, eq=False)
class Atom(LeafNode):
    """True if the predicate holds here, now."""

    predicate: Predicate
    span: Span | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Is(LeafNode):
    """True if this agent is in the set (mission indices)."""

    agents: frozenset[int]
    span: Span | None = None


class Not(Record, eq=False):
    """Negation of a leaf. Operators may write it around any node; ``normal_form`` moves it down."""

    every = False
    body: Node
    span: Span | None = None


class All(Record, eq=False):
    """Conjunction; true without parts."""

    every = True
    parts: tuple[Node, ...]
    span: Span | None = None
    dual: bool = False


class Any(Record, eq=False):
    """Disjunction; false without parts."""

    every = False
    parts: tuple[Node, ...]
    span: Span | None = None
    dual: bool = False


class AtLeast(Record, eq=False):
    """At least ``count`` of the parts. Robustness: the ``count``-th largest."""

    every = False
    count: int
    parts: tuple[Node, ...]
    span: Span | None = None
    dual: bool = False


class WindowNode(Record, eq=False):
    """The body at steps from ``low`` to ``high`` ahead; ``high`` None means the mission's last step.

    A window that looks back has a ``low`` below 0 and a ``high`` of at most 0. Steps before step 0 are left out.
    """

    every = False
    body: Node
    low: int
    high: int | None
    span: Span | None = None
    dual: bool = False


class Always(WindowNode):
    """The body at every step of the window."""

    __slots__ = ()
    every = True


class Eventually(WindowNode):
    """The body at some step of the window."""

    __slots__ = ()


class UntilNode(Record, eq=False):
    """``end`` at steps from ``low`` to ``high`` ahead, ``hold`` at steps before; ``high`` as for a window.

    If the window looks back, ``hold`` applies to the later steps: from now back to the step of ``end``, excluded.
    """

    every = False
    hold: Node
    end: Node
    low: int
    high: int | None
    span: Span | None = None
    dual: bool = False


class Until(UntilNode):
    """``end`` at some step of the window, and ``hold`` at every step from now until then, excluded."""

    __slots__ = ()


class Release(UntilNode):
    """Dual of ``Until``: at every step of the window ``end``, or ``hold`` at an earlier step."""

    __slots__ = ()
    every = True


class NeighbourNode(Record, eq=False):
    """The body now, at linked agents."""

    every = False
    graph: Graph
    body: Node
    span: Span | None = None
    dual: bool = False


class Neighbour(NeighbourNode):
    """The body now, at some linked agent."""

    __slots__ = ()


class EveryNeighbour(NeighbourNode):
    """Dual of ``Neighbour``: the body now, at every linked agent."""

    __slots__ = ()
    every = True


class ReachNode(Record, eq=False):
    """Routes, now, of at most ``hops`` links (possibly none) over ``through`` agents to an ``end`` agent.

    ``through`` holds at every agent of the route except the last. An agent outside the graph has no links. The
    operators expand lower bounds to ``Is`` and ``Neighbour``.
    """

    every = False
    low = 0
    graph: Graph
    through: Node
    end: Node
    hops: int
    span: Span | None = None
    dual: bool = False


class Reach(ReachNode):
    """Existence of such a route."""

    __slots__ = ()


class EveryReach(ReachNode):
    """Dual of ``Reach``: each such route has a ``through`` agent before its last, or ends at an ``end`` agent."""

    __slots__ = ()
    every = True


class RouteNode(Record, eq=False):
    """Routes like those of ``ReachNode``, without repeated agents and with a bounded length in metres."""

    every = False
    graph: Graph
    through: Node
    end: Node
    low: float
    high: float
    span: Span | None = None
    dual: bool = False


class Route(RouteNode):
    """Existence of such a route."""

    __slots__ = ()


class EveryRoute(RouteNode):
    """Dual of ``Route``, as ``EveryReach`` is the dual of ``Reach``."""

    __slots__ = ()
    every = True


@dataclass(frozen=True, slots=True, eq=False)
class PathLength(LeafNode):
    """Bound on the length of the shortest path from here to that agent, in metres along the links."""

    graph: Graph
    agent: int
    low: float
    high: float
    span: Span | None = None


class At(Record, eq=False):
    """The body now, at that agent."""

    every = False
    agent: int
    body: Node
    span: Span | None = None
    dual: bool = False


Node: TypeAlias = (
    "Atom | Is | Not | All | Any | AtLeast | WindowNode | UntilNode | NeighbourNode | ReachNode | RouteNode "
    "| PathLength | At"
)

LinkNode: TypeAlias = NeighbourNode | ReachNode | RouteNode | PathLength
"""Constructors that read the links of a graph."""


def says_opposite(node: Node) -> bool:
    """Return whether the node means the opposite of its source text."""
    return not isinstance(node, Not | LeafNode) and node.dual


class Goal(Record, eq=False):
    """A requirement or preference (``weight`` > 0) in kernel form.

    ``formula`` is about the team, at step 0.
    """

    name: str
    formula: Node
    span: Span
    weight: float | None = None


class Kernel(Record, eq=False):
    """The mission's goals in kernel form: requirements in order of the text, then preferences.

    ``meanings`` maps each formula of the mission to its node, for messages; it is empty for kernels made in other ways.
    ``opposites`` maps those of these nodes whose negation a goal requires to that negation.
    """

    requirements: tuple[Goal, ...]
    preferences: tuple[Goal, ...]
    meanings: Mapping[Formula, Node] = field(default_factory=dict)
    opposites: Mapping[Node, Node] = field(default_factory=dict)

    @property
    def goals(self) -> tuple[Goal, ...]:
        """Requirements, then preferences."""
        return (*self.requirements, *self.preferences)

    @property
    def formulas(self) -> tuple[Node, ...]:
        """The formulas of all goals, in their order."""
        return tuple(goal.formula for goal in self.goals)

    def with_formulas(self, new: Callable[[Node], Node]) -> Kernel:
        """Replace the formula of each goal, with the same ``meanings``."""
        requirements, preferences = (
            tuple(replace(goal, formula=new(goal.formula)) for goal in goals)
            for goals in (self.requirements, self.preferences)
        )
        return replace(self, requirements=requirements, preferences=preferences)
