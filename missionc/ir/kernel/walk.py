"""Graph traversal of formulas: a shared node is met once."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from typing import TypeVar, assert_never

from missionc.base.late_dataclass import Record
from missionc.ir import Graph
from missionc.ir.kernel import nodes as k

Value = TypeVar("Value")


def children(node: k.Node) -> tuple[k.Node, ...]:
    """The nodes directly below, in order."""
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
    """The same constructor over other nodes; over another graph too, where it reads one and another is given."""
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
    """Whether two sequences hold the very same objects: what was rewritten is another one."""
    return len(some) == len(others) and all(one is other for one, other in zip(some, others, strict=True))


class Ask(Record):
    """What a node asks of one below it: at which steps ahead, and of whom.

    Args:
        high: None is the mission's last step, or ``before_last`` the one before it.
        of_itself: it asks the agent that it is asked of.
        agents: it asks each of these too; ``linked``, where it is asked of one of them.
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
        """The steps at which it asks, where it is asked at the mission's first."""
        if self.high is None:
            return slice(self.low, -1 if self.before_last else None)
        return slice(max(self.low, 0), max(self.high + 1, 0))

    def steps_from(self, step: int, last: int) -> range:
        """Steps that it asks about if it is asked at ``step`` of a mission whose last step is ``last``.

        No step before the first, and no step at all if a window runs past the last: from there nothing holds, neither a
        formula nor its negation. No goal of a checked mission asks from such a step.
        """
        high = last - self.before_last if self.high is None else step + self.high
        return range(max(step + self.low, 0), high + 1 if high <= last else 0)


def asks(node: k.Node) -> tuple[Ask, ...]:
    """What the node asks of those directly below it.

    Source:
        [strel] Definition 5, with ``until``'s left side asked one step less far.
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
            # A route without links ends where it begins, also outside the graph.
            passed = Ask(through, of_itself=False, agents=graph.agents, linked=True)
            return passed, Ask(end, agents=graph.agents, linked=True)
        case _:
            assert_never(node)


def window_of(node: k.Node) -> tuple[int, int | None] | None:
    """The window, in steps ahead, of an operator of time; its end None is the mission's last step.

    Below 0 they are steps back (``looks_back``).
    """
    return (node.low, node.high) if isinstance(node, k.WindowNode | k.UntilNode) else None


def looks_back(node: k.Node) -> bool:
    """Whether it is an operator of time whose window reaches back."""
    return isinstance(node, k.WindowNode | k.UntilNode) and node.low < 0


def range_asked(node: k.Node, place: k.Node, low: int, high: int, last: int) -> tuple[int, int] | None:
    """The first and the last step that one below is asked at; the node, from ``low`` to ``high``. None: at none.

    Args:
        last: the mission's last step.
    """
    asked = asked_between((node,), last, low, high).get(place)
    return asked and (min(asked[0], last), min(asked[1], last))


def asked_between(roots: Iterable[k.Node], last: int, low: int = 0, high: int = 0) -> dict[k.Node, tuple[int, int]]:
    """The first and the last step that nodes are asked at; formulas that are asked from ``low`` to ``high``.

    A node that is asked before the first step alone is left out. A last step after the mission's means that a formula
    looks too far ahead: what ``check`` refuses, and no rewriting of a kernel may bring about.

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
    """What an operator of time asks for at some step of its window: of an ``until``, its end."""
    return asks(node)[-1] if window_of(node) and not node.every else None


def graph_of(node: k.Node) -> Graph | None:
    """The graph whose links an operator of space reads."""
    return node.graph if isinstance(node, k.LinkNode) else None


def route_bounds(node: k.Node) -> tuple[float, float] | None:
    """The least and the most that a route may measure, in metres or hops as the operator of space counts them."""
    match node:
        case k.RouteNode() | k.PathLength():
            return node.low, node.high
        case k.ReachNode():
            return 0, node.hops
        case _:
            return None


def more_than(most: int, roots: Iterable[k.Node]) -> bool:
    """Whether formulas have more than so many nodes, each counted once. The rest is not looked at."""
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
    """Every node of these formulas once, each after the nodes below it. No formula is too deep for it."""
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
    """A value of every node of these formulas, computed from the values of the nodes directly below it."""
    values: dict[k.Node, Value] = {}
    for node in postorder(roots, below):
        values[node] = value_of(node, tuple(values[child] for child in below(node)))
    return values


def reads_headings(kernel: k.Kernel) -> bool:
    """Whether a goal asks where agents face."""
    return any(isinstance(node, k.Atom) and node.predicate.reads_heading for node in postorder(kernel.formulas))
