"""Discrete relaxation of a mission for a roadmap: its requirements without what is measured, on a coarser clock.

    in   Kernel
    out  Discrete: a Kernel that every plan of the mission satisfies, up to the rounding of windows

A formation, or a length in metres, is hardly ever met from node to node. It is taken to be
as it should be, whichever way it is asked. What is left follows from
the requirement, so that where it cannot hold on a roadmap the whole cannot either.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from math import ceil, floor
from typing import assert_never

from missionc.ir import InFormation
from missionc.kernel.analysis import steps_ahead
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
    Goal,
    Is,
    Kernel,
    Neighbour,
    Node,
    Not,
    PathLength,
    Reach,
    Release,
    Route,
    Until,
)
from missionc.kernel.normal_form import rebuilt
from missionc.kernel.walk import children, postorder

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
    nodes = postorder(goal.formula for goal in kernel.requirements)
    measured = set[Node]()
    for node in nodes:
        if _measures(node) or any(child in measured for child in children(node)):
            measured.add(node)
    goals = _goals(kernel, nodes, Clock(steps, ticks))
    ahead = steps_ahead(goal.formula for goal in goals)
    if any(ahead[goal.formula] > ticks for goal in goals):
        goals = _goals(kernel, nodes, Clock(steps, ticks, careful=False))
    whole = frozenset(goal.name for goal in kernel.requirements if goal.formula not in measured)
    return Discrete(Kernel(tuple(goal for goal in goals if goal.formula is not YES), ()), whole)


def _measures(node: Node) -> bool:
    match node:
        case Atom(InFormation()) | Route() | EveryRoute() | PathLength():
            return True
        case Not(body):
            return _measures(body)
        case _:
            return False


def _goals(kernel: Kernel, nodes: Iterable[Node], clock: Clock) -> list[Goal]:
    known: dict[Node, Node] = {}
    for node in nodes:
        known[node] = _asked(node, tuple(known[child] for child in children(node)), clock)
    return [Goal(goal.name, known[goal.formula], goal.span) for goal in kernel.requirements]


def _asked(node: Node, below: tuple[Node, ...], clock: Clock) -> Node:
    """What is asked for in place of a node, over what is in place of those below it."""
    match node:
        case _ if _measures(node):
            return YES
        case Atom() | Is() | Not():
            return node
        case All():
            return _joined(node, list(below), YES, NO)
        case Any():
            return _joined(node, list(below), NO, YES)
        case AtLeast(count):
            left = count - sum(part is YES for part in below)
            open_ = tuple(part for part in below if part is not YES and part is not NO)
            return YES if left <= 0 else NO if left > len(open_) else replace(node, count=left, parts=open_)
        case Until(_, _, low, high) | Release(_, _, low, high):
            settled = NO if isinstance(node, Until) else YES
            return settled if below[1] is settled else _on_clock(rebuilt(node, below), low, high, clock)
        case Neighbour() | EveryNeighbour():
            settled = NO if isinstance(node, Neighbour) else YES
            return settled if below[0] is settled else rebuilt(node, below)
        case _ if below[-1] is YES or below[-1] is NO:
            return below[-1]
        case Always(_, low, high) | Eventually(_, low, high):
            return _on_clock(rebuilt(node, below), low, high, clock)
        case Reach() | EveryReach() | At():
            return rebuilt(node, below)
        case Route() | EveryRoute() | PathLength():
            raise AssertionError("measured")
        case _:
            assert_never(node)


def _on_clock(node: Node, low: int, high: int | None, clock: Clock) -> Node:
    """A window in ticks."""
    assert isinstance(node, Always | Eventually | Until | Release)
    begin, end = clock.window(low, high, every=isinstance(node, Always | Release))
    return replace(node, low=begin, high=end)


def _joined(node: All | Any, parts: list[Node], neutral: Node, decisive: Node) -> Node:
    """A conjunction or disjunction without the parts that are settled."""
    if any(part is decisive for part in parts):
        return decisive
    kept = tuple(part for part in parts if part is not neutral)
    return replace(node, parts=kept) if kept else neutral
