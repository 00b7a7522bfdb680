"""Discrete relaxation of a mission for a roadmap: its requirements without what is measured, on a coarser clock.

    in   Kernel
    out  Discrete: a Kernel that every plan of the mission satisfies, up to the rounding of windows

A formation, or a length in metres, is hardly ever met from node to node. It is taken to be
as it should be, whichever way it is asked. What is left follows from
the requirement, so that where it cannot hold on a roadmap the whole cannot either.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import ceil, floor

from missionc.ir import Predicate
from missionc.kernel.analysis import reads_lengths, steps_ahead
from missionc.kernel.evaluate import Domain, evaluate
from missionc.kernel.nodes import (
    All,
    Any,
    At,
    AtLeast,
    Atom,
    Goal,
    Is,
    Kernel,
    NeighbourNode,
    Node,
    Not,
    PathLength,
    ReachNode,
    RouteNode,
    UntilNode,
    WindowNode,
)
from missionc.kernel.walk import postorder

YES, NO = All(()), Any(())

SLACK = 1e-9
"""The share of a step that rounding alone may make of a whole number of them."""


@dataclass(frozen=True, slots=True)
class Clock:
    """``ticks`` of the roadmap for the ``steps`` of the mission. ``careful``: windows may become longer by rounding."""

    steps: int
    ticks: int
    careful: bool = True

    def window(self, low: int, high: int | None, every: bool) -> tuple[int, int | None]:
        """A window in ticks: no shorter for what holds at ``every`` step of it, within it for what holds at some."""
        first, last = low * self.ticks / self.steps, None if high is None else high * self.ticks / self.steps
        if every:
            begin, end = floor(first + SLACK), None
            if last is not None:
                end = ceil(last - SLACK) if self.careful else floor(last + SLACK)
        else:
            begin, end = ceil(first - SLACK), None if last is None else floor(last + SLACK)
            begin = min(begin, self.ticks)
            if end is not None and begin > end:
                begin = end
        return begin, end


@dataclass(frozen=True, slots=True, eq=False)
class Discrete:
    """``whole``: by name, the requirements in which nothing is measured."""

    kernel: Kernel
    whole: frozenset[str]


def discrete(kernel: Kernel, steps: int, ticks: int) -> Discrete:
    """What a roadmap of so many ``ticks`` can be asked for of a mission of so many ``steps``."""
    goals = _goals(kernel, Clock(steps, ticks))
    ahead = steps_ahead(goal.formula for goal in goals)
    if any(ahead[goal.formula] > ticks for goal in goals):
        goals = _goals(kernel, Clock(steps, ticks, careful=False))
    whole = frozenset(goal.name for goal in kernel.requirements if not any(map(_measures, postorder((goal.formula,)))))
    return Discrete(Kernel(tuple(goal for goal in goals if goal.formula is not YES), ()), whole)


def _measures(node: Node) -> bool:
    return reads_lengths(node) or (isinstance(node, Atom) and node.predicate.is_exact)


def _goals(kernel: Kernel, clock: Clock) -> list[Goal]:
    relaxations = evaluate((goal.formula for goal in kernel.requirements), Relaxation(clock))
    return [Goal(goal.name, relaxations[goal.formula], goal.span) for goal in kernel.requirements]


@dataclass(frozen=True, slots=True)
class Relaxation(Domain[Node]):
    """The domain of what is asked for in place of a formula; ``YES`` and ``NO`` are settled."""

    clock: Clock

    def atom(self, predicate: Predicate, holds: bool) -> Node:
        return YES if predicate.is_exact else _signed(Atom(predicate), holds)

    def member(self, agents: frozenset[int], holds: bool) -> Node:
        return _signed(Is(agents), holds)

    def path_length(self, node: PathLength, holds: bool) -> Node:
        return YES

    def meet(self, parts: Sequence[Node]) -> Node:
        left = tuple(part for part in parts if part is not YES)
        return NO if NO in left else All(left) if left else YES

    def join(self, parts: Sequence[Node]) -> Node:
        left = tuple(part for part in parts if part is not NO)
        return YES if YES in left else Any(left) if left else NO

    def at_least(self, count: int, parts: Sequence[Node]) -> Node:
        count -= sum(part is YES for part in parts)
        left = tuple(part for part in parts if not _settled(part))
        return YES if count <= 0 else NO if count > len(left) else AtLeast(count, left)

    def window(self, node: WindowNode, body: Node) -> Node:
        low, high = self.clock.window(node.low, node.high, node.every)
        return body if _settled(body) else replace(node, body=body, low=low, high=high)

    def until(self, node: UntilNode, hold: Node, end: Node) -> Node:
        low, high = self.clock.window(node.low, node.high, node.every)
        return end if end is (YES if node.every else NO) else replace(node, hold=hold, end=end, low=low, high=high)

    def at(self, agent: int, body: Node) -> Node:
        return body if _settled(body) else At(agent, body)

    def neighbour(self, node: NeighbourNode, body: Node) -> Node:
        return body if body is (YES if node.every else NO) else replace(node, body=body)

    def reach(self, node: ReachNode, through: Node, end: Node) -> Node:
        return end if _settled(end) else replace(node, through=through, end=end)

    def route(self, node: RouteNode, through: Node, end: Node) -> Node:
        return YES


def _signed(leaf: Node, holds: bool) -> Node:
    return leaf if holds else Not(leaf)


def _settled(node: Node) -> bool:
    return node is YES or node is NO
