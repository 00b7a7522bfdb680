"""The flight controller: position by PID and feed-forward, attitude on SO(3), body rates from flatness.

Source:
    Mellinger and Kumar, "Minimum Snap Trajectory Generation and Control for Quadrotors" (2011), section IV, as
    crazyflie-firmware has it in its releases, 2025.02 among them: ``controller_mellinger.c`` at 47f5999,
    ``power_distribution_quadrotor.c``. Later development (242d3db) raised the integral of the height from 0.05 to 1.5;
    no release has that.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from missionc.base.late_dataclass import Record
from missionc.base.trace import Array
from missionc.flight.simulation import disturbance, quadrotor
from missionc.flight.simulation.disturbance import GRAVITY
from missionc.flight.simulation.quadrotor import TURNS, Vehicle

MASS_THRUST = 132_000.0
"""Conversion of thrust: PWM units of every motor per newton of total thrust."""


def _torque(about_xy: float, about_z: float, vehicle: Vehicle = Vehicle()) -> tuple[float, float, float]:  # noqa: B008
    """Torque about x, y and z in N m, from the firmware's PWM units.

    The firmware applies half of roll and pitch to each motor, and all of yaw.
    """
    level = about_xy / MASS_THRUST * vehicle.arm / 2
    return level, level, about_z / MASS_THRUST * vehicle.twist


class Gains(Record):
    """Gains of the position and attitude controller for x, y and z; the firmware's by default.

    Args:
        stiffness, damping, integral: N per m, m/s and m s.
        longest: bound on the integral, m s.
        turn, rate, lead, settle: N m per unit of attitude error, rad/s, rad/s² and second of attitude error.
        longest_turn: bound on the integral of the attitude error, s.
        torque: maximum command, N m.
        mass: the controller's estimate of the vehicle's mass, kg.
    """

    stiffness: tuple[float, float, float] = (0.4, 0.4, 1.25)
    damping: tuple[float, float, float] = (0.2, 0.2, 0.4)
    integral: tuple[float, float, float] = (0.05, 0.05, 0.05)
    longest: tuple[float, float, float] = (2.0, 2.0, 0.4)
    turn: tuple[float, float, float] = _torque(70_000, 60_000)
    rate: tuple[float, float, float] = _torque(20_000, 12_000)
    lead: tuple[float, float, float] = _torque(200, 0)
    settle: tuple[float, float, float] = _torque(0, 500)
    longest_turn: tuple[float, float, float] = (1.0, 1.0, 1500.0)
    torque: tuple[float, float, float] = _torque(32_000, 32_000)
    mass: float = Vehicle().mass


class Controller:
    """Position and attitude controllers of several quadrotors with equal gains.

    Args:
        vehicle: controlled vehicle.
        seconds: time between two commands.
    """

    def __init__(self, vehicle: Vehicle, gains: Gains, seconds: float, bodies: int) -> None:
        self.vehicle = vehicle
        self.gains = gains
        self.seconds = seconds
        self._sum, self._turned, self._last = np.zeros((3, 3, bodies))
        self._stiffness, self._damping, self._integral = map(_column, (gains.stiffness, gains.damping, gains.integral))
        self._turn, self._rate, self._settle = map(_column, (gains.turn, gains.rate, gains.settle))
        self._lead = _column(gains.lead) / seconds
        self._longest, self._longest_turn, self._torque = map(
            _column, (gains.longest, gains.longest_turn, gains.torque)
        )
        self._shares = np.ascontiguousarray((TURNS / _column((vehicle.arm, vehicle.arm, vehicle.twist))).T) / 4

    def thrust(self, position: Array, velocity: Array, body: Array, reference: Array) -> Array:
        """Thrust command of each motor, N: (4, bodies).

        Args:
            position, velocity: estimates, (3, bodies), m and m/s.
            body: true state, (17, bodies); attitude and rates are used.
            reference: setpoints, (13, bodies).
        """
        gains = self.gains
        error = reference[disturbance.POSITION] - position
        self._sum = _bounded(self._sum + error * self.seconds, self._longest)
        force = (
            gains.mass * reference[disturbance.ACCELERATION]
            + self._stiffness * error
            + self._damping * (reference[disturbance.VELOCITY] - velocity)
            + self._integral * self._sum
        )
        force[2] += gains.mass * GRAVITY
        axes = quadrotor.axes(body[quadrotor.ATTITUDE])
        apart = _apart(_aimed(force, reference[disturbance.YAW]), axes)
        self._turned = _bounded(self._turned - apart * self.seconds, self._longest_turn)
        slow = reference[disturbance.RATES] - body[quadrotor.RATES]
        torque = self._rate * slow - self._turn * apart + self._settle * self._turned + self._lead * (slow - self._last)
        self._last = slow
        push = force[0] * axes[2][0] + force[1] * axes[2][1] + force[2] * axes[2][2]
        upside_down = push <= 0
        if upside_down.any():
            self._sum[:, upside_down] = self._turned[:, upside_down] = 0.0
        return self._shared(push, _bounded(torque, self._torque), upside_down)

    def _shared(self, force: Array, torque: Array, upside_down: NDArray[np.bool_]) -> Array:
        """Motor thrusts that give a total force and a torque, N: (4, bodies).

        If a motor saturates, all thrusts are reduced, to preserve the torque.

        Args:
            force: (bodies,), N.
            torque: (3, bodies), N m.
            upside_down: (bodies,): True for bodies that get no thrust.
        """
        thrust: Array = force / 4 + self._shares @ torque
        thrust -= np.maximum(thrust.max(axis=0) - self.vehicle.strongest, 0.0)
        thrust[:, upside_down] = 0.0
        return np.asarray(np.maximum(thrust, 0.0))


def _bounded(values: Array, most: Array) -> Array:
    return np.asarray(np.minimum(np.maximum(values, -most), most))


def _column(values: tuple[float, float, float]) -> Array:
    return np.array(values)[:, None]


def _aimed(force: Array, yaw: Array) -> tuple[Array, Array, Array]:
    """Body axes of the attitude whose thrust axis is along the force and whose heading is the yaw.

    Shape: (3, bodies) N, (bodies,) rad -> unit vectors, (3, bodies) three times.
    """
    up = force / np.sqrt((force**2).sum(axis=0))
    ahead = np.array([np.cos(yaw), np.sin(yaw), np.zeros_like(yaw)])
    left = _cross(up, ahead)
    left /= np.sqrt((left**2).sum(axis=0))
    return _cross(left, up), left, up


def _apart(aimed: tuple[Array, Array, Array], body: tuple[Array, Array, Array]) -> Array:
    """Attitude error on SO(3): twice the sine of the angle about each body axis, dimensionless, (3, bodies)."""

    def mixed(first: int, second: int) -> Array:
        return np.asarray((aimed[first] * body[second] - body[first] * aimed[second]).sum(axis=0))

    return np.array([mixed(2, 1), mixed(0, 2), mixed(1, 0)])


def _cross(first: Array, second: Array) -> Array:
    """Cross products of vectors, (3, bodies) twice -> (3, bodies), in the product of the units.

    The function is five times faster than numpy's own.
    """
    return np.array(
        [
            first[1] * second[2] - first[2] * second[1],
            first[2] * second[0] - first[0] * second[2],
            first[0] * second[1] - first[1] * second[0],
        ]
    )
