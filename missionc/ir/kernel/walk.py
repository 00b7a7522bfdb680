"""Graph traversal of formulas that visits each shared node once."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from typing import TypeVar, assert_never

from missionc.base.late_dataclass import Record
from missionc.ir import Graph
from missionc.ir.kernel import nodes as k

Value = TypeVar("Value")


def children(node: k.Node) -> tuple[k.Node, ...]:
    """Child nodes, in order."""
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
    """The same constructor over other nodes, and over another graph if given and if it reads one."""
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
    """Return whether two sequences hold identical objects; a rewritten object differs."""
    return len(some) == len(others) and all(one is other for one, other in zip(some, others, strict=True))


class Ask(Record):
    """Agents and steps at which a node evaluates a child.

    Args:
        high: None means the mission's last step, or with ``before_last`` the step before it.
        of_itself: the child is evaluated for the node's own agent.
        agents: the child is also evaluated for these; with ``linked``, only if the node's agent is one of them.
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
        """Steps of the child if the node is evaluated at the first step."""
        if self.high is None:
            return slice(self.low, -1 if self.before_last else None)
        return slice(max(self.low, 0), max(self.high + 1, 0))

    def steps_from(self, step: int, last: int) -> range:
        """Steps of the child if the node is evaluated at ``step`` of a mission with last step ``last``.

        Steps before the first are left out. If a window runs past the last step, there are none: neither the formula
        nor its negation holds then. No goal of a checked mission is evaluated at such a step.
        """
        high = last - self.before_last if self.high is None else step + self.high
        return range(max(step + self.low, 0), high + 1 if high <= last else 0)


def asks(node: k.Node) -> tuple[Ask, ...]:
    """Agents and steps at which the node evaluates each child.

    Source:
        [strel] Definition 5, except that the left side of ``until`` is evaluated one step less.
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
    """Window of a temporal operator in steps ahead; end None means the mission's last step.

    Negative steps look back (``looks_back``).
    """
    return (node.low, node.high) if isinstance(node, k.WindowNode | k.UntilNode) else None


def looks_back(node: k.Node) -> bool:
    """Return whether the node is a temporal operator whose window reaches back."""
    return isinstance(node, k.WindowNode | k.UntilNode) and node.low < 0


def range_asked(node: k.Node, place: k.Node, low: int, high: int, last: int) -> tuple[int, int] | None:
    """First and last step of evaluation of a child if the node is evaluated from ``low`` to ``high``.

    None if never.

    Args:
        last: the mission's last step.
    """
    asked = asked_between((node,), last, low, high).get(place)
    return asked and (min(asked[0], last), min(asked[1], last))


def asked_between(roots: Iterable[k.Node], last: int, low: int = 0, high: int = 0) -> dict[k.Node, tuple[int, int]]:
    """First and last step at which nodes are evaluated, if the roots are evaluated from ``low`` to ``high``.

    A node that is evaluated only before the first step is left out. A last step after the mission's means that a
    formula looks too far ahead. ``check`` rejects this, and no rewriting of a kernel may cause it.

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
    """The awaited child of a temporal operator, for example the end of an ``until``."""
    return asks(node)[-1] if window_of(node) and not node.every else None


def graph_of(node: k.Node) -> Graph | None:
    """The graph whose links a spatial operator reads."""
    return node.graph if isinstance(node, k.LinkNode) else None


def route_bounds(node: k.Node) -> tuple[float, float] | None:
    """Least and greatest length of a route, in metres or hops, according to the operator."""
    match node:
        case k.RouteNode() | k.PathLength():
            return node.low, node.high
        case k.ReachNode():
            return 0, node.hops
        case _:
            return None


def more_than(most: int, roots: Iterable[k.Node]) -> bool:
    """Return whether formulas have more than ``most`` nodes, each counted once; stops early."""
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
    """List every node of these formulas once, after its children, for formulas of any depth."""
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
    """Compute a value for every node of these formulas from the values of its children."""
    values: dict[k.Node, Value] = {}
    for node in postorder(roots, below):
        values[node] = value_of(node, tuple(values[child] for child in below(node)))
    return values


def reads_headings(kernel: k.Kernel) -> bool:
    """Return whether a goal reads headings."""
    return any(isinstance(node, k.Atom) and node.predicate.reads_heading for node in postorder(kernel.formulas))
