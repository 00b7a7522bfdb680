"""Agents that are behind on their way: how far along its polynomials one is by where it was seen, and how fast it goes.

in   an agent's polynomials, places at times
out  the moment of its flight at which it is; Progress; the state that it is in
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from missionc.base.trace import Array
from missionc.flight.trajectories.stop_and_hover import ORDERS, state_at
from missionc.geometry.curves.piecewise_polynomials import Pieces, curves_of
from missionc.geometry.polylines import length

LONGEST = 30.0
"""Seconds that one may be behind at most."""
PERIOD = 0.02
"""Seconds between two moments of a flight that are looked at."""
STRIDE = 0.2
"""Seconds between two moments of what is flown behind its time."""
NEAR = 0.02
"""Metres: moments at which the flight is so much further from a place than the nearest are as good as that."""


@dataclass(frozen=True, slots=True)
class Progress:
    """How an agent goes along its way.

    Args:
        behind: metres of its way from where it is to where it should be.
        beside: metres from its way.
        rate: seconds of its flight that it flies in a second.
        speed: m/s, along its way.
    """

    behind: float
    beside: float
    rate: float
    speed: float


def own_moment(flight: Pieces, place: Array, time: float) -> tuple[float, float]:
    """The last moment of a flight, seconds and up to a time, at which it is at a place, and how many metres from it.

    Args:
        place: (dim,), metres.
    """
    first = max(0.0, time - LONGEST)
    moments = np.linspace(first, time, math.ceil((time - first) / PERIOD) + 1)
    away = np.linalg.norm(curves_of([flight], slice(None)).at(moments)[0, :, : place.size] - place, axis=-1)
    best = int(np.flatnonzero(away <= away.min() + NEAR)[-1])
    return float(moments[best]), float(away[best])


def progress(flight: Pieces, times: Array, places: Array) -> Progress:
    """How an agent goes along its way by where it was seen.

    Args:
        times: (samples,), seconds of its flight, ascending, at least two.
        places: (samples, dim), metres.
    """
    first, _ = own_moment(flight, places[0], float(times[0]))
    last, beside = own_moment(flight, places[-1], float(times[-1]))
    lasting = float(times[-1] - times[0])
    dimension = places.shape[1]
    behind = _length(flight, last, float(times[-1]), dimension)
    return Progress(behind, beside, (last - first) / lasting, _length(flight, first, last, dimension) / lasting)


def state_behind(flight: Pieces, place: Array, time: float, speed: float) -> Array:
    """(5, 4), as of ``state_at``: an agent on its flight by where it was seen, no faster than ``speed`` m/s."""
    moment, _ = own_moment(flight, place, time)
    state = state_at(flight, moment)
    fast = float(np.linalg.norm(state[1, :3]))
    share = min(1.0, speed / fast) if fast > 0 else 1.0
    return np.asarray(state * share ** np.arange(ORDERS)[:, None])


def flown_late(flight: Pieces, place: Array, time: float, speed: float, lasting: float) -> Pieces:
    """The rest of a flight of one that is behind, no faster than ``speed``: straight from one moment to the next.

    Args:
        place: (dim,), metres: where it was seen.
        time: seconds of its flight, when it was.
        lasting: seconds after that, to which it is told.
    """
    moment, _ = own_moment(flight, place, time)
    end = float(flight.duration.sum())
    own = np.linspace(moment, end, max(1, math.ceil((end - moment) / PERIOD)) + 1)
    curves = curves_of([flight], slice(None))
    fast = np.linalg.norm(curves.derivative().at(own)[0, :-1, :3], axis=-1)
    reached = np.concatenate([[0.0], np.cumsum(np.diff(own) * np.maximum(1.0, fast / speed))])
    times = np.linspace(0.0, lasting, max(1, math.ceil(lasting / STRIDE)) + 1)
    there = curves.at(np.interp(times, reached, own))[0]
    coefficients = np.zeros((times.size - 1, there.shape[1], flight.coefficients.shape[2]))
    coefficients[:, :, 0] = there[:-1]
    coefficients[:, :, 1] = np.diff(there, axis=0) / np.diff(times)[:, None]
    return Pieces(np.diff(times), coefficients)


def _length(flight: Pieces, first: float, last: float, dimension: int) -> float:
    """Metres of the way between two moments."""
    if last <= first:
        return 0.0
    moments = np.linspace(first, last, math.ceil((last - first) / PERIOD) + 1)
    way = curves_of([flight], slice(None)).at(moments)[0, :, :dimension]
    return length(way)
