"""Discrete relaxation of a mission for a roadmap: its requirements without what is measured, on a coarser clock.

    in   Kernel
    out  Discrete: a Kernel that every plan of the mission satisfies, up to the rounding of windows

A formation, or a length in metres, is hardly ever met from node to node. It is taken to be
as it should be, whichever way it is asked. What is left follows from
the requirement, so that where it cannot hold on a roadmap the whole cannot either.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import ceil, floor

from missionc.kernel.analysis import reads_lengths, steps_ahead
from missionc.kernel.constants import YES, constant, folded
from missionc.kernel.nodes import Atom, Goal, Kernel, Node, Not, PathLength, RouteNode, UntilNode, WindowNode
from missionc.kernel.walk import bottom_up, postorder

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
    return Discrete(Kernel(tuple(goal for goal in goals if constant(goal.formula) is not True), ()), whole)


def _measures(node: Node) -> bool:
    return reads_lengths(node) or (isinstance(node, Atom) and node.predicate.is_exact)


def _goals(kernel: Kernel, clock: Clock) -> list[Goal]:
    formulas = (goal.formula for goal in kernel.requirements)
    relaxed = bottom_up(formulas, lambda node, parts: _relaxed(node, parts, clock))
    return [Goal(goal.name, relaxed[goal.formula], goal.span) for goal in kernel.requirements]


def _relaxed(node: Node, parts: tuple[Node, ...], clock: Clock) -> Node:
    """A formula over relaxed ones, on the clock of the roadmap."""
    match node:
        case PathLength() | Not(PathLength()) | RouteNode():
            return YES
        case Atom(predicate) | Not(Atom(predicate)) if predicate.is_exact:
            return YES
        case WindowNode() | UntilNode():
            low, high = clock.window(node.low, node.high, node.every)
            return folded(replace(node, low=low, high=high), parts)
        case _:
            return folded(node, parts)
