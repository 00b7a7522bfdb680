"""Cubic approximation of curves of degree seven, within a millimetre, for players that know no more.

Each cubic has the place and the velocity of the curve at both of its ends, and
these are at whole milliseconds. Their difference is a polynomial piece by
piece, and no larger than its Bernstein control points: that is the bound.

Source:
    Farin, "Curves and Surfaces for CAGD" (2002), chapters 5 and 7.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from missionc.base.trace import Array
from missionc.curves.piecewise_polynomials import Curves, Indices, control_points, from_control_points, refined

CLOSE = 1e-3
"""Metres: a cubic that may stray further is halved."""
GRAIN = 1e-6
"""Metres: to which coordinates are written."""
PADDING = 1e-9
"""Metres: more than float64 loses in a bound."""


@dataclass(frozen=True, slots=True, eq=False)
class Cubics:
    """One agent's flight.

    Args:
        clock: (cubics + 1,), whole milliseconds.
        points: (cubics, 3, 4), metres: Bézier control points, in whole ``GRAIN``.
        deviation: metres, proved: at no time is it further from the curve.
    """

    clock: Indices
    points: Array
    deviation: float

    @property
    def curves(self) -> Curves:
        """The cubics as polynomials, (1, cubics, 3, 4)."""
        times = self.clock / 1000
        return Curves(times, from_control_points(self.points, np.diff(times))[None])


def cubics(curve: Curves) -> Cubics:
    """The cubics of one agent's curve, (1, pieces, 3, 8), that ends at rest; one within ``CLOSE`` is not halved."""
    curve = _held(curve)
    clock = np.unique(np.rint(curve.times * 1000).astype(np.int64))
    clock[-1] = round(curve.times[-1] * 1000)
    while True:
        points = _through(curve, clock / 1000)
        apart = _apart(curve, clock / 1000, points)
        far = np.flatnonzero((apart > CLOSE) & (np.diff(clock) > 1))
        if not far.size:
            return Cubics(clock, points, float(apart.max()))
        clock = np.union1d(clock, (clock[far] + clock[far + 1]) // 2)


def _held(curve: Curves) -> Curves:
    """The curve, and where it ended up to the next whole millisecond."""
    end = math.ceil(curve.times[-1] * 1000 - 1e-3) / 1000
    if end <= curve.times[-1]:
        return curve
    hold = np.zeros((1, 1, 3, 8))
    hold[..., 0] = curve.at(curve.times[-1:])
    return Curves(np.append(curve.times, end), np.concatenate([curve.coefficients, hold], axis=1))


def _through(curve: Curves, times: Array) -> Array:
    """(cubics, 3, 4): control points of the cubics between these times."""
    place, velocity = curve.at(times)[0], curve.derivative().at(times)[0]
    third = np.diff(times)[:, None] / 3
    points = np.stack(
        [place[:-1], place[:-1] + velocity[:-1] * third, place[1:] - velocity[1:] * third, place[1:]], axis=-1
    )
    return np.asarray(np.rint(points / GRAIN) * GRAIN)


def _apart(curve: Curves, times: Array, points: Array) -> Array:
    """(cubics,), metres: how far each cubic is from the curve at most."""
    own = Curves(times, from_control_points(points, np.diff(times))[None])
    # On one grid of times: the joints of both.
    fine, course = refined(curve, times), refined(own, curve.times)
    last = min(fine.times[-1], course.times[-1])
    both = np.union1d(fine.times, course.times)
    both = both[both <= last]
    fine, course = refined(fine, both), refined(course, both)
    size = both.size - 1
    gap = fine.coefficients[0, :size].copy()
    gap[..., :4] -= course.coefficients[0, :size]
    far = np.linalg.norm(control_points(gap, np.diff(both)), axis=1).max(axis=-1) + PADDING
    result = np.zeros(len(points))
    cubic = np.clip(np.searchsorted(times, (both[:-1] + both[1:]) / 2, side="right") - 1, 0, len(points) - 1)
    np.maximum.at(result, cubic, far)
    return result
