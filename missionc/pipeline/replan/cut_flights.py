"""Flights cut at moments, and put together: what is flown on, a stop in its place, and joints that all have.

in   polynomials, moments
out  polynomials, in numbers of float32 where they are sent
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from missionc.base.trace import Array
from missionc.curves.crazyflie_csv import Pieces
from missionc.curves.piecewise_polynomials import Curves, refined, shifted

SLIVER = 1e-4
"""Seconds: joints nearer than this are one."""


def from_moment(flight: Pieces, moment: float) -> Pieces:
    """The flight from a moment on, seconds."""
    whole = refined(Curves(flight.times, flight.coefficients[None]), np.array([moment]))
    chosen = whole.times[:-1] > moment - 1e-6
    return Pieces(whole.durations[chosen], whole.coefficients[0, chosen])


def until_then(flights: Sequence[Pieces], seconds: float) -> list[Pieces]:
    """Flights that last as long as each other, each no longer than so many seconds."""
    if seconds >= flights[0].duration.sum() - 1e-6:
        return list(flights)
    found = []
    for own in flights:
        whole = refined(Curves(own.times, own.coefficients[None]), np.array([seconds]))
        chosen = whole.times[1:] < seconds + 1e-6
        found.append(Pieces(whole.durations[chosen], whole.coefficients[0, chosen]))
    return found


def with_end(flight: Pieces, moment: float, end: Pieces) -> Pieces:
    """The flight up to a moment, seconds, and another from then on."""
    before = until_then([flight], moment)[0] if moment > SLIVER else None
    if before is None:
        return end
    return Pieces(
        np.concatenate([before.duration, end.duration]), np.concatenate([before.coefficients, end.coefficients])
    )


def with_stop(own: Pieces, stop: Pieces, moment: float, wait: float, lasting: float) -> Pieces:
    """What is flown until the stop begins, the stop, and the hover, of so many seconds in all."""
    hover = lasting - wait - float(stop.duration[0])
    durations, coefficients = [], []
    if wait > 0:
        part = refined(Curves(own.times, own.coefficients[None]), np.array([moment, moment + wait]))
        chosen = (part.times[:-1] > moment - 1e-9) & (part.times[1:] < moment + wait + 1e-9)
        durations.append(part.durations[chosen])
        coefficients.append(part.coefficients[0, chosen])
    durations.append(stop.duration[:1])
    coefficients.append(stop.coefficients[:1])
    if hover > 1e-6:
        durations.append(np.array([hover]))
        coefficients.append(stop.coefficients[1:])
    return Pieces(_float32(np.concatenate(durations)), _float32(np.concatenate(coefficients)))


def aligned(flights: list[Pieces]) -> list[Pieces]:
    """The same motions with the joints of all, so that their pieces last as long."""
    if len({own.duration.tobytes() for own in flights}) == 1:
        return flights
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
