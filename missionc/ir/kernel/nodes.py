"""The kernel: a formula about one agent at one step, from a handful of constructors.

Nodes compare by identity, so a shared subformula is one object and every
lowering memoises on it. A formula about the team is one whose truth does not
depend on the agent it is asked of. ``span`` is the words the node came from;
one that several formulas share has none, and goes by the words of what asks for it.

The kernel is in negation normal form: ``Not`` stands on leaves alone (``Atom``, ``Is``, ``PathLength``), and
every other constructor has its dual beside it. The two are of one kind and have its fields: where ``every``, the one
that asks for each step, neighbour or route. One that came of negating what the author wrote is ``dual``: it
says the opposite of its words.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import field, replace
from typing import TypeAlias

from missionc.base.late_dataclass import Record, dataclass
from missionc.base.source import Span
from missionc.ir import Formula, Graph, Predicate


class LeafNode:
    """A constructor over no other node."""

    __slots__ = ()
    every = False


@dataclass(frozen=True, slots=True, eq=False)
class Atom(LeafNode):
    """The predicate holds here, now."""

    predicate: Predicate
    span: Span | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Is(LeafNode):
    """This agent is one of these (mission indices)."""

    agents: frozenset[int]
    span: Span | None = None


class Not(Record, eq=False):
    """The body, a leaf, fails. An operator may write it around any node: ``normal_form`` moves it down."""

    every = False
    body: Node
    span: Span | None = None


class All(Record, eq=False):
    """Every part; true where there are none."""

    every = True
    parts: tuple[Node, ...]
    span: Span | None = None
    dual: bool = False


class Any(Record, eq=False):
    """Some part; false where there are none."""

    every = False
    parts: tuple[Node, ...]
    span: Span | None = None
    dual: bool = False


class AtLeast(Record, eq=False):
    """So many of the parts or more. Robustness: the ``count``-th largest."""

    every = False
    count: int
    parts: tuple[Node, ...]
    span: Span | None = None
    dual: bool = False


class WindowNode(Record, eq=False):
    """The body at steps from ``low`` to ``high`` ahead; ``high`` None is the mission's last step.

    A window that looks back has a ``low`` below 0 and a ``high`` of at most 0, and holds those of its steps that the
    mission has: before step 0 there is none.
    """

    every = False
    body: Node
    low: int
    high: int | None
    span: Span | None = None
    dual: bool = False


class Always(WindowNode):
    """At every step of the window."""

    __slots__ = ()
    every = True


class Eventually(WindowNode):
    """At some step of the window."""

    __slots__ = ()


class UntilNode(Record, eq=False):
    """``end`` at steps from ``low`` to ``high`` ahead, ``hold`` at steps before them; ``high`` as of a window.

    Where the window looks back, ``hold`` at steps after them: from now back to, not at, the one with ``end``.
    """

    every = False
    hold: Node
    end: Node
    low: int
    high: int | None
    span: Span | None = None
    dual: bool = False


class Until(UntilNode):
    """``end`` at some step of the window, ``hold`` at every step from now up to, not at, that one."""

    __slots__ = ()


class Release(UntilNode):
    """The dual of ``Until``: at every step of the window ``end``, or ``hold`` at one before it."""

    __slots__ = ()
    every = True


class NeighbourNode(Record, eq=False):
    """The body now, at agents linked to this one."""

    every = False
    graph: Graph
    body: Node
    span: Span | None = None
    dual: bool = False


class Neighbour(NeighbourNode):
    """Now, at some agent linked to this one."""

    __slots__ = ()


class EveryNeighbour(NeighbourNode):
    """The dual of ``Neighbour``: now, at every agent linked to this one."""

    __slots__ = ()
    every = True


class ReachNode(Record, eq=False):
    """Routes, now, of at most ``hops`` links (none at all included) over ``through`` agents to an ``end`` agent.

    ``through`` holds at every agent of the route but the last. An agent outside
    the graph has no links. Lower bounds are spelt out by the operators, in
    ``Is`` and ``Neighbour``.
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
    """Some such route is there."""

    __slots__ = ()


class EveryReach(ReachNode):
    """The dual of ``Reach``: each such route has a ``through`` agent before its last, or ends at an ``end`` agent."""

    __slots__ = ()
    every = True


class RouteNode(Record, eq=False):
    """Routes, as of a ``ReachNode``, without repeated agents and of a length within the bounds, in metres."""

    every = False
    graph: Graph
    through: Node
    end: Node
    low: float
    high: float
    span: Span | None = None
    dual: bool = False


class Route(RouteNode):
    """Some such route is there."""

    __slots__ = ()


class EveryRoute(RouteNode):
    """The dual of ``Route``, as ``EveryReach`` is that of ``Reach``."""

    __slots__ = ()
    every = True


@dataclass(frozen=True, slots=True, eq=False)
class PathLength(LeafNode):
    """The shortest way from here to that agent, in metres along the links, is within the bounds."""

    graph: Graph
    agent: int
    low: float
    high: float
    span: Span | None = None


class At(Record, eq=False):
    """Now, at that agent."""

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
    """Whether the node says the opposite of its words."""
    return not isinstance(node, Not | LeafNode) and node.dual


class Goal(Record, eq=False):
    """A requirement or preference (``weight`` > 0) in kernel form; ``formula`` is about the team, at step 0."""

    name: str
    formula: Node
    span: Span
    weight: float | None = None


class Kernel(Record, eq=False):
    """The mission's goals in kernel form: requirements in order of the text, then preferences.

    ``meanings`` is what each formula as meant came to, for who speaks of the author's words; a kernel that was made
    otherwise has none. ``opposites`` has, of those nodes, the ones whose negation a goal asks for, and that negation.
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
        """This kernel with another formula for each goal, and with the same meanings."""
        requirements, preferences = (
            tuple(replace(goal, formula=new(goal.formula)) for goal in goals)
            for goals in (self.requirements, self.preferences)
        )
        return replace(self, requirements=requirements, preferences=preferences)
