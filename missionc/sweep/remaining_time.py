"""The time that is left of a sweep, from the runs that are over: an interval, or nothing where they say too little."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping

from missionc.base.units import Seconds
from missionc.sweep.run_grid import Combination, Run
from missionc.sweep.sweep_folder import Row

NORMAL_95 = 1.959963984540054
"""The standard normal distribution lies within plus and minus this with a probability of 95 %."""

LEAST = 5
"""Runs that have to be over before anything is said."""


class RemainingTime:
    """What is known of how long runs take; those before this command, too, where their seconds are in the journal.

    Runs of one combination are alike. Of combinations of which none is over,
    nothing is known but what runs take on the whole: the interval says so by
    its width.

    Args:
        left: how many runs of each combination are still to be done.
        rows: runs that are over already.
    """

    def __init__(self, left: Mapping[Combination, int], rows: Mapping[Run, Row]) -> None:
        self._left = dict(left)
        self._took: dict[Combination, list[float]] = {}
        for run, row in rows.items():
            self._took.setdefault(run.values, []).append(_seconds(row))

    def over(self, row: Row) -> None:
        """One more run is over."""
        self._left[row.run.values] = self._left.get(row.run.values, 1) - 1
        self._took.setdefault(row.run.values, []).append(_seconds(row))

    def left(self, workers: int) -> tuple[float, float] | None:
        """Seconds, the least and the most that 95 of 100 such sweeps still take.

        None where too few runs are over to say so, or where nobody is at work.
        """
        known = [seconds for own in self._took.values() for seconds in own]
        if len(known) < LEAST or not workers:
            return None
        mean, variance = 0.0, 0.0
        for values, count in self._left.items():
            own = self._took.get(values, ())
            sample = own if len(own) >= LEAST else known
            middle, spread = _moments(sample)
            mean += count * middle
            variance += spread * (count + count**2 / len(sample))
        width = NORMAL_95 * math.sqrt(variance)
        return max(0.0, mean - width) / workers, (mean + width) / workers


def _seconds(row: Row) -> float:
    values = row.result.values
    return sum(float(value) for name in ("seconds", "flown_in") if isinstance(value := values.get(name), int | float))


def _moments(sample: list[float] | tuple[float, ...]) -> tuple[float, float]:
    mean = sum(sample) / len(sample)
    return mean, sum((each - mean) ** 2 for each in sample) / max(1, len(sample) - 1)


def every(seconds: Seconds, work: Callable[[], object]) -> Callable[[], None]:
    """A function that does the work where so many seconds have passed, and ten times as many as it takes."""
    due = time.monotonic() + seconds

    def perhaps() -> None:
        nonlocal due
        began = time.monotonic()
        if began >= due:
            work()
            now = time.monotonic()
            due = now + max(seconds, 10 * (now - began))

    return perhaps
