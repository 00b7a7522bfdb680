"""Stops: from any time of a flight to rest, within the vehicle limits, without a jump from position to snap.

    in   the state at a time, the Vehicle
    out  Pieces: the stop, and a hover after it; None if no such stop satisfies the vehicle limits

A polynomial of degree seven has eight coefficients. The state gives five of them, and zero velocity, acceleration and
jerk at the end the other three; the final position follows. Its duration is free; the shortest one that satisfies every
limit is used.

Source:
    Mueller, Hehn and D'Andrea, "A Computationally Efficient Motion Primitive for Quadrocopter Trajectory Generation"
    (2015), with free end positions; here with one derivative more.

Delayed agents: their time along their polynomials, their speed and their state, from samples.

in   an agent's polynomials, positions at times
out  its present time on the flight; Progress; its state
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from missionc.base.late_dataclass import Record
from missionc.base.trace import Array, Flags, Indices
from missionc.flight.trajectories.vehicle_limits import EXACT, limits_of, peaks
from missionc.geometry.curves.piecewise_polynomials import (
    Curves,
    Pieces,
    curves_of,
    derivatives_at,
    speed_bounds,
    values,
)
from missionc.geometry.polylines import length
from missionc.ir import Vehicle
from missionc.verification.plan.conservative_advancement import least

ORDERS = 5
"""Number of quantities in a state: position, velocity, acceleration, jerk and snap."""
SHORTEST, LONGEST, LONGER = 0.25, 12.0, 1.12
"""Durations of a stop that are tried: the first and the longest in seconds, and the factor from one to the next."""
GLANCES = 33
"""Number of times at which a stop is tested before its limits are verified exactly."""
SURE = 0.995
"""Fraction of a limit that a stop may use at the tested times, since the value may be larger in between."""
HOVER = 1.0
"""Duration of the hover after a stop, seconds."""


def _ending() -> Array:
    """Matrix from the first five coefficients of a stop of 1 s to the other three, for rest at its end: (3, 5)."""
    ends = np.array([[math.perm(power, order) for power in range(8)] for order in (1, 2, 3)], dtype=np.float64)
    return np.asarray(np.linalg.solve(ends[:, ORDERS:], -ends[:, :ORDERS]))


ENDING = _ending()


def state_at(flight: Pieces, time: float) -> Array:
    """State of a trajectory at a time: x, y, z in metres and yaw in rad, with derivatives up to the fourth: (5, 4).

    Args:
        time: seconds; clipped to the flight.
    """
    return np.asarray(derivatives_at(curves_of([flight], slice(None)), np.array([time]), ORDERS)[0, 0])


def stop_and_hover(state: Array, vehicle: Vehicle, hover: float = HOVER) -> Pieces | None:
    """Shortest stop from a state within the vehicle's limits, and the hover after it; None if there is none.

    Args:
        state: (5, 4), from ``state_at``.
        hover: seconds, more than 0.

    Returns:
        Two pieces, float32 values, within the vehicle's limits of motion, yaw rate and altitude; the caller checks
        obstacles and other agents.
    """
    stopped = stop_together([state], [vehicle], hover)
    return None if stopped is None else stopped[0]


def stop_together(states: Sequence[Array], vehicles: Sequence[Vehicle], hover: float = HOVER) -> list[Pieces] | None:
    """Stops of several vehicles with the same duration, the shortest that is possible for all; None if there is none.

    Args:
        states: (5, 4) for each vehicle, metres, rad, seconds.
    """
    begin = np.stack(states)
    duration = SHORTEST
    while duration <= LONGEST:
        lasting = float(np.float32(duration))
        moving = stopping(begin, lasting)
        if not _seen_beyond(moving, lasting, vehicles, 1 + EXACT).any():
            stops = [with_hover(own, lasting, hover) for own in moving]
            if all(_kept(stop, vehicle) for stop, vehicle in zip(stops, vehicles, strict=True)):
                return stops
        duration *= LONGER
    return None


def quickest(states: Array, vehicles: Sequence[Vehicle]) -> Array:
    """Common duration of all agents' stops, for each of many times, if no limit is exceeded at samples: (moments,),
    seconds.

    Args:
        states: (moments, agents, 5, 4).

    Returns:
        float32 values; NaN without such a stop.
    """
    found, waiting = np.full(len(states), np.nan), np.arange(len(states))
    duration = SHORTEST
    while duration <= LONGEST and waiting.size:
        lasting = float(np.float32(duration))
        beyond = _seen_beyond(stopping(states[waiting], lasting), lasting, vehicles, SURE).any(axis=-1)
        found[waiting[~beyond]] = lasting
        waiting = waiting[beyond]
        duration *= LONGER
    return found


def stopping(states: Array, seconds: float) -> Array:
    """Polynomials of stops with a given duration, (..., 4, 8), float32 values; vehicle limits are ignored.

    Args:
        states: (..., 5, 4), metres, rad, seconds.
    """
    factorial = np.array([math.factorial(order) for order in range(ORDERS)])
    # In shares of the duration, so that the numbers have similar sizes.
    known = states / factorial[:, None] * seconds ** np.arange(ORDERS)[:, None]
    shares = np.concatenate([known, ENDING @ known], axis=-2)
    whole = np.swapaxes(shares, -1, -2) / seconds ** np.arange(8)
    return np.asarray(whole.astype(np.float32).astype(np.float64))


def with_hover(moving: Array, seconds: float, hover: float = HOVER) -> Pieces:
    """A stop, followed by a hover at its end.

    Args:
        moving: polynomials of the stop, (4, 8), metres and rad.
        seconds: duration of the stop.
    """
    still = np.zeros_like(moving)
    still[:, 0] = values(moving, np.asarray(seconds)).astype(np.float32)
    return Pieces(np.array([seconds, float(np.float32(hover))]), np.stack([moving, still]))


def _kept(stop: Pieces, vehicle: Vehicle) -> bool:
    """Return whether a stop satisfies all limits of the vehicle."""
    place = Curves(stop.times, stop.coefficients[None, :, :3])
    if peaks(limits_of(vehicle), place):
        return False
    turn = Curves(stop.times, stop.coefficients[None, :, 3:])
    return _slow(turn.derivative(), vehicle.yaw_rate) and _in_band(place, vehicle)


def _seen_beyond(moving: Array, seconds: float, vehicles: Sequence[Vehicle], most: float) -> Flags:
    """Flags of agents whose stops violate a limit at some tested times, (..., agents).

    Args:
        moving: (..., agents, 4, 8), metres and seconds.
        most: allowed fraction of a limit after the beginning; all of it there.
    """
    shares = np.linspace(0.0, 1.0, GLANCES)
    allowed = np.where(shares > 0, most, max(most, 1.0))
    beyond = np.zeros(moving.shape[:-2], dtype=np.bool_)
    for vehicle in dict.fromkeys(vehicles):
        some = np.array([each == vehicle for each in vehicles])
        own = moving[..., some, :, :]
        limits = limits_of(vehicle)
        motion = [
            _derived(own, seconds, order, shares) for order in range(1 + max([1, *(each.order for each in limits)]))
        ]
        found = [limit.gauge(motion[limit.order][..., :3]) > allowed for limit in limits]
        found.append(np.abs(motion[1][..., 3]) > vehicle.yaw_rate * allowed)
        height = motion[0][..., 2]
        found.append(height < np.minimum(vehicle.height.low, height[..., :1]) - EXACT * (most > 1))
        found.append(height > np.maximum(vehicle.height.high, height[..., :1]) + EXACT * (most > 1))
        beyond[..., some] = np.any(found, axis=(0, -1))
    return beyond


def _derived(own: Array, seconds: float, order: int, shares: Array) -> Array:
    """Derivative of stops, (..., 4, 8), at fractions of their duration.

    Shape: (..., shares, 4), metres, rad and seconds.
    """
    factor = np.array([math.perm(power, order) for power in range(order, 8)])
    coefficients = own[..., order:] * (factor * seconds ** np.arange(8 - order))
    return np.asarray(np.swapaxes(coefficients @ (shares[:, None] ** np.arange(8 - order)).T, -1, -2))


def _slow(rate: Curves, most: float) -> bool:
    """Return whether the magnitude of a rate stays within ``most``."""
    if math.isinf(most):
        return True
    own, changes = rate.coefficients[0], speed_bounds(rate)[0]

    def margin(item: Indices, local: Array) -> Array:
        return most - np.abs(values(own[item], local)[..., 0])

    return float(least(margin, changes, rate.durations, EXACT * most, ceiling=0.0).lower.min()) >= -EXACT * most


def _in_band(place: Curves, vehicle: Vehicle) -> bool:
    """Return whether a stop stays in the vehicle's altitude band; from outside, it may not move further away."""
    heights = Curves(place.times, place.coefficients[:, :, 2:])
    own, changes = heights.coefficients[0], speed_bounds(heights)[0]
    begin = float(own[0, 0, 0])
    low, high = min(vehicle.height.low, begin), max(vehicle.height.high, begin)
    if math.isinf(low) and math.isinf(high):
        return True

    def margin(item: Indices, local: Array) -> Array:
        height = values(own[item], local)[..., 0]
        return np.minimum(height - low, high - height)

    return float(least(margin, changes, heights.durations, EXACT, ceiling=0.0).lower.min()) >= -EXACT


LOOK_BACK = 30.0
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
    first = max(0.0, time - LOOK_BACK)
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
