"""Literals of holds that deny each other: a literal and its opposite, and more at once than may hold.

A literal is that a predicate holds of an agent, or that it does not; it and its opposite are *mutex*. Of those that
``always not (at least 3 truck: weigh)`` is about, two at once are the most: a *capacity*.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import TypeAlias

from missionc.backends.clot.schedule.tasks import Hold, Outline
from missionc.ir import Predicate
from missionc.kernel.nodes import All, Any, At, AtLeast, Atom, Node, Not

Literal: TypeAlias = tuple[int, Predicate, bool]
"""A literal: an agent, or -1 for the team; a predicate; and whether it holds."""

TEAM = -1

ROUNDING = 1e-6
"""Seconds that do not count."""


@dataclass(frozen=True, slots=True)
class TimedLiterals:
    """The literals that a hold requires at every moment from ``low`` to ``high``, both included; seconds."""

    literals: frozenset[Literal]
    low: float
    high: float

    def shifted(self, by: float) -> TimedLiterals:
        return TimedLiterals(self.literals, self.low + by, self.high + by)

    def mutex_time(self, other: TimedLiterals) -> float | None:
        """For how many seconds it is mutex with the other; None where it never is, 0 for one moment."""
        both = min(self.high, other.high) - max(self.low, other.low)
        if both < 0 or not any((agent, what, not holds) in other.literals for agent, what, holds in self.literals):
            return None
        return both


@dataclass(frozen=True, slots=True)
class Capacity:
    """At most so many of some literals, each of another agent, hold at once from ``low`` to ``high``, seconds.

    ``passing``: seconds before one of them is to hold, and after, in which it may hold as well.
    """

    literals: frozenset[Literal]
    most: int
    low: float
    high: float
    passing: float

    def until(self, one: TimedLiterals, others: Iterable[TimedLiterals]) -> float | None:
        """The time from which there is room for one among others, seconds; None where there is."""
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
    """How many literals may hold at once by what holds say; ``step`` and ``passing`` are seconds."""
    found: list[Capacity] = []
    for hold in holds:
        if isinstance(hold.node, Any | AtLeast):
            denied = [_literal(hold.agent, part) for part in hold.node.parts]
            opposite = frozenset((agent, what, not holds) for agent, what, holds in filter(None, denied))
            if len({agent for agent, _, _ in opposite}) == len(denied) > 1:
                most = len(denied) - (hold.node.count if isinstance(hold.node, AtLeast) else 1)
                found.append(Capacity(opposite, most, hold.low * step, hold.high * step, passing))
    return tuple(found)


def mutex_literals(outline: Outline) -> frozenset[Literal]:
    """The literals of an outline whose opposites are in it too, somewhere."""
    events = [event for task in outline.tasks for option in task.options for event in option.events]
    holds = [*outline.holds, *(hold for task in outline.tasks for option in task.options for hold in option.holds)]
    while events:
        event = events.pop()
        holds.extend((*event.holds, *event.before))
        events.extend(event.then)
    everything = {literal for hold in holds for literal in literals(hold.agent, hold.node)}
    return frozenset(literal for literal in everything if (literal[0], literal[1], not literal[2]) in everything)


def timed_literals(holds: Iterable[Hold], among: frozenset[Literal], step: float) -> tuple[TimedLiterals, ...]:
    """The literals of holds, as far as they are among these; ``step`` is seconds, and so are the results' times."""
    timed: list[TimedLiterals] = []
    for hold in holds if among else ():
        said = among.intersection(literals(hold.agent, hold.node))
        if said:
            timed.append(TimedLiterals(said, hold.low * step, hold.high * step))
    return tuple(timed)


def earliest_time(
    says: Iterable[TimedLiterals],
    begin: float,
    sure: Iterable[TimedLiterals],
    capacities: Iterable[Capacity],
    step: float,
) -> float:
    """The earliest time from ``begin`` on at which nothing that is sure denies any of the literals; seconds."""
    while True:
        later: list[float] = []
        for each in says:
            here = each.shifted(begin)
            later += [other.high - each.low + step for other in sure if here.mutex_time(other) is not None]
            untils = [capacity.until(here, sure) for capacity in capacities]
            later += [until - each.low for until in untils if until is not None]
        if not later:
            return begin
        begin = max(later)


def mutex_seconds(one: TimedLiterals, others: Iterable[TimedLiterals], step: float) -> float:
    """For how many seconds one is mutex with others."""
    denied = [one.mutex_time(other) for other in others]
    return sum(each + step for each in denied if each is not None)


def _literal(agent: int, node: Node) -> Literal | None:
    """The literal that a formula asked of an agent is; None where it is none of one agent."""
    while isinstance(node, At):
        agent, node = node.agent, node.body
    if isinstance(node, Atom | Not) and len(said := list(literals(agent, node))) == 1 and said[0][0] != TEAM:
        return said[0]
    return None


def literals(agent: int, node: Node) -> Iterator[Literal]:
    """The literals that a formula asked of an agent requires, each by itself."""
    stack = [(agent, node)]
    while stack:
        agent, node = stack.pop()
        match node:
            case Atom(predicate) | Not(Atom(predicate)):
                yield TEAM if predicate.about_team else agent, predicate, isinstance(node, Atom)
            case All(parts):
                stack.extend((agent, part) for part in parts)
            case At(other, body):
                stack.append((other, body))
            case _:
                pass
