"""Flights cut at moments, and put together: what is flown on, a stop in its place, and joints that all have.

in   polynomials, moments
out  polynomials, in numbers of float32 where they are sent
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from missionc.base.trace import Array
from missionc.curves.crazyflie_csv import Pieces, curves_of
from missionc.curves.piecewise_polynomials import refined, shifted

SLIVER = 1e-4
"""Seconds: joints nearer than this are one."""


def between(flight: Pieces, first: float, last: float = math.inf) -> Pieces:
    """The flight from one moment to another, seconds, or to its end."""
    whole = refined(curves_of([flight], slice(None)), np.array([first, last]))
    middle = (whole.times[:-1] + whole.times[1:]) / 2
    chosen = (middle > first) & (middle < last)
    return Pieces(whole.durations[chosen], whole.coefficients[0, chosen])


def in_two(flight: Pieces) -> Pieces:
    """The flight in at least two pieces, as files have them."""
    if flight.duration.size > 1:
        return flight
    half = float(flight.duration[0]) / 2
    return joined([between(flight, 0.0, half), between(flight, half)])


def joined(flights: Sequence[Pieces]) -> Pieces:
    """One flight after the other."""
    return Pieces(
        np.concatenate([own.duration for own in flights]), np.concatenate([own.coefficients for own in flights])
    )


def with_stop(own: Pieces, stop: Pieces, moment: float, wait: float, lasting: float) -> Pieces:
    """What is flown until the stop begins, the stop, and the hover, of so many seconds in all."""
    hover = lasting - wait - float(stop.duration[0])
    parts = [between(own, moment, moment + wait), Pieces(stop.duration[:1], stop.coefficients[:1])]
    if hover > 1e-6:
        parts.append(Pieces(np.array([hover]), stop.coefficients[1:]))
    whole = joined(parts)
    return Pieces(_float32(whole.duration), _float32(whole.coefficients))


def aligned(flights: list[Pieces]) -> list[Pieces]:
    """The same motions with the joints of all, so that their pieces last as long."""
    if len({own.duration.tobytes() for own in flights}) == 1:
        return [Pieces(_float32(own.duration), _float32(own.coefficients)) for own in flights]
    joints = np.unique(np.concatenate([own.times for own in flights]))
    joints = joints[np.concatenate([[True], np.diff(joints) > SLIVER])]
    joints[-1] = min(own.times[-1] for own in flights)
    durations = _float32(np.diff(joints))
    return [Pieces(durations, _float32(_with_joints(own, joints))) for own in flights]


def _with_joints(own: Pieces, joints: Array) -> Array:
    """(pieces, 4, 8): the coefficients of a flight between joints that have its own among them."""
    piece = (joints[:-1, None] > own.times[1:-1] - SLIVER).sum(axis=1)
    return np.asarray(shifted(own.coefficients[None, piece], joints[:-1] - own.times[piece])[0])


def _float32(numbers: Array) -> Array:
    return numbers.astype(np.float32).astype(np.float64)
