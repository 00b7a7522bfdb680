"""Mutex literals of holds: of one agent and one predicate, both that it holds and that it does not."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import TypeAlias

from missionc.backends.clot.schedule.tasks import Hold, Outline
from missionc.ir import Predicate
from missionc.kernel.nodes import All, At, Atom, Node, Not

Literal: TypeAlias = tuple[int, Predicate, bool]
"""A literal: an agent, or -1 for the team; a predicate; and whether it holds."""

TEAM = -1


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


def earliest_time(says: Iterable[TimedLiterals], begin: float, sure: Iterable[TimedLiterals], step: float) -> float:
    """The earliest time from ``begin`` on at which no literal is mutex with those that are sure; seconds."""
    while True:
        later = [
            other.high - each.low + step
            for each in says
            for other in sure
            if each.shifted(begin).mutex_time(other) is not None
        ]
        if not later:
            return begin
        begin = max(later)


def mutex_seconds(one: TimedLiterals, others: Iterable[TimedLiterals], step: float) -> float:
    """For how many seconds one is mutex with others."""
    denied = [one.mutex_time(other) for other in others]
    return sum(each + step for each in denied if each is not None)


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
