"""Conservative advancement: minimum value of a margin along many trajectories at once, with a proof.

A 1-Lipschitz margin cannot fall by more than (speed * time). The value at the middle therefore bounds the whole
interval from below. If the bound does not suffice, the interval is halved, for all trajectories together, until the
minimum bound is within ``gap`` of the minimum computed value.

Source:
    Mirtich, "Impulse-based Dynamic Simulation of Rigid Body Systems" (1996), section 2.3.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from missionc.base.late_dataclass import Record
from missionc.base.trace import Array, Indices

CHUNK = 1 << 19
"""Number of time intervals that are evaluated together; it bounds the memory."""

EVALUATIONS = 20_000_000
"""Maximum number of margin evaluations; afterwards the bound is returned as it is, valid but looser."""


SHARE = 1e-3
"""Relative precision of large margins: bodies far apart need no exact margin."""


class Least(Record, eq=False):
    """Bounds on the minimum margin of each trajectory: ``lower`` <= minimum margin <= ``upper``.

    The margin ``upper`` is attained at ``at`` (seconds from the start). If the search was for the overall minimum,
    ``lower`` of other trajectories may be far below their true margin, but at most the gap below the overall minimum.
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
    """Bounds on the minimum margin along each trajectory.

    Args:
        margin: margin of trajectories (by index) at local times: (count,), (count,) -> (count,), metres.
        speed: (motions,): bound on the rate of the margin, per second.
        duration: (motions,), seconds.
        gap: maximum difference of the bounds; for large margins a thousandth of themselves.
        ceiling: larger margins are not refined; with None, only the minimum margin of all is refined.
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
        # NaN keeps its interval, whose bound then counts: it must not vanish.
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
    # Of several values for one motion, the last assignment wins: the smallest.
    upper[item[order]] = value[order]
    at[item[order]] = when[order]
