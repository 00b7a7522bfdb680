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
from missionc.ir import Vehicle
from missionc.verification.plan.conservative_advancement import least

ORDERS = 5
"""Position, velocity, acceleration, jerk and snap."""
SHORTEST, LONGEST, LONGER = 0.25, 12.0, 1.12
"""Seconds of a stop: the first that is tried, the last one at most, and how many times longer each is."""
GLANCES = 33
"""Moments of a stop that are looked at before its limits are found."""
SURE = 0.995
"""The share of a limit that these moments may show, where no more is looked at: in between there may be more."""
HOVER = 1.0
"""Seconds of hovering after it."""


def _ending() -> Array:
    """(3, 5): from the first five coefficients of a stop of 1 s the others, so that it ends at rest."""
    ends = np.array([[math.perm(power, order) for power in range(8)] for order in (1, 2, 3)], dtype=np.float64)
    return np.asarray(np.linalg.solve(ends[:, ORDERS:], -ends[:, :ORDERS]))


ENDING = _ending()


def state_at(flight: Pieces, time: float) -> Array:
    """(5, 4): x, y, z in metres and yaw in rad, and their derivatives by seconds up to the fourth.

    Args:
        time: seconds; before the beginning and after the end, the states there.
    """
    return np.asarray(derivatives_at(curves_of([flight], slice(None)), np.array([time]), ORDERS)[0, 0])


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
    """(moments,), seconds: how long the stops of all last, at each of many moments, where no limit seems exceeded.

    Args:
        states: (moments, agents, 5, 4).

    Returns:
        float32 values; not a number where there is no such stop.
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
    """(..., 4, 8): the stops of a duration from states (..., 5, 4), whatever they take; float32 values."""
    factorial = np.array([math.factorial(order) for order in range(ORDERS)])
    # In shares of the duration: so that the numbers are of one size.
    known = states / factorial[:, None] * seconds ** np.arange(ORDERS)[:, None]
    shares = np.concatenate([known, ENDING @ known], axis=-2)
    whole = np.swapaxes(shares, -1, -2) / seconds ** np.arange(8)
    return np.asarray(whole.astype(np.float32).astype(np.float64))


def with_hover(moving: Array, seconds: float, hover: float = HOVER) -> Pieces:
    """A stop, (4, 8), of so many seconds, and the hover after it."""
    still = np.zeros_like(moving)
    still[:, 0] = values(moving, np.asarray(seconds)).astype(np.float32)
    return Pieces(np.array([seconds, float(np.float32(hover))]), np.stack([moving, still]))


def _kept(stop: Pieces, vehicle: Vehicle) -> bool:
    """Whether all limits of the vehicle are."""
    place = Curves(stop.times, stop.coefficients[None, :, :3])
    if peaks(limits_of(vehicle), place):
        return False
    turn = Curves(stop.times, stop.coefficients[None, :, 3:])
    return _slow(turn.derivative(), vehicle.yaw_rate) and _in_band(place, vehicle)


def _seen_beyond(moving: Array, seconds: float, vehicles: Sequence[Vehicle], most: float) -> Flags:
    """(..., agents): whether some moments show that a limit is not kept: most durations need no more than that.

    Args:
        moving: (..., agents, 4, 8).
        most: the share of a limit that there may be after the beginning; all of it there.
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
    """(..., shares, 4): a derivative of stops, (..., 4, 8), at shares of their duration."""
    factor = np.array([math.perm(power, order) for power in range(order, 8)])
    coefficients = own[..., order:] * (factor * seconds ** np.arange(8 - order))
    return np.asarray(np.swapaxes(coefficients @ (shares[:, None] ** np.arange(8 - order)).T, -1, -2))


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
