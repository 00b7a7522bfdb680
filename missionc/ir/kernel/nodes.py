"""Nodes of the kernel: formulas about one agent at one step, from a small set of constructors.

Nodes compare by identity, so a shared subformula is one object and every lowering memoises on it. The truth of a
formula about the team does not depend on the agent. ``span`` is the source text of the node. A node that several
formulas share has no span; its parent's span applies.

The kernel is in negation normal form: ``Not`` appears only on leaves (``Atom``, ``Is``, ``PathLength``), and every
other constructor has a dual. A constructor and its dual have the same kind and fields; ``every`` marks the universal
one. A node is ``dual`` if it results from negating the author's formula and therefore means the opposite of its text.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import field, replace
from typing import TypeAlias

from missionc.base.late_dataclass import Record, dataclass
from missionc.base.source import Span
from missionc.ir import Formula, Graph, Predicate


class LeafNode:
    """Base class of constructors without child nodes."""

    __slots__ = ()
    every = False


@dataclass(frozen=True, slots=True, eq=False)
class Atom(LeafNode):
    """Atomic proposition: the predicate is true for the evaluated agent at the evaluated step."""

    predicate: Predicate
    span: Span | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Is(LeafNode):
    """Membership: the evaluated agent is in the set (mission indices)."""

    agents: frozenset[int]
    span: Span | None = None


class Not(Record, eq=False):
    """Negation of a leaf. Operators may negate any node; ``normal_form`` moves the negation to the leaves."""

    every = False
    body: Node
    span: Span | None = None


class All(Record, eq=False):
    """Conjunction of the parts; true without parts."""

    every = True
    parts: tuple[Node, ...]
    span: Span | None = None
    dual: bool = False


class Any(Record, eq=False):
    """Disjunction of the parts; false without parts."""

    every = False
    parts: tuple[Node, ...]
    span: Span | None = None
    dual: bool = False


class AtLeast(Record, eq=False):
    """Threshold: at least ``count`` of the parts are true. Its robustness is the ``count``-th largest robustness of a
    part."""

    every = False
    count: int
    parts: tuple[Node, ...]
    span: Span | None = None
    dual: bool = False


class WindowNode(Record, eq=False):
    """Temporal operator with one operand: ``body`` at the steps from ``low`` to ``high`` ahead.

    ``high`` None means the mission's last step. A window into the past has a ``low`` below 0 and a ``high`` of at most
    0; steps before step 0 are excluded.
    """

    every = False
    body: Node
    low: int
    high: int | None
    span: Span | None = None
    dual: bool = False


class Always(WindowNode):
    """Globally (STL G): ``body`` is true at every step of the window."""

    __slots__ = ()
    every = True


class Eventually(WindowNode):
    """Eventually (STL F): ``body`` is true at some step of the window."""

    __slots__ = ()


class UntilNode(Record, eq=False):
    """Temporal operator with two operands: ``end`` at steps from ``low`` to ``high`` ahead, ``hold`` at the steps
    before.

    ``high`` None means the mission's last step. For a window into the past, ``hold`` applies to the later steps: from
    the current step back to the step of ``end``, excluded.
    """

    every = False
    hold: Node
    end: Node
    low: int
    high: int | None
    span: Span | None = None
    dual: bool = False


class Until(UntilNode):
    """Until (STL U): ``end`` is true at some step of the window, and ``hold`` at every step before that step."""

    __slots__ = ()


class Release(UntilNode):
    """Dual of ``Until``: at every step of the window, ``end`` is true or ``hold`` was true at an earlier step."""

    __slots__ = ()
    every = True


class NeighbourNode(Record, eq=False):
    """Spatial operator over direct links: ``body`` at agents linked to the evaluated agent, at the same step."""

    every = False
    graph: Graph
    body: Node
    span: Span | None = None
    dual: bool = False


class Neighbour(NeighbourNode):
    """Existential neighbour operator: ``body`` is true at some agent linked to the evaluated agent."""

    __slots__ = ()


class EveryNeighbour(NeighbourNode):
    """Dual of ``Neighbour``: ``body`` is true at every agent linked to the evaluated agent."""

    __slots__ = ()
    every = True


class ReachNode(Record, eq=False):
    """Spatial operator over routes of at most ``hops`` links (possibly none) through ``through`` agents to an ``end``
    agent.

    ``through`` applies to every agent of the route except the last. An agent outside the graph has no links. Operators
    expand lower bounds on the number of links to ``Is`` and ``Neighbour``.
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
    """Reachability: some route of at most ``hops`` links through ``through`` agents ends at an ``end`` agent."""

    __slots__ = ()


class EveryReach(ReachNode):
    """Dual of ``Reach``: every route of at most ``hops`` links has a ``through`` agent before its last, or ends at an
    ``end`` agent."""

    __slots__ = ()
    every = True


class RouteNode(Record, eq=False):
    """Spatial operator over routes like those of ``ReachNode``, without repeated agents, of ``low`` to ``high``
    metres."""

    every = False
    graph: Graph
    through: Node
    end: Node
    low: float
    high: float
    span: Span | None = None
    dual: bool = False


class Route(RouteNode):
    """Reachability in metres: some route of ``low`` to ``high`` metres through ``through`` agents ends at an ``end``
    agent."""

    __slots__ = ()


class EveryRoute(RouteNode):
    """Dual of ``Route``: every route of ``low`` to ``high`` metres has a ``through`` agent before its last, or ends at
    an ``end`` agent."""

    __slots__ = ()
    every = True


@dataclass(frozen=True, slots=True, eq=False)
class PathLength(LeafNode):
    """Bound on distance: the shortest path along the links to ``agent`` has a length of ``low`` to ``high`` metres."""

    graph: Graph
    agent: int
    low: float
    high: float
    span: Span | None = None


class At(Record, eq=False):
    """Formula ``body`` evaluated for ``agent`` at the same step."""

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
"""Constructors whose truth depends on the links of a graph."""


def says_opposite(node: Node) -> bool:
    """Return true if the node means the opposite of its source text, because a negation was moved through it."""
    return not isinstance(node, Not | LeafNode) and node.dual


class Goal(Record, eq=False):
    """Requirement or preference (``weight`` > 0) in kernel form; ``formula`` is about the team and is evaluated at step
    0."""

    name: str
    formula: Node
    span: Span
    weight: float | None = None


class Kernel(Record, eq=False):
    """Requirements and preferences of a mission in kernel form, in the order of the text.

    ``meanings`` maps each formula of the mission to its node, for messages; it is empty for kernels that do not come
    from ``lower.expand``. ``opposites`` maps nodes whose negation a goal requires to that negation.
    """

    requirements: tuple[Goal, ...]
    preferences: tuple[Goal, ...]
    meanings: Mapping[Formula, Node] = field(default_factory=dict)
    opposites: Mapping[Node, Node] = field(default_factory=dict)

    @property
    def goals(self) -> tuple[Goal, ...]:
        """Requirements, followed by preferences."""
        return (*self.requirements, *self.preferences)

    @property
    def formulas(self) -> tuple[Node, ...]:
        """Formulas of all requirements, then of all preferences."""
        return tuple(goal.formula for goal in self.goals)

    def with_formulas(self, new: Callable[[Node], Node]) -> Kernel:
        """Kernel with the formula of each goal replaced by the result of ``new``, and the same ``meanings``."""
        requirements, preferences = (
            tuple(replace(goal, formula=new(goal.formula)) for goal in goals)
            for goals in (self.requirements, self.preferences)
        )
        return replace(self, requirements=requirements, preferences=preferences)
