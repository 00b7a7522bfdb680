"""Evaluation of kernel formulas over a domain: a lattice of values, with what windows and links make of them.

in   formulas, a Domain
out  the value of each

A domain knows what leaves are worth, and what each group of constructors makes of
the values below. ``node.every`` tells the two of a group apart: the one asks for every
step, neighbour or route, the other for some.
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
    """The values that formulas may have; one of a formula says what it is worth to every agent at every step."""

    @abstractmethod
    def atom(self, predicate: Predicate, holds: bool) -> Value:
        """The predicate, or with False its negation."""

    @abstractmethod
    def member(self, agents: frozenset[int], holds: bool) -> Value:
        """To be one of these agents (mission indices), or with False none of them."""

    @abstractmethod
    def path_length(self, node: k.PathLength, holds: bool) -> Value:
        """The shortest way to an agent, within its bounds or with False outside them."""

    @abstractmethod
    def meet(self, parts: Sequence[Value]) -> Value:
        """All of the parts; the greatest value where there are none."""

    @abstractmethod
    def join(self, parts: Sequence[Value]) -> Value:
        """Some of the parts; the least value where there are none."""

    @abstractmethod
    def at_least(self, count: int, parts: Sequence[Value]) -> Value:
        """So many of the parts or more."""

    @abstractmethod
    def window(self, node: k.WindowNode, body: Value) -> Value:
        """Every, or some, step of a window."""

    @abstractmethod
    def until(self, node: k.UntilNode, hold: Value, end: Value) -> Value:
        """``Until``, or where ``every`` its dual ``Release``."""

    @abstractmethod
    def at(self, agent: int, body: Value) -> Value:
        """The body at that agent."""

    @abstractmethod
    def neighbour(self, node: k.NeighbourNode, body: Value) -> Value:
        """Every, or some, agent linked to this one."""

    @abstractmethod
    def reach(self, node: k.ReachNode, through: Value, end: Value) -> Value:
        """Every, or some, route of so many links."""

    @abstractmethod
    def route(self, node: k.RouteNode, through: Value, end: Value) -> Value:
        """Every, or some, route of a length in metres."""


def evaluate(roots: Iterable[k.Node], domain: Domain[Value]) -> dict[k.Node, Value]:
    """The value of each of these formulas.

    A node's value is forgotten once the last formula that needs it has its own, so that
    many nodes need little memory. Ask for ``postorder(roots)`` to have all of them.
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
    """A formula's value from those of the formulas directly below it."""
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
