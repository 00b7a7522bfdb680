"""Stops: from any moment of a flight to rest, within what the vehicle may do, without a jump from position to snap.

    in   the state at a moment, the Vehicle
    out  Pieces: the stop, and a hover after it; None where no stop of this kind keeps the vehicle's limits

A polynomial of degree seven has eight coefficients. The state gives five of
them, and velocity, acceleration and jerk that are zero at the end the other
three: where it comes to rest follows. Its duration is the one free number, and
the shortest is taken with which every limit is kept.

Source:
    Mueller, Hehn and D'Andrea, "A Computationally Efficient Motion Primitive for Quadrocopter Trajectory Generation"
    (2015), of ends that are free in position; here with one derivative more.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from missionc.base.trace import Array
from missionc.curves.crazyflie_csv import Pieces
from missionc.curves.piecewise_polynomials import Curves, Indices, speed_bounds, values
from missionc.flight.vehicle_limits import EXACT, limits_of, peaks
from missionc.ir import Vehicle
from missionc.verify.plan.conservative_advancement import least

ORDERS = 5
"""Position, velocity, acceleration, jerk and snap."""
SHORTEST, LONGEST, LONGER = 0.25, 12.0, 1.12
"""Seconds of a stop: the first that is tried, the last one at most, and how many times longer each is."""
GLANCES = 17
"""Moments of a stop that are looked at before its limits are found."""
HOVER = 1.0
"""Seconds of hovering after it."""


def state_at(flight: Pieces, time: float) -> Array:
    """(5, 4): x, y, z in metres and yaw in rad, and their derivatives by seconds up to the fourth.

    Args:
        time: seconds; before the beginning and after the end, the states there.
    """
    times = flight.times
    piece = int(np.clip(np.searchsorted(times, time, side="right") - 1, 0, flight.duration.size - 1))
    local = np.asarray(np.clip(time - times[piece], 0.0, flight.duration[piece]))
    coefficients, state = flight.coefficients[piece], []
    for _ in range(ORDERS):
        state.append(values(coefficients, local))
        coefficients = coefficients[:, 1:] * np.arange(1, coefficients.shape[1])
    return np.stack(state)


def stop_and_hover(state: Array, vehicle: Vehicle, hover: float = HOVER) -> Pieces | None:
    """The shortest stop from a state, and the hover after it.

    Args:
        state: (5, 4), as of ``state_at``.
        hover: seconds, more than 0.

    Returns:
        Two pieces, float32 values. It keeps the vehicle's limits of motion, of its yaw rate and of its heights;
        obstacles and others are the caller's.
    """
    stopped = stop_together([state], [vehicle], hover)
    return None if stopped is None else stopped[0]


def stop_together(states: Sequence[Array], vehicles: Sequence[Vehicle], hover: float = HOVER) -> list[Pieces] | None:
    """Likewise of several vehicles at once, whose stops last equally long: the shortest that suits them all."""
    duration = SHORTEST
    while duration <= LONGEST:
        stops = [_stop(state, duration, hover) for state in states]
        if all(_kept(stop, vehicle) for stop, vehicle in zip(stops, vehicles, strict=True)):
            return stops
        duration *= LONGER
    return None


def _stop(state: Array, duration: float, hover: float) -> Pieces:
    """The stop of a duration, whatever it takes."""
    lasting = float(np.float32(duration))
    factorial = np.array([math.factorial(order) for order in range(ORDERS)])
    # In shares of the duration: so that the numbers are of one size.
    known = state / factorial[:, None] * lasting ** np.arange(ORDERS)[:, None]
    free = np.arange(ORDERS, 8)
    ends = [[math.perm(power, order) for power in range(8)] for order in (1, 2, 3)]
    matrix = np.array(ends, dtype=np.float64)
    rest = np.linalg.solve(matrix[:, free], -matrix[:, :ORDERS] @ known)
    shares = np.concatenate([known, rest]).T
    moving = (shares / lasting ** np.arange(8)).astype(np.float32).astype(np.float64)
    still = np.zeros_like(moving)
    still[:, 0] = values(moving, np.asarray(lasting)).astype(np.float32)
    return Pieces(np.array([lasting, float(np.float32(hover))]), np.stack([moving, still]))


def _kept(stop: Pieces, vehicle: Vehicle) -> bool:
    """Whether all limits of the vehicle are."""
    place = Curves(stop.times, stop.coefficients[None, :, :3])
    if _plainly_beyond(stop, vehicle) or peaks(limits_of(vehicle), place):
        return False
    turn = Curves(stop.times, stop.coefficients[None, :, 3:])
    return _slow(turn.derivative(), vehicle.yaw_rate) and _in_band(place, vehicle)


def _plainly_beyond(stop: Pieces, vehicle: Vehicle) -> bool:
    """Whether some moments show already that a limit is not kept: most durations need no more than that."""
    share = np.linspace(0.0, 1.0, GLANCES)[:, None] ** np.arange(8)
    numbers = stop.coefficients[0, :3] * stop.duration[0] ** np.arange(8)
    for order, most in ((1, vehicle.speed), (2, vehicle.acceleration), (3, vehicle.jerk)):
        factor = np.array([math.perm(power, order) for power in range(order, 8)])
        seen = share[:, : 8 - order] @ (numbers[:, order:] * factor).T / stop.duration[0] ** order
        size = np.linalg.norm(seen[:, :2] if order == 1 else seen, axis=-1).max()
        if size > most * (1 + EXACT):
            return True
    return False


def _slow(rate: Curves, most: float) -> bool:
    """Whether one coordinate stays within a number on both sides."""
    if math.isinf(most):
        return True
    own, changes = rate.coefficients[0], speed_bounds(rate)[0]

    def margin(item: Indices, local: Array) -> Array:
        return most - np.abs(values(own[item], local)[..., 0])

    return float(least(margin, changes, rate.durations, EXACT * most, ceiling=0.0).lower.min()) >= -EXACT * most


def _in_band(place: Curves, vehicle: Vehicle) -> bool:
    """Whether it stays in its heights; where it was out of them it may be as far as it was."""
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
