"""Traversal of formula graphs that visits each shared node once.

Conjuncts of kernel formulas: necessary conditions on one agent or the team, each over time windows.

Bounds on shortest paths expressed by routes: some route is short enough, and none is too short.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple, TypeVar, assert_never

from missionc.base.late_dataclass import Record
from missionc.ir import Graph
from missionc.ir.kernel import nodes as k
from missionc.ir.kernel.nodes import All, Always, Any, At, EveryRoute, Is, Node, Not, Route

Value = TypeVar("Value")


def children(node: k.Node) -> tuple[k.Node, ...]:
    """Child nodes of a node, in order."""
    match node:
        case k.LeafNode():
            return ()
        case k.Not(body) | k.WindowNode(body) | k.At(_, body) | k.NeighbourNode(_, body):
            return (body,)
        case k.All(parts) | k.Any(parts) | k.AtLeast(_, parts):
            return parts
        case k.UntilNode(first, end) | k.ReachNode(_, first, end) | k.RouteNode(_, first, end):
            return (first, end)
        case _:
            assert_never(node)


def rebuilt(node: k.Node, parts: tuple[k.Node, ...], graph: Graph | None = None) -> k.Node:
    """Node of the same constructor over other children ``parts``, and over another graph if ``graph`` is given and the
    node reads one."""
    match node:
        case k.LeafNode():
            return node
        case k.All() | k.Any() | k.AtLeast():
            return replace(node, parts=parts)
        case k.Not() | k.WindowNode() | k.At():
            return replace(node, body=parts[0])
        case k.UntilNode():
            return replace(node, hold=parts[0], end=parts[1])
        case k.NeighbourNode():
            return replace(node, body=parts[0], graph=graph or node.graph)
        case k.ReachNode() | k.RouteNode():
            return replace(node, through=parts[0], end=parts[1], graph=graph or node.graph)
        case _:
            assert_never(node)


def same_objects(some: Sequence[object], others: Sequence[object]) -> bool:
    """Return true if two sequences contain identical objects in the same order; a rewritten object is not identical."""
    return len(some) == len(others) and all(one is other for one, other in zip(some, others, strict=True))


class Ask(Record):
    """Agents and steps for which a node evaluates a child, relative to the agent and the step of the node.

    Args:
        node: the child.
        low, high: first and last step ahead; ``high`` None means the mission's last step, or with ``before_last`` the
            step before it.
        of_itself: True if the child is evaluated for the node's own agent.
        agents: further agents for which the child is evaluated; with ``linked``, only if the node's agent is in
            ``agents``.
    """

    node: k.Node
    low: int = 0
    high: int | None = 0
    before_last: bool = False
    of_itself: bool = True
    agents: tuple[int, ...] = ()
    linked: bool = False

    @property
    def steps(self) -> slice:
        """Steps at which the child is evaluated if the node is evaluated at step 0."""
        if self.high is None:
            return slice(self.low, -1 if self.before_last else None)
        return slice(max(self.low, 0), max(self.high + 1, 0))

    def steps_from(self, step: int, last: int) -> range:
        """Steps at which the child is evaluated if the node is evaluated at ``step`` of a mission with last step
        ``last``.

        Steps before step 0 are excluded. If a window extends past the last step, the range is empty: neither the
        formula nor its negation is true then. No goal of a checked mission is evaluated at such a step.
        """
        high = last - self.before_last if self.high is None else step + self.high
        return range(max(step + self.low, 0), high + 1 if high <= last else 0)


def asks(node: k.Node) -> tuple[Ask, ...]:
    """Agents and steps for which the node evaluates each child.

    Source:
        [strel] Definition 5, except that the left side of ``until`` is evaluated at one step less.
    """
    match node:
        case k.LeafNode():
            return ()
        case k.Not() | k.All() | k.Any() | k.AtLeast():
            return tuple(map(Ask, children(node)))
        case k.WindowNode(body, low, high):
            return (Ask(body, low, high),)
        case k.UntilNode(hold, end, low, high) if low < 0:
            return Ask(hold, low + 1, 0), Ask(end, low, high)
        case k.UntilNode(hold, end, low, high):
            held = () if high == 0 else (Ask(hold, 0, None if high is None else high - 1, before_last=high is None),)
            return (*held, Ask(end, low, high))
        case k.At(agent, body):
            return (Ask(body, of_itself=False, agents=(agent,)),)
        case k.NeighbourNode(graph, body):
            return (Ask(body, of_itself=False, agents=graph.agents, linked=True),)
        case k.ReachNode(graph, through, end) | k.RouteNode(graph, through, end):
            # A route without links ends at its start, even outside the graph.
            passed = Ask(through, of_itself=False, agents=graph.agents, linked=True)
            return passed, Ask(end, agents=graph.agents, linked=True)
        case _:
            assert_never(node)


def window_of(node: k.Node) -> tuple[int, int | None] | None:
    """Window of a temporal operator in steps ahead (negative: back); None for other nodes.

    An upper end of None means the mission's last step.
    """
    return (node.low, node.high) if isinstance(node, k.WindowNode | k.UntilNode) else None


def looks_back(node: k.Node) -> bool:
    """Return true if the node is a temporal operator with a window into the past."""
    return isinstance(node, k.WindowNode | k.UntilNode) and node.low < 0


def range_asked(node: k.Node, place: k.Node, low: int, high: int, last: int) -> tuple[int, int] | None:
    """First and last step at which the child ``place`` is evaluated if ``node`` is evaluated from step ``low`` to
    ``high``; None if never.

    Args:
        last: the mission's last step.
    """
    asked = asked_between((node,), last, low, high).get(place)
    return asked and (min(asked[0], last), min(asked[1], last))


def asked_between(roots: Iterable[k.Node], last: int, low: int = 0, high: int = 0) -> dict[k.Node, tuple[int, int]]:
    """First and last step at which each node is evaluated, if the roots are evaluated from step ``low`` to ``high``.

    Nodes that are evaluated only before step 0 are omitted. A last step after the mission's means that a formula looks
    too far ahead: ``check`` rejects such missions, and no rewriting of a kernel may cause it.

    Args:
        last: the mission's last step.
    """
    order = postorder(roots)
    found = dict.fromkeys(roots, (low, high))
    for node in reversed(order):
        if node not in found:
            continue
        first, final = found[node]
        for ask in asks(node):
            begin, end = max(first + ask.low, 0), last - ask.before_last if ask.high is None else final + ask.high
            if end >= 0:
                known = found.get(ask.node, (begin, end))
                found[ask.node] = min(known[0], begin), max(known[1], end)
    return found


def awaited(node: k.Node) -> Ask | None:
    """Child whose truth an existential temporal operator awaits (for ``until``, its right side); None for other
    nodes."""
    return asks(node)[-1] if window_of(node) and not node.every else None


def graph_of(node: k.Node) -> Graph | None:
    """Graph whose links a spatial operator reads; None for other nodes."""
    return node.graph if isinstance(node, k.LinkNode) else None


def route_bounds(node: k.Node) -> tuple[float, float] | None:
    """Least and greatest route length of a spatial operator, in metres or hops; None for other nodes."""
    match node:
        case k.RouteNode() | k.PathLength():
            return node.low, node.high
        case k.ReachNode():
            return 0, node.hops
        case _:
            return None


def more_than(most: int, roots: Iterable[k.Node]) -> bool:
    """Return true if formulas have more than ``most`` distinct nodes; counts no further."""
    seen: set[k.Node] = set()
    waiting = [iter(roots)]
    while waiting and len(seen) <= most:
        node = next(waiting[-1], None)
        if node is None:
            waiting.pop()
        elif node not in seen:
            seen.add(node)
            waiting.append(iter(children(node)))
    return len(seen) > most


def postorder(roots: Iterable[k.Node], below: Callable[[k.Node], tuple[k.Node, ...]] = children) -> list[k.Node]:
    """Every node of the formulas once, after its children; works for formulas of any depth.

    Args:
        below: function from a node to its children.
    """
    order: list[k.Node] = []
    seen: set[k.Node] = set()
    stack: list[tuple[k.Node, bool]] = [(root, False) for root in reversed(tuple(roots))]
    while stack:
        node, below_done = stack.pop()
        if below_done:
            order.append(node)
        elif node not in seen:
            seen.add(node)
            stack.append((node, True))
            stack.extend((child, False) for child in reversed(below(node)))
    return order


def bottom_up(
    roots: Iterable[k.Node],
    value_of: Callable[[k.Node, tuple[Value, ...]], Value],
    below: Callable[[k.Node], tuple[k.Node, ...]] = children,
) -> dict[k.Node, Value]:
    """Value of every node of the formulas, computed by ``value_of`` from the node and the values of its children.

    Args:
        below: function from a node to its children.
    """
    values: dict[k.Node, Value] = {}
    for node in postorder(roots, below):
        values[node] = value_of(node, tuple(values[child] for child in below(node)))
    return values


def reads_headings(kernel: k.Kernel) -> bool:
    """Return true if a requirement or preference depends on headings."""
    return any(isinstance(node, k.Atom) and node.predicate.reads_heading for node in postorder(kernel.formulas))


class Conjunct(NamedTuple):
    """Necessary condition: a formula that must hold for an agent, or for the team (None), over nested windows,
    outermost first."""

    agent: int | None
    windows: tuple[Always, ...]
    formula: Node

    @property
    def steps(self) -> slice | None:
        """Steps at which the formula must hold; None for nested windows, whose steps are not a single range."""
        match self.windows:
            case ():
                return slice(0, 1)
            case (window,):
                return asks(window)[0].steps
            case _:
                return None


def conjuncts(formulas: Iterable[Node]) -> Iterator[Conjunct]:
    """Yield the conjuncts of formulas that must be true at step 0, in their order, without repetition."""
    work = [Conjunct(None, (), formula) for formula in formulas][::-1]
    seen: set[Conjunct] = set()
    while work:
        what = work.pop()
        if what in seen:
            continue
        seen.add(what)
        agent, windows, node = what
        match node:
            case All(parts):
                work.extend(Conjunct(agent, windows, part) for part in reversed(parts))
            case Always(body):
                work.append(Conjunct(agent, (*windows, node), body))
            case At(who, body):
                work.append(Conjunct(who, windows, body))
            case _:
                yield what


def as_routes(graph: Graph, agent: int, low: float, high: float, holds: bool) -> Node:
    """Formula that the shortest path to an agent has a length of ``low`` to ``high`` metres, or if not ``holds``, any
    other length."""
    near = way_to(graph, agent, high, holds)
    if low <= 0:
        return near
    far = way_to(graph, agent, math.nextafter(low, 0.0), not holds)
    return All((near, far)) if holds else Any((near, far))


def way_to(graph: Graph, agent: int, most: float, holds: bool) -> Node:
    """Formula that some path of at most ``most`` metres leads to the agent, or if not ``holds``, that no such path
    exists."""
    there = Is(frozenset((agent,)))
    return Route(graph, All(()), there, 0.0, most) if holds else EveryRoute(graph, Any(()), Not(there), 0.0, most)
