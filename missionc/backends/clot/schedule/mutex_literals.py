"""Mutually exclusive literals of holds, and capacities: limits on the number of literals that are true at once.

A literal states that a predicate is true, or false, for an agent. A literal and its opposite are *mutex*, and so are
two predicates without a common position (``altitude <= 20 m`` and ``altitude >= 40 m``). ``always not (at least 3
truck: weigh)`` is a *capacity* of two, and ``always not (a and b)`` a capacity of one.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from functools import lru_cache
from typing import TypeAlias

from missionc.backends.clot.schedule.tasks import Hold, Outline, conjuncts
from missionc.base.late_dataclass import Record
from missionc.ir import Predicate
from missionc.ir.kernel.nodes import Any, At, AtLeast, Atom, Node, Not

Literal: TypeAlias = tuple[int, Predicate, bool]
"""Literal: an agent (-1 for the team), a predicate and its truth."""

TEAM = -1

KNOWN = 4096
"""Maximum number of cached sets of literals."""

ROUNDING = 1e-6
"""Seconds below which differences do not count."""


class TimedLiterals(Record):
    """Literals that a hold requires at all times from ``low`` to ``high`` seconds, both included.

    ``gap``: time before and after, seconds, in which the literals are also true.
    """

    literals: frozenset[Literal]
    low: float
    high: float
    gap: float = 0.0

    def shifted(self, by: float) -> TimedLiterals:
        return TimedLiterals(self.literals, self.low + by, self.high + by, self.gap)

    def mutex_time(self, other: TimedLiterals) -> float | None:
        """Duration, seconds, for which these literals are mutex with the others; None if never, 0 for a single time."""
        both = min(self.high + self.gap, other.high + other.gap) - max(self.low - self.gap, other.low - other.gap)
        if both < 0 or _opposites(self.literals).isdisjoint(other.literals):
            return None
        return both


@lru_cache(KNOWN)
def _opposites(literals: frozenset[Literal]) -> frozenset[Literal]:
    return frozenset((agent, what, not holds) for agent, what, holds in literals)


class Capacity(Record):
    """At most ``most`` of some literals may be true at once from ``low`` to ``high`` seconds.

    ``passing``: time before and after, seconds, in which a literal may also be true.
    """

    literals: frozenset[Literal]
    most: int
    low: float
    high: float
    passing: float

    def until(self, one: TimedLiterals, others: Iterable[TimedLiterals]) -> float | None:
        """Earliest time, seconds, at which ``one`` fits into the capacity beside others; None if it already fits."""
        mine = self.literals & one.literals
        if not mine or one.low > self.high or one.high < self.low:
            return None
        spans = [
            (each.low - self.passing, each.high + self.passing, self.literals & each.literals)
            for each in others
            if abs(each.low + each.high - one.low - one.high)
            <= one.high - one.low + each.high - each.low + 4 * self.passing
            and not self.literals.isdisjoint(each.literals)
        ]
        begin, end = one.low - self.passing, one.high + self.passing
        for moment in sorted({begin, *(low for low, _, _ in spans if begin < low <= end)}):
            there = [(high, said) for low, high, said in spans if low <= moment < high - ROUNDING]
            if len(mine.union(*(said for _, said in there))) > self.most:
                return min(high for high, said in there if not said <= mine) + self.passing
        return None


def capacities(holds: Iterable[Hold], step: float, passing: float) -> tuple[Capacity, ...]:
    """Capacities that holds imply.

    Args:
        step: duration of a step, seconds.
        passing: time before and after a literal, seconds, in which it may also be true.
    """
    found: list[Capacity] = []
    for hold in holds:
        if isinstance(hold.node, Any | AtLeast):
            denied = [_literal(hold.agent, part) for part in hold.node.parts]
            opposite = frozenset((agent, what, not holds) for agent, what, holds in filter(None, denied))
            if len(opposite) == len(denied) > 1:
                most = len(denied) - (hold.node.count if isinstance(hold.node, AtLeast) else 1)
                found.append(Capacity(opposite, most, hold.low * step, hold.high * step, passing))
    return tuple(found)


Denials: TypeAlias = dict[Literal, dict[Literal, float]]
"""For each literal that others may exclude, the literals that it implies (itself, or opposites of excluded literals),
with the seconds before and after in which they are also true."""


def denials(outline: Outline, apart: Callable[[int, Predicate, Predicate], float]) -> Denials:
    """Literals of an outline that other literals in it may exclude.

    Args:
        apart: function to the least travel time of an agent between the sets of two predicates, seconds. The function
            is used if one of the predicates must be true for a while.
    """
    visits = [hold for event in outline.events for hold in event.holds]
    lasting = [*outline.fixed, *(hold for event in outline.events for hold in event.before)]
    long = {literal for hold in lasting for literal in literals(hold.agent, hold.node)}
    everything = long.union(literal for hold in visits for literal in literals(hold.agent, hold.node))
    found: Denials = {}
    true_of: dict[int, list[Predicate]] = {}
    for agent, what, holds in everything:
        if (agent, what, not holds) in everything:
            found.setdefault((agent, what, holds), {})[agent, what, holds] = 0.0
        if holds and agent != TEAM:
            true_of.setdefault(agent, []).append(what)
    for agent, what, holds in long:
        for other in true_of.get(agent, ()) if holds else ():
            seconds = 0.0 if other is what else apart(agent, what, other)
            if seconds > 0:
                found.setdefault((agent, what, True), {})[agent, other, False] = seconds
                found.setdefault((agent, other, True), {})[agent, other, True] = 0.0
    return found


def timed_literals(holds: Iterable[Hold], denied: Denials, step: float) -> tuple[TimedLiterals, ...]:
    """Literals that holds imply and others may exclude, with their times in seconds.

    Args:
        step: duration of a step, seconds.
    """
    timed: list[TimedLiterals] = []
    for hold in holds if denied else ():
        said: dict[float, set[Literal]] = {}
        for literal in literals(hold.agent, hold.node):
            for implied, gap in denied.get(literal, {}).items():
                said.setdefault(gap, set()).add(implied)
        timed.extend(
            TimedLiterals(frozenset(each), hold.low * step, hold.high * step, gap) for gap, each in said.items()
        )
    return tuple(timed)


def earliest_time(
    says: Iterable[TimedLiterals],
    begin: float,
    sure: Iterable[TimedLiterals],
    capacities: Iterable[Capacity],
    step: float,
) -> float:
    """Earliest time from ``begin`` on, seconds, at which certain literals exclude none of the literals ``says``."""
    while True:
        later: list[float] = []
        for each in says:
            here = each.shifted(begin)
            low, high = here.low - here.gap, here.high + here.gap
            meanwhile = [other for other in sure if other.low - other.gap <= high and other.high + other.gap >= low]
            later += [
                other.high + other.gap + each.gap - each.low + step
                for other in meanwhile
                if here.mutex_time(other) is not None
            ]
            untils = [capacity.until(here, sure) for capacity in capacities]
            later += [until - each.low for until in untils if until is not None]
        if not later:
            return begin
        begin = max(later)


def mutex_seconds(one: TimedLiterals, others: Iterable[TimedLiterals], step: float) -> float:
    """Duration, seconds, for which literals are mutex with others."""
    denied = [one.mutex_time(other) for other in others]
    return sum(each + step for each in denied if each is not None)


def _literal(agent: int, node: Node) -> Literal | None:
    """Literal that is equivalent to a formula for an agent; None for other formulas."""
    while isinstance(node, At):
        agent, node = node.agent, node.body
    if isinstance(node, Atom | Not) and len(said := list(literals(agent, node))) == 1:
        return said[0]
    return None


def literals(agent: int, node: Node) -> Iterator[Literal]:
    """Yield the literals that a formula for an agent implies."""
    for who, part in conjuncts(agent, node):
        if isinstance(part, Atom | Not) and isinstance(leaf := part.body if isinstance(part, Not) else part, Atom):
            yield TEAM if leaf.predicate.about_team else who, leaf.predicate, isinstance(part, Atom)
