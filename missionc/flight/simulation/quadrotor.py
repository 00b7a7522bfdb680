"""Quadrotor dynamics: a rigid body lifted and turned by four rotors, in moving air.

State, (17, bodies): position (m), velocity (m/s), attitude (unit quaternion w, x, y, z, body to world), body rates
(rad/s), thrust of each motor (N). World axes: z up. Body axes: x ahead, y to the left; motors as a Crazyflie's: front
right, back right, back left, front left.
"""

from __future__ import annotations

import numpy as np

from missionc.base.late_dataclass import Record
from missionc.base.trace import Array
from missionc.flight.simulation.disturbance import GRAVITY

POSITION, VELOCITY, ATTITUDE, RATES, THRUST = slice(0, 3), slice(3, 6), slice(6, 10), slice(10, 13), slice(13, 17)
"""Rows of a state array that contain each quantity."""

TURNS = np.array([[-1.0, -1.0, 1.0, 1.0], [-1.0, 1.0, 1.0, -1.0], [-1.0, 1.0, -1.0, 1.0]])
"""Sign of the torque about x, y and z by each motor's thrust: (3, motors)."""


class Vehicle(Record):
    """Physical parameters of a quadrotor; those of a Crazyflie 2.1 by default.

    Args:
        mass: kg.
        inertia: about x, y and z, kg m².
        arm: lever arm of a motor's thrust about x and about y, m.
        twist: torque about z per newton of thrust, m.
        strongest: thrust of one motor, N.
        lag: time constant of a motor's thrust, s; 0 for none.
        drag: across and along the rotors' axis, N per m/s of airspeed.

    Source:
        crazyflie-firmware, ``platform_defaults_cf2.h``: mass, thrust of the standard motors. Förster, "System
        Identification of the Crazyflie 2.0 Nano Quadrocopter" (ETH Zurich, 2015): inertia, arm (0.046 m along the
        diagonal), twist. Eschmann et al., "Data-Driven System Identification of Quadrotors Subject to Motor Delays"
        (2024): lag. rotorpy 3.0.0, ``crazyflie_params.py``, after Förster: 1.025e-6 and 7.55e-7 N for each rad/s and
        m/s; four rotors hover at 1758 rad/s.
    """

    mass: float = 0.029
    inertia: tuple[float, float, float] = (16.57e-6, 16.66e-6, 29.26e-6)
    arm: float = 0.0325
    twist: float = 0.00596
    strongest: float = 0.1125
    lag: float = 0.072
    drag: tuple[float, float] = (7.2e-3, 5.3e-3)


def at_rest(vehicle: Vehicle, position: Array, yaw: Array) -> Array:
    """State of hovering bodies, (17, bodies), with thrust that balances the nominal mass.

    Args:
        position: (3, bodies), metres.
        yaw: (bodies,), rad.
    """
    state = np.zeros((17, position.shape[1]))
    state[POSITION] = position
    state[6], state[9] = np.cos(yaw / 2), np.sin(yaw / 2)
    state[THRUST] = vehicle.mass * GRAVITY / 4
    return state


def axes(attitude: Array) -> tuple[Array, Array, Array]:
    """Body axes x, y and z in world coordinates, unit vectors: attitude (4, bodies) -> (3, bodies) three times."""
    w, x, y, z = attitude
    ahead = np.array([1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)])
    left = np.array([2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)])
    return ahead, left, upward(attitude)


def upward(attitude: Array) -> Array:
    """Thrust axis in world coordinates, a unit vector: attitude (4, bodies) -> (3, bodies)."""
    w, x, y, z = attitude
    return np.array([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)])


def heading(attitude: Array) -> Array:
    """Heading that an attitude quaternion has: (4, ...) -> (...), rad."""
    w, x, y, z = attitude
    return np.asarray(np.arctan2(2 * (x * y + w * z), 1 - 2 * (y * y + z * z)))


def change(vehicle: Vehicle, mass: Array, state: Array, thrust: Array, wind: Array, down: Array | None = None) -> Array:
    """Time derivative of the bodies' states by the equations of motion, (17, bodies).

    Args:
        mass: mass of each body, (bodies,), kg.
        state: (17, bodies).
        thrust: commands of each motor, (4, bodies), N.
        wind: (3, bodies), m/s.
        down: additional downward force, (bodies,), N.
    """
    w, x, y, z = state[ATTITUDE]
    p, q, r = state[RATES]
    motors = state[THRUST] if vehicle.lag else thrust
    up = upward(state[ATTITUDE])
    across, along = vehicle.drag
    through = state[VELOCITY] - wind
    lift = motors[0] + motors[1] + motors[2] + motors[3]
    push = lift - (along - across) * (up[0] * through[0] + up[1] * through[1] + up[2] * through[2])
    result = np.empty_like(state)
    result[POSITION] = state[VELOCITY]
    result[VELOCITY] = (push * up - across * through) / mass
    result[5] -= GRAVITY if down is None else GRAVITY + down / mass
    result[6] = -(x * p + y * q + z * r) / 2
    result[7] = (w * p + y * r - z * q) / 2
    result[8] = (w * q + z * p - x * r) / 2
    result[9] = (w * r + x * q - y * p) / 2
    about_x, about_y, about_z = vehicle.inertia
    turns = TURNS @ motors
    result[10] = (vehicle.arm * turns[0] - (about_z - about_y) * q * r) / about_x
    result[11] = (vehicle.arm * turns[1] - (about_x - about_z) * r * p) / about_y
    result[12] = (vehicle.twist * turns[2] - (about_y - about_x) * p * q) / about_z
    result[THRUST] = (thrust - motors) / vehicle.lag if vehicle.lag else 0.0
    return result


def moved(
    vehicle: Vehicle,
    mass: Array,
    state: Array,
    thrust: Array,
    wind: Array,
    seconds: float,
    down: Array | None = None,
) -> Array:
    """States after ``seconds``, integrated by the midpoint method, with the attitude normalised: (17, bodies).

    The arrays are as for ``change``. At 500 steps a second, the difference to a fourth-order method is hundredths of a
    millimetre.
    """
    half = state + seconds / 2 * change(vehicle, mass, state, thrust, wind, down)
    result: Array = state + seconds * change(vehicle, mass, half, thrust, wind, down)
    w, x, y, z = result[ATTITUDE]
    result[ATTITUDE] /= np.sqrt(w * w + x * x + y * y + z * z)
    return result
