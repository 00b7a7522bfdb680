"""Choices that a plan makes once: disjunctions evaluated at one step, or over one window after an event.

    in   formulas about the team
    out  the nodes and agents of such choices; formulas without some of their branches

If a formula must hold over a window after an event (``eventually always[0, 2 s] (a or b)``), a plan may choose one
branch for the whole window. A choice at every step of another window, or for every neighbour, is not listed here: it
depends on the trajectory.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import NamedTuple

from missionc.ir.kernel.nodes import All, Always, Any, At, AtLeast, Node, WindowNode
from missionc.ir.kernel.walk import awaited, children, rebuilt


class ChoicePoint(NamedTuple):
    """Choice of a plan: a node and the agent for which the node is evaluated.

    Args:
        low, high: steps, counted from the event, over which the node must hold; ``high`` None: to the last step.
        event: True if the steps count from an event at a step that the plan chooses, False if from step 0.
    """

    node: Node
    agent: int
    low: int = 0
    high: int | None = 0
    event: bool = False

    @property
    def once(self) -> bool:
        """True if the node is evaluated at one step only."""
        return self.low == self.high


def made_once(formula: Node) -> Iterator[ChoicePoint]:
    """Yield the choice points of a formula about the team, each node before its children."""
    stack, seen = [ChoicePoint(formula, 0)], set[ChoicePoint]()
    while stack:
        asked = stack.pop()
        if asked in seen:
            continue
        seen.add(asked)
        yield asked
        stack.extend(reversed(_below(asked)))


def branches(asked: ChoicePoint) -> tuple[ChoicePoint, ...]:
    """Choice points of the parts between which a plan chooses; empty if the node is no choice."""
    match asked.node:
        case Any(parts) | AtLeast(_, parts) if len(parts) > _needed(asked.node):
            return tuple(asked._replace(node=part) for part in parts)
        case _:
            return ()


def witnesses(asked: ChoicePoint) -> int:
    """Number of branches of a choice point that must be true."""
    return _needed(asked.node)


def kept(asked: ChoicePoint) -> Node:
    """Formula, evaluated at the event's step, that the node holds over its whole window.

    The formula is the node itself for a window of the event's step only, and a new node otherwise.
    """
    return asked.node if asked.low == asked.high == 0 else Always(asked.node, asked.low, asked.high)


def without(formula: Node, removed: Mapping[ChoicePoint, frozenset[int]]) -> Node:
    """Formula without the given branches of its choices (by branch number); the same node if it has none of the
    branches."""
    made: dict[ChoicePoint, Node] = {}
    stack = [ChoicePoint(formula, 0)]
    while stack:
        asked = stack[-1]
        below = _below(asked)
        waiting = [each for each in below if each not in made]
        if waiting and asked not in made:
            stack.extend(waiting)
            continue
        stack.pop()
        made[asked] = _rewritten(asked, [made[each] for each in below], removed.get(asked, frozenset()))
    return made[ChoicePoint(formula, 0)]


def _below(asked: ChoicePoint) -> list[ChoicePoint]:
    node = asked.node
    match node:
        case All(parts) | Any(parts) | AtLeast(_, parts):
            return [asked._replace(node=part) for part in parts]
        case At(other, body):
            return [asked._replace(node=body, agent=other)]
        case WindowNode(body, low, high) if node.every and asked.event and low >= 0:
            last = None if asked.high is None or high is None else asked.high + high
            return [asked._replace(node=body, low=asked.low + low, high=last)]
        case _:
            ask = awaited(node) if asked.once else None
            return [] if ask is None else [ChoicePoint(ask.node, asked.agent, event=True)]


def _needed(node: Node) -> int:
    return node.count if isinstance(node, AtLeast) else 1


def _rewritten(asked: ChoicePoint, below: list[Node], removed: frozenset[int]) -> Node:
    node = asked.node
    match node:
        case Any() | AtLeast() if removed:
            return rebuilt(node, tuple(part for number, part in enumerate(below) if number not in removed))
        case _ if not below or all(new is old.node for new, old in zip(below, _below(asked), strict=True)):
            return node
        case _:
            return rebuilt(node, (*children(node)[: -len(below)], *below))
