"""A unary totalizer: literals for a joint motion's excess over the sum of its agents' least metres.

Source:
    Bailleux and Boufkhad, "Efficient CNF encoding of Boolean cardinality constraints", 2003.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from missionc.backends.smt.encode.clauses import FALSE, TRUE, Clauses, Literals
from missionc.backends.smt.encode.lower_motion import Motion
from missionc.backends.smt.shorten.cost_to_go import CostToGo
from missionc.base.trace import Array


def add_totalizer(
    clauses: Clauses, motion: Motion, alone: Sequence[CostToGo], metres: Sequence[Array], unit: float, most: int
) -> Literals:
    """Literals, (most + 1,), implied by a joint motion: the ``k``-th by an excess of more than ``k`` units.

    Args:
        alone: of each agent; ``metres`` of the moves of each roadmap.
        unit: metres. Each move's excess is rounded down to units.
        most: more is not told apart.

    Raises:
        TooLarge: the clauses would pass their limit.
    """
    numbers = [
        number
        for agent, least in enumerate(alone)
        for number in _numbers(clauses, motion, agent, least, metres[motion.roadmap_of[agent]] / unit, unit, most)
    ]
    while len(numbers) > 1:
        pairs = zip(numbers[::2], numbers[1::2], strict=False)
        odd = numbers[len(numbers) // 2 * 2 :]
        numbers = [_sum(clauses, one, other, most + 1) for one, other in pairs] + odd
    total = np.full(most + 1, FALSE, dtype=np.int32)
    if numbers:
        total[: len(numbers[0])] = numbers[0][: most + 1]
    return total


def _numbers(
    clauses: Clauses, motion: Motion, agent: int, least: CostToGo, lengths: Array, unit: float, most: int
) -> Iterator[Literals]:
    """The excess of where an agent starts and of each of its moves, in units."""
    roadmap, states, made = motion.roadmap(agent), motion.states[agent], least.made
    source, target = roadmap.moves.T
    left = least.left / unit
    phases = np.arange(left.shape[-1])
    visited = _visited(clauses, states, least)
    at_start = _Number(clauses, most)
    begins = least.begin()
    at_start.add(_units(begins - begins.min(), unit, most), -states[0])
    yield from at_start.done()
    for step in range(motion.steps):
        here, there = states[step, source], states[step + 1, target]
        live = (here != FALSE) & (there != FALSE) & roadmap.allowed[step]
        number = _Number(clauses, most)
        for phase in phases.tolist():
            possible = (
                live & (phase & made[step, source] == made[step, source]) & np.isfinite(left[step, source, phase])
            )
            rows = np.flatnonzero(possible)
            after = left[step + 1, target[rows], phase | made[step + 1, target[rows]]]
            over = lengths[rows] + after - left[step, source[rows], phase]
            # What the agent has visited is known by its literals: in another phase the clause holds.
            in_phase = [-visit[step] if phase >> bit & 1 else visit[step] for bit, visit in enumerate(visited)]
            others = [np.full(len(rows), literal, dtype=np.int32) for literal in in_phase]
            number.add(_units(over, 1.0, most), -here[rows], -there[rows], *others)
        yield from number.done()


def _units(over: Array, unit: float, most: int) -> np.ndarray[tuple[int], np.dtype[np.int64]]:
    """Whole units, a little less than there are rather than more, and at most one too many."""
    return np.floor(np.clip(over / unit - 1e-9, 0.0, most + 1.0)).astype(np.int64)


def _visited(clauses: Clauses, states: Literals, least: CostToGo) -> list[Literals]:
    """For each visit literals, (steps + 1,): it is made by then."""
    literals = []
    for visit in least.task.visits:
        by_then = clauses.fresh(len(states))
        step, state = np.nonzero(visit & (states != FALSE))
        clauses.add(-states[step, state], by_then[step])
        clauses.add(-by_then[:-1], by_then[1:])
        for moment, there in enumerate(visit):
            now = states[moment, there & (states[moment] != FALSE)]
            before = by_then[moment - 1 : moment] if moment else by_then[:0]
            clauses.add(np.concatenate([-by_then[moment : moment + 1], before, now])[None, :])
        literals.append(by_then)
    return literals


class _Number:
    """One number, of at most ``most`` units and one more, from clauses that say when it is at least what."""

    def __init__(self, clauses: Clauses, most: int) -> None:
        self.clauses, self.most = clauses, most
        self.parts: list[tuple[np.ndarray[tuple[int], np.dtype[np.int64]], tuple[Literals, ...]]] = []

    def add(self, units: np.ndarray[tuple[int], np.dtype[np.int64]], *unless: Literals) -> None:
        """So many units, (rows,), unless one of the row's literals holds."""
        some = units > 0
        self.parts.append((units[some], tuple(literals[some] for literals in unless)))

    def done(self) -> Iterator[Literals]:
        """The number, if it is ever more than 0: literals, the ``k``-th implied by more than ``k`` units."""
        size = max((int(units.max(initial=0)) for units, _ in self.parts), default=0)
        if size:
            number = self.clauses.fresh(size)
            for units, unless in self.parts:
                if units.size:
                    self.clauses.add(*unless, number[units - 1])
            self.clauses.add(-number[1:], number[:-1])
            yield number


def _sum(clauses: Clauses, one: Literals, other: Literals, most: int) -> Literals:
    """The sum of two numbers of this form, exact up to ``most``."""
    clauses.reserve(len(one) * len(other))
    total = clauses.fresh(min(len(one) + len(other), most))
    left = np.concatenate([[TRUE], one]).astype(np.int32)
    right = np.concatenate([[TRUE], other]).astype(np.int32)
    row, column = np.meshgrid(np.arange(len(left)), np.arange(len(right)), indexing="ij")
    counts = (row + column > 0) & (row + column <= len(total))
    clauses.add(-left[row[counts]], -right[column[counts]], total[row[counts] + column[counts] - 1])
    return total
