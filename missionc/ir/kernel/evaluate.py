"""Evaluation of kernel formulas over a domain: a lattice of values with rules for windows and links.

    in   formulas, a Domain
    out  the value of each formula

A domain defines the values of leaves, and combines the values of children for each group of constructors.
``node.every`` distinguishes the two constructors of a group: the universal one (every step, neighbour or route) and the
existential one.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import Iterable, Sequence
from typing import Generic, TypeVar, assert_never

from missionc.ir import Predicate
from missionc.ir.kernel import nodes as k
from missionc.ir.kernel.walk import children, postorder

Value = TypeVar("Value")


class Domain(ABC, Generic[Value]):
    """Interpretation of kernel formulas: each value covers one formula for every agent at every step."""

    @abstractmethod
    def atom(self, predicate: Predicate, holds: bool) -> Value:
        """Value of a predicate, or of its negation if ``holds`` is False."""

    @abstractmethod
    def member(self, agents: frozenset[int], holds: bool) -> Value:
        """Value of "the agent is in ``agents``" (mission indices), or of its negation if ``holds`` is False."""

    @abstractmethod
    def path_length(self, node: k.PathLength, holds: bool) -> Value:
        """Value of "the shortest path to an agent has a length within the node's bounds", or of its negation if
        ``holds`` is False."""

    @abstractmethod
    def meet(self, parts: Sequence[Value]) -> Value:
        """Value of the conjunction of ``parts``; the greatest value if there are no parts."""

    @abstractmethod
    def join(self, parts: Sequence[Value]) -> Value:
        """Value of the disjunction of ``parts``; the least value if there are no parts."""

    @abstractmethod
    def at_least(self, count: int, parts: Sequence[Value]) -> Value:
        """Value of "at least ``count`` of the parts are true"."""

    @abstractmethod
    def window(self, node: k.WindowNode, body: Value) -> Value:
        """Value of ``Always`` or ``Eventually`` over the node's window, from the value of its body."""

    @abstractmethod
    def until(self, node: k.UntilNode, hold: Value, end: Value) -> Value:
        """Value of ``Until``, or of its dual ``Release`` if ``node.every``, from the values of its two operands."""

    @abstractmethod
    def at(self, agent: int, body: Value) -> Value:
        """Value of ``At``: the body's value for that agent."""

    @abstractmethod
    def neighbour(self, node: k.NeighbourNode, body: Value) -> Value:
        """Value of ``Neighbour``, or of ``EveryNeighbour`` if ``node.every``: the body for some or every linked
        agent."""

    @abstractmethod
    def reach(self, node: k.ReachNode, through: Value, end: Value) -> Value:
        """Value of ``Reach``, or of ``EveryReach`` if ``node.every``: some or every route with a bounded number of
        links."""

    @abstractmethod
    def route(self, node: k.RouteNode, through: Value, end: Value) -> Value:
        """Value of ``Route``, or of ``EveryRoute`` if ``node.every``: some or every route with a bounded length in
        metres."""


def evaluate(roots: Iterable[k.Node], domain: Domain[Value]) -> dict[k.Node, Value]:
    """Value of each root formula in a domain.

    To save memory, a node's value is dropped after its last parent is evaluated. Pass ``postorder(roots)`` to get the
    values of all nodes.
    """
    wanted = tuple(roots)
    order = postorder(wanted)
    needed = Counter(child for node in order for child in children(node))
    needed.update(wanted)
    known: dict[k.Node, Value] = {}
    for node in order:
        known[node] = value_of(node, [known[child] for child in children(node)], domain)
        for child in children(node):
            needed[child] -= 1
            if not needed[child]:
                del known[child]
    return {node: known[node] for node in wanted}


def value_of(node: k.Node, below: Sequence[Value], domain: Domain[Value]) -> Value:
    """Value of a formula from the values of its direct children (``below``)."""
    match node:
        case k.LeafNode():
            return _leaf(node, True, domain)
        case k.Not(body):
            return _leaf(body, False, domain)
        case k.All():
            return domain.meet(below)
        case k.Any():
            return domain.join(below)
        case k.AtLeast(count):
            return domain.at_least(count, below)
        case k.WindowNode():
            return domain.window(node, below[0])
        case k.UntilNode():
            return domain.until(node, below[0], below[1])
        case k.At(agent):
            return domain.at(agent, below[0])
        case k.NeighbourNode():
            return domain.neighbour(node, below[0])
        case k.ReachNode():
            return domain.reach(node, below[0], below[1])
        case k.RouteNode():
            return domain.route(node, below[0], below[1])
        case _:
            assert_never(node)


def _leaf(node: k.Node, holds: bool, domain: Domain[Value]) -> Value:
    match node:
        case k.Atom(predicate):
            return domain.atom(predicate, holds)
        case k.Is(agents):
            return domain.member(agents, holds)
        case k.PathLength():
            return domain.path_length(node, holds)
        case _:
            raise AssertionError("a kernel in negation normal form negates its leaves alone")
