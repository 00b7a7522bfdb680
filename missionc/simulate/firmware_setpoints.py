"""Setpoints as a Crazyflie's firmware makes them of its polynomials, in float32 as on board.

Source:
    crazyflie-firmware, src/modules/src/pptraj.c: ``piecewise_eval`` and ``poly4d_eval``.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from missionc.base.trace import Array
from missionc.curves.crazyflie_csv import Pieces

GRAVITY = 9.81
"""m/s²"""

SETPOINTS_PER_SECOND = 100
"""How often the firmware evaluates a trajectory; in between it holds the last setpoint (RATE_HL_COMMANDER)."""

POSITION, VELOCITY, ACCELERATION, RATES, YAW = slice(0, 3), slice(3, 6), slice(6, 9), slice(9, 12), 12
"""The rows of setpoints: m, m/s, m/s², body rates in rad/s, rad."""

Float32 = NDArray[np.float32]


def setpoints(pieces: Pieces, times: Array) -> Array:
    """What the controller is told at times since the start, seconds: (...) -> (13, ...).

    Before the start and after the end the vehicle is told to stand where the
    trajectory begins and ends.
    """
    first, last = times < 0, times > pieces.duration.sum()
    index, local = _piece(pieces.duration.astype(np.float32), np.maximum(times, 0.0).astype(np.float32))
    coefficients = np.moveaxis(pieces.coefficients.astype(np.float32)[index], (-2, -1), (0, 1))
    position = _horner(coefficients, local)
    slope = _derivative(coefficients)
    velocity = _horner(slope, local)
    bend = _derivative(slope)
    acceleration = _horner(bend, local)
    jerk = _horner(_derivative(bend), local)
    rates = _rates(acceleration[:3], jerk[:3], position[3], velocity[3])
    reference: Float32 = np.concatenate([position[:3], velocity[:3], acceleration[:3], rates, position[3:]])
    reference[3:12, first | last] = 0.0
    return reference.astype(np.float64)


def _piece(durations: Float32, times: Float32) -> tuple[NDArray[np.int64], Float32]:
    """Which piece a time falls in, and the time since that began; past the end, the last moment of the last piece."""
    index, local = np.zeros(times.shape, dtype=np.int64), times.copy()
    for piece, duration in enumerate(durations[:-1].tolist()):
        beyond = (index == piece) & (local > np.float32(duration))
        index[beyond] += 1
        local[beyond] -= np.float32(duration)
    return index, np.minimum(local, durations[-1], out=local, where=index == durations.size - 1)


def _horner(coefficients: Float32, local: Float32) -> Float32:
    """(4, powers, ...), (...) -> (4, ...)."""
    value = coefficients[:, -1]
    for power in range(coefficients.shape[1] - 2, -1, -1):
        value = value * local + coefficients[:, power]
    return value


def _derivative(coefficients: Float32) -> Float32:
    powers = np.arange(1, coefficients.shape[1], dtype=np.float32)
    return coefficients[:, 1:] * powers.reshape(1, -1, *[1] * (coefficients.ndim - 2))


def _rates(acceleration: Float32, jerk: Float32, yaw: Float32, yaw_rate: Float32) -> Float32:
    """Body rates by flatness, rad/s: (3, ...).

    Source:
        Mellinger and Kumar, "Minimum Snap Trajectory Generation and Control for Quadrotors" (2011), section III.
    """
    thrust = acceleration.copy()
    thrust[2] += np.float32(GRAVITY)
    size = np.sqrt((thrust**2).sum(axis=0))
    up = thrust / size
    ahead = np.stack([np.cos(yaw), np.sin(yaw), np.zeros_like(yaw)])
    left = np.cross(up, ahead, axis=0)
    left /= np.sqrt((left**2).sum(axis=0))
    ahead = np.cross(left, up, axis=0)
    turning = (jerk - (jerk * up).sum(axis=0) * up) / size
    return np.stack([-(turning * left).sum(axis=0), (turning * ahead).sum(axis=0), up[2] * yaw_rate])
