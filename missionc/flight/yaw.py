"""Yaw along a flight: one more coordinate, on the flight's own pieces, within a limit of its rate.

    in   where it is to point, the most it may turn in a second, its flight
    out  coefficients of every piece

One way throughout is a constant. Along the path it is the spline nearest to the
direction of the flown velocity whose rate stays within the limit, by its
control points; it rests at both ends, or begins in the turn that there is then,
and where the agent hovers it is drawn to the direction that it last went.
"""

from __future__ import annotations

import math
from typing import assert_never

import numpy as np
from scipy.sparse import block_diag, csr_array, eye_array, kron

from missionc.base.trace import Array
from missionc.curves.piecewise_polynomials import Curves, values
from missionc.curves.smooth_splines import DEGREE, bernstein, control_points_of, effort, rounded
from missionc.flight.fit_polynomials import REST, begins_with
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


def pointing(yaw: Yaw, most: float, flight: Curves, begin: Array | None = None) -> Array:
    """(pieces, 8): yaw in rad, ascending powers of the seconds since the piece began; float32 values.

    Args:
        most: rad/s.
        flight: of one agent: (1, pieces, dim, 8).
        begin: (5,): the yaw at the beginning and its derivatives up to the fourth, where it is in motion then.
    """
    match yaw:
        case Fixed(angle):
            constant = np.zeros((flight.durations.size, DEGREE + 1))
            constant[:, 0] = np.float32(angle)
            return constant
        case AlongPath():
            return _along(most, flight, begin)
        case _:
            assert_never(yaw)


def _along(most: float, flight: Curves, begin: Array | None) -> Array:
    share = (np.arange(SAMPLES) + 0.5) / SAMPLES
    durations = flight.durations
    target, weight = _directions(flight, share)
    if begin is not None:  # the same directions, counted in the turns that were made before
        target = target + 2 * math.pi * np.round((begin[0] - target[0]) / (2 * math.pi))
    points = control_points_of(flight.times)
    free, fixed = _ends(points, durations, begin)
    curve, known = csr_array(points @ free), np.asarray(points @ fixed)
    sampled = csr_array(kron(eye_array(durations.size), bernstein(share)))
    seen = csr_array(sampled @ curve)
    weight = weight * np.repeat(durations / SAMPLES, SAMPLES)
    calm = CALM**4 * (curve.T @ block_diag(list(effort(2, durations))))
    quadratic = csr_array(seen.T @ (seen * weight[:, None]) + calm @ curve)
    linear: Array = np.asarray(calm @ known - seen.T @ (weight * (target - sampled @ known)))
    count = linear.size
    rates = _rates(most, durations, curve, known)
    solved = Program(quadratic, linear, csr_array((0, count)), np.zeros(0), (rates,)).within(1)
    # Whoever never turns stays within every rate.
    still = target[0] if begin is None else begin[0]
    numbers = np.full(count, still) if isinstance(solved, NoFit) else solved.numbers
    found = np.asarray(curve @ numbers + known).reshape(-1, 1, DEGREE + 1)
    return rounded(found, durations)[:, 0]


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


def _ends(points: csr_array, durations: Array, begin: Array | None) -> tuple[csr_array, Array]:
    """(coefficients, free) and (coefficients,): a spline's by the free ones, and those that its beginning fixes.

    Where it rests, the last are one number, and the first are another.
    """
    count = points.shape[1]
    known, first = np.zeros(count), REST - 1
    if begin is not None:
        first = begin.size
        wanted = begins_with(begin[:, None], float(durations[0]))[0]
        known[:first] = np.linalg.solve(points[:first, :first].toarray(), wanted)
    number = np.minimum(np.arange(count), count - REST) - first
    chosen = np.flatnonzero(number >= 0) if begin is not None else np.arange(count)
    column = np.maximum(number, 0)[chosen]
    return csr_array((np.ones(chosen.size), (chosen, column)), shape=(count, int(column.max()) + 1)), known


def _rates(most: float, durations: Array, curve: csr_array, known: Array) -> Bounds:
    """That the control points of the rate, in parts of every piece, are within the limit.

    Args:
        known: of the control points, what is the same whatever the free numbers are.
    """
    if math.isinf(most):
        return Bounds(csr_array((0, curve.shape[1])), np.zeros(0), np.zeros(0), np.zeros(0, dtype=np.int64))
    form = in_parts(1)
    changes = csr_array(block_diag([form / duration for duration in durations.tolist()]))
    rate, begun = csr_array(changes @ curve), changes @ known
    high = np.full(rate.shape[0], SHARE * most)
    return Bounds(rate, -high - begun, high - begun, np.zeros(rate.shape[0], dtype=np.int64))
