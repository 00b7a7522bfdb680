"""Evaluation of kernel formulas over a domain: a lattice of values with rules for windows and links.

in   formulas, a Domain
out  the value of each

A domain gives the values of leaves, and combines the values of children for each group of constructors. ``node.every``
distinguishes the two constructors of a group: for every step, neighbour or route, or for some.
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
    """The values of formulas; one value covers every agent at every step."""

    @abstractmethod
    def atom(self, predicate: Predicate, holds: bool) -> Value:
        """Value of the predicate, or with False of its negation."""

    @abstractmethod
    def member(self, agents: frozenset[int], holds: bool) -> Value:
        """Value of membership in these agents (mission indices), or with False of non-membership."""

    @abstractmethod
    def path_length(self, node: k.PathLength, holds: bool) -> Value:
        """Value of the shortest path to an agent being within its bounds, or with False outside them."""

    @abstractmethod
    def meet(self, parts: Sequence[Value]) -> Value:
        """Value of all parts; the greatest value without parts."""

    @abstractmethod
    def join(self, parts: Sequence[Value]) -> Value:
        """Value of some part; the least value without parts."""

    @abstractmethod
    def at_least(self, count: int, parts: Sequence[Value]) -> Value:
        """Value of at least ``count`` of the parts."""

    @abstractmethod
    def window(self, node: k.WindowNode, body: Value) -> Value:
        """Value of every, or some, step of a window."""

    @abstractmethod
    def until(self, node: k.UntilNode, hold: Value, end: Value) -> Value:
        """Value of ``Until``, or if ``every`` of its dual ``Release``."""

    @abstractmethod
    def at(self, agent: int, body: Value) -> Value:
        """Value of the body at that agent."""

    @abstractmethod
    def neighbour(self, node: k.NeighbourNode, body: Value) -> Value:
        """Value of the body at every, or some, linked agent."""

    @abstractmethod
    def reach(self, node: k.ReachNode, through: Value, end: Value) -> Value:
        """Value of every, or some, route with a bounded number of links."""

    @abstractmethod
    def route(self, node: k.RouteNode, through: Value, end: Value) -> Value:
        """Value of every, or some, route with a bounded length in metres."""


def evaluate(roots: Iterable[k.Node], domain: Domain[Value]) -> dict[k.Node, Value]:
    """Value of each of these formulas.

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
    """Value of a formula from those of its direct children."""
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
