"""Delayed agents: their time along their polynomials, their speed and their state, from samples.

in   an agent's polynomials, positions at times
out  its present time on the flight; Progress; its state
"""

from __future__ import annotations

import math

import numpy as np

from missionc.base.late_dataclass import Record
from missionc.base.trace import Array
from missionc.flight.trajectories.stop_and_hover import ORDERS, state_at
from missionc.geometry.curves.piecewise_polynomials import Pieces, curves_of
from missionc.geometry.polylines import length

LONGEST = 30.0
"""Maximum delay that is considered, seconds."""
PERIOD = 0.02
"""Interval between the times at which a trajectory is sampled to find the nearest point, seconds."""
STRIDE = 0.2
"""Interval between the joints of a delayed trajectory, seconds."""
NEAR = 0.02
"""Distance in metres: times whose distance exceeds the smallest by at most this count as equally near."""


class Progress(Record):
    """Progress of a delayed agent along its path.

    Args:
        behind: path length from its position to the planned one, metres.
        beside: distance from its path, metres.
        rate: seconds of flight time per second.
        speed: along its path, m/s.
    """

    behind: float
    beside: float
    rate: float
    speed: float


def own_moment(flight: Pieces, place: Array, time: float) -> tuple[float, float]:
    """Last time up to ``time`` at which the trajectory is nearest to a position, seconds, and its distance then,
    metres.

    Args:
        place: position, (dim,), metres.
    """
    first = max(0.0, time - LONGEST)
    moments = np.linspace(first, time, math.ceil((time - first) / PERIOD) + 1)
    away = np.linalg.norm(curves_of([flight], slice(None)).at(moments)[0, :, : place.size] - place, axis=-1)
    best = int(np.flatnonzero(away <= away.min() + NEAR)[-1])
    return float(moments[best]), float(away[best])


def progress(flight: Pieces, times: Array, places: Array) -> Progress:
    """Progress of a delayed agent along its path, from samples of its position.

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
    """State of a delayed agent on its path, with at most ``speed`` m/s, from position to snap: (5, 4).

    Args:
        place: sampled position, (dim,), metres.
        time: time of the sample, seconds of its flight.
    """
    moment, _ = own_moment(flight, place, time)
    state = state_at(flight, moment)
    fast = float(np.linalg.norm(state[1, :3]))
    share = min(1.0, speed / fast) if fast > 0 else 1.0
    return np.asarray(state * share ** np.arange(ORDERS)[:, None])


def flown_late(flight: Pieces, place: Array, time: float, speed: float, lasting: float) -> Pieces:
    """Rest of a delayed agent's trajectory, with at most ``speed`` m/s, as straight pieces.

    Args:
        place: (dim,), metres: last position.
        time: time of that position, seconds of its flight.
        lasting: duration after that, seconds.
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
    """Path length of a trajectory between two times, metres."""
    if last <= first:
        return 0.0
    moments = np.linspace(first, last, math.ceil((last - first) / PERIOD) + 1)
    way = curves_of([flight], slice(None)).at(moments)[0, :, :dimension]
    return length(way)
