"""Residuals of one agent's formulas, progressed step by step along its trajectory: an automaton built on demand.

    in   formulas about one agent; the truth of their propositions at each step
    out  the residual, true or false at the last step

A *residual* is a conjunction or disjunction of open temporal operators with the first and last steps of their windows.
Equal residuals are one object. They are the states of an automaton that is built on demand. A relaxation has no
windows: every trajectory that satisfies a residual satisfies its relaxation. Relaxations have few states, so that a
distance to go can be computed for each.

Source:
    Bacchus and Kabanza, "Planning for temporally extended goals", 1998.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from typing import TypeAlias

from missionc.base.late_dataclass import Record
from missionc.ir.kernel.nodes import All, Any, At, AtLeast, Node, UntilNode, WindowNode
from missionc.ir.kernel.walk import window_of


class TooComplex(ValueError):
    """Error for formulas that depend on other agents, or that have too many residuals."""


class Open(Record):
    """Residual: a temporal operator with its window, from step ``first`` to ``last``; ``first`` is 0 once the window
    has begun."""

    node: Node
    first: int
    last: int


class NextResidual(Record):
    """Residual: a formula must be true at the next step."""

    node: Node


class EventuallyResidual(Record):
    """Relaxed residual: a formula must be true at some step after the current step."""

    node: Node


class AlwaysResidual(Record):
    """Relaxed residual: a formula must be true at every step after the current step."""

    node: Node


class UntilResidual(Record):
    """Relaxed residual: an ``until`` whose right side may become true at any step after the current step."""

    node: UntilNode


class Joined(Record):
    """Residual: at least ``count`` of the parts; a conjunction if ``count`` is the number of parts."""

    count: int
    parts: frozenset[Residual]


Residual: TypeAlias = "bool | Open | Joined | NextResidual | EventuallyResidual | AlwaysResidual | UntilResidual"
"""Residual; ``Open`` is not relaxed, ``EventuallyResidual``, ``AlwaysResidual`` and ``UntilResidual`` are."""

Letter: TypeAlias = "tuple[bool, ...]"
"""Truth of each proposition at one step."""


def conjoined(count: int, parts: Iterable[Residual]) -> Residual:
    """Residual that at least ``count`` of the parts are satisfied, simplified."""
    left: set[Residual] = set()
    for part in parts:
        if part is True:
            count -= 1
        elif part is not False:
            left.add(part)
    if count <= 0:
        return True
    if len(left) < count:
        return False
    return next(iter(left)) if len(left) == 1 else Joined(count, frozenset(left))


def meet(parts: Iterable[Residual]) -> Residual:
    """Conjunction of residuals, simplified."""
    left: set[Residual] = set()
    for part in parts:
        if part is False:
            return False
        if isinstance(part, Joined) and part.count == len(part.parts):
            left |= part.parts
        elif part is not True:
            left.add(part)
    strongest = _extreme(left, every=True)
    return conjoined(len(strongest), strongest)


def join(parts: Iterable[Residual]) -> Residual:
    """Disjunction of residuals, simplified."""
    left: set[Residual] = set()
    for part in parts:
        if part is True:
            return True
        if isinstance(part, Joined) and part.count == 1:
            left |= part.parts
        elif part is not False:
            left.add(part)
    weakest = _extreme(left, every=False)
    absorbed = {part for part in weakest if _conjuncts(part) & weakest - {part}}
    return conjoined(1, weakest - absorbed)


def _conjuncts(residual: Residual) -> frozenset[Residual]:
    alike = isinstance(residual, Joined) and residual.count == len(residual.parts)
    return residual.parts if alike and isinstance(residual, Joined) else frozenset()


def _extreme(parts: set[Residual], *, every: bool) -> set[Residual]:
    """Parts without redundant windows: among windows of one formula with the same first step, the strictest if
    ``every``, otherwise the weakest."""
    if len(parts) < 2:
        return parts
    kept: dict[object, Residual] = {}
    for part in parts:
        key: object = part
        if isinstance(part, Open) and isinstance(part.node, WindowNode):
            key = part.node.body, part.node.every, part.first
            other = kept.get(key)
            if isinstance(other, Open):
                longest = part.node.every == every  # a longer always is stricter, a longer eventually is weaker
                if (other.last > part.last) == longest or other.last == part.last:
                    continue
        kept[key] = part
    return set(kept.values())


@dataclass(slots=True, eq=False)
class Progression:
    """Progression of formulas about one agent, with cached results.

    Args:
        agent: mission index of the agent.
        proposition: function from a node to the index of its proposition about a single step; None for other nodes.
        last: last step of the mission.
    """

    agent: int
    proposition: Callable[[Node], int | None]
    last: int
    _known: dict[tuple[Residual, int, Letter], Residual] = field(default_factory=dict)

    def begin(self, formulas: Sequence[Node]) -> Residual:
        """Residual of a conjunction of formulas before the first step."""
        return meet(map(NextResidual, formulas))

    def after(self, residual: Residual, step: int, letter: Letter) -> Residual:
        """Residual after a step in which the propositions have the truth values ``letter``; True or False after the
        last step."""
        key = residual, step, letter
        if key not in self._known:
            self._known[key] = self._after(residual, step, letter)
        return self._known[key]

    def _after(self, residual: Residual, step: int, letter: Letter) -> Residual:
        match residual:
            case bool():
                return residual
            case Joined(count, parts):
                return _combined(count, [self.after(part, step, letter) for part in parts])
            case NextResidual(node):
                return self._asked(node, step, letter)
            case Open(node, first, last):
                return self._open(node, first, last, step, letter)
            case _:
                raise AssertionError(residual)

    def _asked(self, node: Node, step: int, letter: Letter) -> Residual:
        """Residual, after this step, of a formula that is evaluated at this step."""
        number = self.proposition(node)
        if number is not None:
            return letter[number]
        window = window_of(node)
        if window is not None:
            first, last = step + window[0], self.last if window[1] is None else step + window[1]
            # Past the last step nothing holds.
            return last <= self.last and first <= self.last and self._open(node, first, last, step, letter)
        match node:
            case At(agent, body) if agent == self.agent:
                return self._asked(body, step, letter)
            case All(parts) | Any(parts) | AtLeast(_, parts):
                count = node.count if isinstance(node, AtLeast) else len(parts) if node.every else 1
                return _combined(count, [self._asked(part, step, letter) for part in parts])
            case _:
                raise TooComplex

    def _open(self, node: Node, first: int, last: int, step: int, letter: Letter) -> Residual:
        """Residual, after this step, of a temporal operator whose window (``first`` to ``last``) has not ended
        before."""
        later: Residual = node.every if step >= last else Open(node, 0 if first <= step + 1 else first, last)
        match node:
            case WindowNode(body):
                now: Residual = self._asked(body, step, letter) if step >= first else node.every
                return (meet if node.every else join)((now, later))
            case UntilNode(hold, end):
                now = self._asked(end, step, letter) if step >= first else node.every
                if later is node.every:
                    return now
                held = self._asked(hold, step, letter)
                if node.every:
                    return meet((now, join((held, later))))
                return join((now, meet((held, later))))
            case _:
                raise TooComplex


def _combined(count: int, parts: Sequence[Residual]) -> Residual:
    if count == len(parts):
        return meet(parts)
    return join(parts) if count == 1 else conjoined(count, parts)


@dataclass(slots=True, eq=False)
class Relaxation:
    """Progression without time windows: a residual can be satisfied only if its relaxation can.

    Args:
        agent: mission index of the agent.
        proposition: function from a node to the index of its proposition; None for other nodes and for propositions of
            unknown truth.
        last: last step of the mission.
    """

    agent: int
    proposition: Callable[[Node], int | None]
    last: int
    _known: dict[tuple[Residual, Letter], Residual] = field(default_factory=dict)
    _relaxed: dict[Residual, Residual] = field(default_factory=dict)

    def of(self, residual: Residual) -> Residual:
        """Relaxation of a residual, independent of time."""
        if residual not in self._relaxed:
            self._relaxed[residual] = self._of(residual)
        return self._relaxed[residual]

    def _of(self, residual: Residual) -> Residual:
        match residual:
            case Joined(count, parts):
                return _combined(count, [self.of(part) for part in parts])
            case Open(WindowNode(body) as node, first, last):
                if not node.every or first:
                    return EventuallyResidual(body)
                return AlwaysResidual(body) if last == self.last else NextResidual(body)
            case Open(UntilNode() as node):
                return True if node.every else UntilResidual(node)
            case _:
                return residual

    def after(self, residual: Residual, letter: Letter) -> Residual:
        """Relaxed residual after a step in which the propositions have the truth values ``letter``."""
        key = residual, letter
        if key not in self._known:
            self._known[key] = self._after(residual, letter, last=False)
        return self._known[key]

    def ends(self, residual: Residual, letter: Letter) -> bool:
        """Return true if the residual may be satisfied when this step is the last."""
        return self._after(residual, letter, last=True) is not False

    def _after(self, residual: Residual, letter: Letter, *, last: bool) -> Residual:
        match residual:
            case Joined(count, parts):
                return _combined(count, [self._after(part, letter, last=last) for part in parts])
            case NextResidual(node):
                return self._asked(node, letter, last=last)
            case EventuallyResidual(node):
                return join((self._asked(node, letter, last=last), not last and residual))
            case AlwaysResidual(node):
                return meet((self._asked(node, letter, last=last), last or residual))
            case UntilResidual(node):
                return self._until(node, letter, last=last)
            case _:
                return residual

    def _asked(self, node: Node, letter: Letter, *, last: bool) -> Residual:
        number = self.proposition(node)
        if number is not None:
            return letter[number]
        match node:
            case At(_, body):
                return self._asked(body, letter, last=last)
            case All(parts) | Any(parts) | AtLeast(_, parts):
                count = node.count if isinstance(node, AtLeast) else len(parts) if node.every else 1
                return _combined(count, [self._asked(part, letter, last=last) for part in parts])
            case WindowNode(body, low, high) if low == 0 or last:
                now = self._asked(body, letter, last=last)
                if node.every:
                    return meet((now, AlwaysResidual(body))) if high is None and not last else now
                return join((now, not last and EventuallyResidual(body)))
            case WindowNode(body):
                return EventuallyResidual(body)
            case UntilNode() if not node.every:
                return self._until(node, letter, last=last)
            case _:
                return True

    def _until(self, node: UntilNode, letter: Letter, *, last: bool) -> Residual:
        now = self._asked(node.end, letter, last=last)
        return now if last else join((now, meet((self._asked(node.hold, letter, last=last), UntilResidual(node)))))
