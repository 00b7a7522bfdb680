"""Least tours: what an agent takes at least to be at several places at their times, in the best order there is.

in   for each stop when it is due, and how far it is from the start and from every other
out  for each set of stops the least metres, and the fewest steps until the agent need not move any more

Source:
    Held and Karp, "A dynamic programming approach to sequencing problems", 1962, here with windows of time.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from missionc.base.late_dataclass import dataclass


@dataclass(frozen=True, slots=True)
class Due:
    """The steps of which one is that of a stop."""

    low: int
    high: int


@dataclass(frozen=True, slots=True)
class Legs:
    """The least of a kind, metres or whole steps: from the start to each stop, and from each stop to each other."""

    first: Sequence[float]
    between: Sequence[Sequence[float]]


def least_metres(due: Sequence[Due], legs: Legs) -> list[float]:
    """Metres of the shortest way by each set of stops, as a bit mask of them; infinite where none is in order."""
    count, before = len(due), _before(due)
    best = [[math.inf] * count for _ in range(1 << count)]
    for mask in range(1, 1 << count):
        for last in _members(mask, count):
            rest = mask & ~(1 << last)
            if _misplaced(rest, last, before):
                continue
            arrivals = (best[rest][stop] + legs.between[stop][last] for stop in _members(rest, count))
            best[mask][last] = min(arrivals) if rest else legs.first[last]
    return [0.0, *(min(row) for row in best[1:])]


def fewest_steps(due: Sequence[Due], legs: Legs) -> list[float]:
    """Steps after which an agent that was at each set of stops in time need not move any more; infinite where late.

    It is somewhere at whole steps only, and leaves a stop when that is due at the earliest.
    """
    count, before = len(due), _before(due)
    visit = [[math.inf] * count for _ in range(1 << count)]
    rests = [[math.inf] * count for _ in range(1 << count)]
    for mask in range(1, 1 << count):
        for last in _members(mask, count):
            rest = mask & ~(1 << last)
            if _misplaced(rest, last, before):
                continue
            come = [(0.0, 0.0, legs.first[last])] if not rest else []
            come += [(visit[rest][stop], rests[rest][stop], legs.between[stop][last]) for stop in _members(rest, count)]
            there = max(due[last].low, min(leaves + way for leaves, _, way in come))
            if there <= due[last].high:
                visit[mask][last] = there
                rests[mask][last] = min(leaves + way if way else still for leaves, still, way in come)
    return [0.0, *(min(row) for row in rests[1:])]


def _before(due: Sequence[Due]) -> list[int]:
    """For each stop those, as a bit mask, that are due before it."""
    return [
        sum(
            1 << other
            for other, earlier in enumerate(due)
            if earlier.high <= stop.low and not (stop.high <= earlier.low and number <= other)
        )
        for number, stop in enumerate(due)
    ]


def _misplaced(rest: int, last: int, before: Sequence[int]) -> bool:
    """Whether a stop of the rest comes after the last one."""
    return any(before[stop] >> last & 1 for stop in _members(rest, len(before)))


def _members(mask: int, count: int) -> list[int]:
    return [stop for stop in range(count) if mask >> stop & 1]
