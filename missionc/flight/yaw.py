"""Yaw along a flight: one more coordinate, on the flight's own pieces, within a limit of its rate.

    in   where it is to point, the most it may turn in a second, its flight
    out  coefficients of every piece

One way throughout is a constant. Along the path it is the spline nearest to the
direction of the flown velocity whose rate stays within the limit, by its
control points; it rests at both ends, and where the agent hovers it is drawn to
the direction that it last went.
"""

from __future__ import annotations

import math
from typing import assert_never

import numpy as np
from scipy.sparse import block_diag, csr_array, eye_array, kron

from missionc.base.trace import Array
from missionc.curves.piecewise_polynomials import Curves, values
from missionc.curves.smooth_splines import DEGREE, bernstein, control_points_of, effort, rounded
from missionc.flight.fit_polynomials import REST
from missionc.flight.quadratic_program import Bounds, NoFit, Program
from missionc.flight.vehicle_limits import SHARE, in_parts
from missionc.ir import AlongPath, Fixed, Yaw

SAMPLES = 16
"""Samples of the direction in each piece."""
HOVERING, DRIFTING = 0.05, 0.1
"""Who is slower goes nowhere: m/s, and of its own largest speed, since a stop is rounded off by a drift."""
FAINT = 0.05
"""Weight of a moment of hovering beside one of motion."""
CALM = 0.1
"""Seconds: turns that are quicker are rounded off."""


def pointing(yaw: Yaw, most: float, flight: Curves) -> Array:
    """(pieces, 8): yaw in rad, ascending powers of the seconds since the piece began; float32 values.

    Args:
        most: rad/s.
        flight: of one agent: (1, pieces, dim, 8).
    """
    match yaw:
        case Fixed(angle):
            constant = np.zeros((flight.durations.size, DEGREE + 1))
            constant[:, 0] = np.float32(angle)
            return constant
        case AlongPath():
            return _along(most, flight)
        case _:
            assert_never(yaw)


def _along(most: float, flight: Curves) -> Array:
    share = (np.arange(SAMPLES) + 0.5) / SAMPLES
    durations = flight.durations
    target, weight = _directions(flight, share)
    curve = csr_array(control_points_of(flight.times) @ _resting(flight.durations.size))
    seen = csr_array(kron(eye_array(durations.size), bernstein(share)) @ curve)
    weight = weight * np.repeat(durations / SAMPLES, SAMPLES)
    quadratic = csr_array(
        seen.T @ (seen * weight[:, None]) + CALM**4 * (curve.T @ block_diag(list(effort(2, durations))) @ curve)
    )
    linear: Array = -np.asarray(seen.T @ (weight * target))
    count = linear.size
    solved = Program(quadratic, linear, csr_array((0, count)), np.zeros(0), (_rates(most, durations, curve),)).within(1)
    # Whoever never turns stays within every rate.
    numbers = np.full(count, target[0]) if isinstance(solved, NoFit) else solved.numbers
    points = np.asarray(curve @ numbers).reshape(-1, 1, DEGREE + 1)
    return rounded(points, durations)[:, 0]


def _directions(flight: Curves, share: Array) -> tuple[Array, Array]:
    """(pieces * samples,) twice: the direction of the flown velocity, without jumps of a turn; and what it weighs."""
    velocity = flight.derivative().coefficients[0][:, None]
    flown = values(np.repeat(velocity, share.size, axis=1), share * flight.durations[:, None]).reshape(
        -1, velocity.shape[-2]
    )
    speed = np.linalg.norm(flown[:, :2], axis=-1)
    moving = np.flatnonzero(speed > max(HOVERING, DRIFTING * float(speed.max())))
    if not moving.size:
        return np.zeros(len(flown)), np.ones(len(flown))
    direction = np.unwrap(np.arctan2(flown[moving, 1], flown[moving, 0]))
    last = np.maximum(np.searchsorted(moving, np.arange(len(flown)), side="right") - 1, 0)
    weight = np.full(len(flown), FAINT)
    weight[moving] = 1.0
    return direction[last], weight


def _resting(pieces: int) -> csr_array:
    """(coefficients, free): the first and the last of a spline that rests at both ends are one number each."""
    count = DEGREE + 1 + (DEGREE - REST) * (pieces - 1)
    free = np.clip(np.arange(count) - (REST - 1), 0, count - 2 * REST + 1)
    return csr_array((np.ones(count), (np.arange(count), free)), shape=(count, count - 2 * REST + 2))


def _rates(most: float, durations: Array, curve: csr_array) -> Bounds:
    """That the control points of the rate, in parts of every piece, are within the limit."""
    if math.isinf(most):
        return Bounds(csr_array((0, curve.shape[1])), np.zeros(0), np.zeros(0), np.zeros(0, dtype=np.int64))
    form = in_parts(1)
    rate = csr_array(block_diag([form / duration for duration in durations.tolist()]) @ curve)
    high = np.full(rate.shape[0], SHARE * most)
    return Bounds(rate, -high, high, np.zeros(rate.shape[0], dtype=np.int64))
