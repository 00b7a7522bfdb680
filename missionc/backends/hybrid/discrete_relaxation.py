"""What of a mission a roadmap can be asked for: its requirements without what is measured, on the roadmap's clock.

    in   Kernel
    out  Discrete: a Kernel that every plan of the mission satisfies, up to the rounding of windows

A formation, or a length in metres, is hardly ever met from node to node. It is taken to be
as it should be, true where that makes the requirement hold and false where that does. What is left follows from
the requirement, so that where it cannot hold on a roadmap the whole cannot either.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from math import ceil, floor
from typing import TypeAlias, assert_never

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
    Goal,
    Is,
    Kernel,
    Neighbour,
    Node,
    Not,
    PathLength,
    Reach,
    Route,
    Until,
)
from missionc.kernel.walk import children, postorder

YES, NO = All(()), Any(())

SLACK = 1e-9
"""Of a step: what rounding alone may make of a whole number of them."""

Known: TypeAlias = dict[tuple[Node, bool], Node]


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
        case Atom(InFormation()) | Route() | PathLength():
            return True
        case _:
            return False


def _goals(kernel: Kernel, nodes: Iterable[Node], clock: Clock) -> list[Goal]:
    known: Known = {}
    for node in nodes:
        for holds in (True, False):
            known[node, holds] = _asked(node, holds, known, clock)
    return [Goal(goal.name, known[goal.formula, True], goal.span) for goal in kernel.requirements]


def _asked(node: Node, holds: bool, known: Known, clock: Clock) -> Node:
    """What is asked for in place of a node that should hold, or should not."""
    match node:
        case _ if _measures(node):
            return YES if holds else NO
        case Atom() | Is():
            return node
        case Not(body, span):
            asked = known[body, not holds]
            return NO if asked is YES else YES if asked is NO else Not(asked, span)
        case All(parts):
            return _joined(node, [known[part, holds] for part in parts], YES, NO)
        case Any(parts):
            return _joined(node, [known[part, holds] for part in parts], NO, YES)
        case AtLeast(count, parts, span):
            each = [known[part, holds] for part in parts]
            left = count - sum(part is YES for part in each)
            open_ = tuple(part for part in each if part is not YES and part is not NO)
            return YES if left <= 0 else NO if left > len(open_) else AtLeast(left, open_, span)
        case Always(body, low, high, span):
            begin, end = clock.window(low, high, every=holds)
            return _unless_settled(known[body, holds], lambda asked: Always(asked, begin, end, span))
        case Eventually(body, low, high, span):
            begin, end = clock.window(low, high, every=not holds)
            return _unless_settled(known[body, holds], lambda asked: Eventually(asked, begin, end, span))
        case Until(hold, end_, low, high, span):
            begin, end = clock.window(low, high, every=not holds)
            return NO if known[end_, holds] is NO else Until(known[hold, holds], known[end_, holds], begin, end, span)
        case Neighbour(graph, body, span):
            return NO if known[body, holds] is NO else Neighbour(graph, known[body, holds], span)
        case Reach(graph, through, end_, hops, span):
            return _unless_settled(
                known[end_, holds], lambda asked: Reach(graph, known[through, holds], asked, hops, span)
            )
        case At(agent, body, span):
            return _unless_settled(known[body, holds], lambda asked: At(agent, asked, span))
        case Route() | PathLength():
            raise AssertionError("measured")
        case _:
            assert_never(node)


def _joined(node: All | Any, parts: list[Node], neutral: Node, decisive: Node) -> Node:
    """A conjunction or disjunction without the parts that are settled."""
    if any(part is decisive for part in parts):
        return decisive
    kept = tuple(part for part in parts if part is not neutral)
    return type(node)(kept, node.span) if kept else neutral


def _unless_settled(body: Node, around: Callable[[Node], Node]) -> Node:
    return body if body is YES or body is NO else around(body)
