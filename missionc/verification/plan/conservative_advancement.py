"""Conservative advancement: the least value of a margin along many motions at once, with a proof.

A margin that changes by at most one metre per metre of motion cannot fall by
more than (speed * time). So the value at the middle of an interval bounds the
whole interval from below; where the bound does not suffice the interval is
halved, all motions together, until the least bound is within ``gap`` of the
least value seen.

Source:
    Mirtich, "Impulse-based Dynamic Simulation of Rigid Body Systems" (1996), section 2.3.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from missionc.base.late_dataclass import Record
from missionc.base.trace import Array, Indices

CHUNK = 1 << 19
"""Intervals looked at together: bounds the memory."""

EVALUATIONS = 20_000_000
"""After so many the bound is taken as it stands: still a bound, only a looser one."""


SHARE = 1e-3
"""The share of a margin to which it is found: where bodies are far apart, nobody asks how far to the micrometre."""


class Least(Record, eq=False):
    """For each motion: ``lower`` <= its least margin <= ``upper``, which is taken at ``at`` (seconds from its start).

    Where the search was for the least of all, ``lower`` of the others may stay far below what they really keep,
    never below the least of all by more than the gap.
    """

    lower: Array
    upper: Array
    at: Array


def least(
    margin: Callable[[Indices, Array], Array],
    speed: Array,
    duration: Array,
    gap: float,
    ceiling: float | None = None,
) -> Least:
    """Bounds on the least margin of each motion.

    Args:
        margin: of motions (by index) at local times: (count,), (count,) -> (count,).
        speed: (motions,): the margin changes at most so much per second.
        duration: (motions,), seconds.
        gap: how close the bounds are brought together; large margins only to a thousandth of themselves.
        ceiling: margins above it are of no interest; absent: only the least of all is.
    """
    count = speed.size
    lower, upper, at = np.full(count, np.inf), np.full(count, np.inf), np.zeros(count)
    everything = np.arange(count)
    waiting = [
        (everything[begin : begin + CHUNK], np.zeros(part.size), part)
        for begin in range(0, count, CHUNK)
        for part in (duration[begin : begin + CHUNK],)
    ]
    spent = 0
    while waiting:
        item, low, high = waiting.pop()
        middle = (low + high) / 2
        value = margin(item, middle)
        spent += item.size
        _keep_least(upper, at, item, value, middle)
        bound = value - speed[item] * (high - low) / 2
        interest = np.minimum(upper[item], upper.min() if ceiling is None else ceiling)
        # A value that is not a number keeps its interval, whose bound then counts: it must not vanish.
        near = gap + SHARE * np.maximum(interest, 0.0)
        done = (bound >= interest - near) | (spent > EVALUATIONS) | ~np.isfinite(bound)
        np.minimum.at(lower, item[done], np.where(np.isnan(bound[done]), -np.inf, bound[done]))
        item, low, middle, high = item[~done], low[~done], middle[~done], high[~done]
        if 0 < 2 * item.size <= CHUNK:
            twice, begins = np.concatenate((item, item)), np.concatenate((low, middle))
            waiting.append((twice, begins, np.concatenate((middle, high))))
        elif item.size:
            waiting += [(item, middle, high), (item, low, middle)]
    return Least(lower, upper, at)


def _keep_least(upper: Array, at: Array, item: Indices, value: Array, when: Array) -> None:
    better = np.flatnonzero(value < upper[item])
    order = better[np.argsort(-value[better], kind="stable")]
    # Of several values for one motion the last assignment stands: the smallest.
    upper[item[order]] = value[order]
    at[item[order]] = when[order]
