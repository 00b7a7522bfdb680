"""Graph traversal of formulas: a shared node is met once."""

from __future__ import annotations

from collections.abc import Iterable
from typing import assert_never

from missionc.kernel.nodes import (
    All,
    Always,
    Any,
    At,
    AtLeast,
    Atom,
    Eventually,
    EveryNeighbour,
    EveryReach,
    EveryRoute,
    Is,
    Neighbour,
    Node,
    Not,
    PathLength,
    Reach,
    Release,
    Route,
    Until,
)


def children(node: Node) -> tuple[Node, ...]:
    """The nodes directly below, in order."""
    match node:
        case Atom() | Is() | PathLength():
            return ()
        case Not(body) | Always(body) | Eventually(body) | At(_, body) | Neighbour(_, body) | EveryNeighbour(_, body):
            return (body,)
        case All(parts) | Any(parts) | AtLeast(_, parts):
            return parts
        case Until(hold, end) | Release(hold, end):
            return (hold, end)
        case Reach() | EveryReach() | Route() | EveryRoute():
            return (node.through, node.end)
        case _:
            assert_never(node)


def more_than(most: int, roots: Iterable[Node]) -> bool:
    """Whether formulas have more than so many nodes, each counted once. The rest is not looked at."""
    seen: set[Node] = set()
    waiting = [iter(roots)]
    while waiting and len(seen) <= most:
        node = next(waiting[-1], None)
        if node is None:
            waiting.pop()
        elif node not in seen:
            seen.add(node)
            waiting.append(iter(children(node)))
    return len(seen) > most


def postorder(roots: Iterable[Node]) -> list[Node]:
    """Every node of these formulas once, each after the nodes below it. No formula is too deep for it."""
    order: list[Node] = []
    seen: set[Node] = set()
    stack: list[tuple[Node, bool]] = [(root, False) for root in reversed(tuple(roots))]
    while stack:
        node, below_done = stack.pop()
        if below_done:
            order.append(node)
        elif node not in seen:
            seen.add(node)
            stack.append((node, True))
            stack.extend((child, False) for child in reversed(children(node)))
    return order
