"""Mutex literals of holds: of one agent and one predicate, both that it holds and that it does not."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import TypeAlias

from missionc.backends.clot.cost_graph.cost_graph import (
    Least,
    Margin,
    Of,
    Term,
)
from missionc.backends.clot.schedule.tasks import Hold, Outline
from missionc.ir import Predicate

Saying: TypeAlias = tuple[int, Predicate, bool]
"""A literal: an agent, or -1 for the team; a predicate; and whether it holds."""

TEAM = -1


@dataclass(frozen=True, slots=True)
class Said:
    """What a hold says at every moment from ``low`` to ``high``, both included."""

    sayings: frozenset[Saying]
    low: float
    high: float

    def shifted(self, by: float) -> Said:
        return Said(self.sayings, self.low + by, self.high + by)

    def denies(self, other: Said) -> float | None:
        """For how long it says the opposite of the other; None where it never does, 0 for one moment."""
        both = min(self.high, other.high) - max(self.low, other.low)
        if both < 0 or not any((agent, what, not holds) in other.sayings for agent, what, holds in self.sayings):
            return None
        return both


def opposed(outline: Outline) -> frozenset[Saying]:
    """Everything an outline says of which it also says the opposite, somewhere."""
    events = [event for task in outline.tasks for option in task.options for event in option.events]
    holds = [*outline.holds, *(hold for task in outline.tasks for option in task.options for hold in option.holds)]
    while events:
        event = events.pop()
        holds.extend((*event.holds, *event.before))
        events.extend(event.then)
    everything = {saying for hold in holds for saying in _sayings(hold.agent, hold.term)}
    return frozenset(saying for saying in everything if (saying[0], saying[1], not saying[2]) in everything)


def said(holds: Iterable[Hold], among: frozenset[Saying], step: float) -> tuple[Said, ...]:
    """What holds say, as far as it is among these sayings; ``step`` is seconds, and so are the results' times."""
    found: list[Said] = []
    for hold in holds if among else ():
        sayings = among.intersection(_sayings(hold.agent, hold.term))
        if sayings:
            found.append(Said(sayings, hold.low * step, hold.high * step))
    return tuple(found)


def waiting(says: Iterable[Said], begin: float, sure: Iterable[Said], step: float) -> float:
    """The soonest time from ``begin`` at which nothing that is sure denies what is said from then on; seconds."""
    while True:
        later = [
            other.high - each.low + step
            for each in says
            for other in sure
            if each.shifted(begin).denies(other) is not None
        ]
        if not later:
            return begin
        begin = max(later)


def amiss_by(one: Said, others: Iterable[Said], step: float) -> float:
    """For how many seconds one is denied by others."""
    denied = [one.denies(other) for other in others]
    return sum(each + step for each in denied if each is not None)


def _sayings(agent: int, term: Term) -> Iterator[Saying]:
    stack = [(agent, term)]
    while stack:
        agent, term = stack.pop()
        match term:
            case Margin(predicate, holds):
                yield TEAM if predicate.about_team else agent, predicate, holds
            case Least(parts):
                stack.extend((agent, part) for part in parts)
            case Of(other, body):
                stack.append((other, body))
            case _:
                pass
