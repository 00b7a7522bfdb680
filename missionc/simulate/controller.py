"""The flight controller: position by PID and feed-forward, attitude on SO(3), body rates from flatness.

Source:
    Mellinger and Kumar, "Minimum Snap Trajectory Generation and Control for Quadrotors" (2011), section IV, as
    crazyflie-firmware has it: ``controller_mellinger.c`` at 242d3db, ``power_distribution_quadrotor.c``.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from missionc.base.trace import Array
from missionc.simulate import firmware_setpoints, quadrotor
from missionc.simulate.firmware_setpoints import GRAVITY
from missionc.simulate.quadrotor import TURNS, Vehicle

MASS_THRUST = 132_000.0
"""PWM units of every motor for each newton of all."""


def _torque(about_xy: float, about_z: float, vehicle: Vehicle = Vehicle()) -> tuple[float, float, float]:  # noqa: B008
    """From the firmware's PWM units to N m: half of roll and pitch goes to each motor, and all of yaw."""
    level = about_xy / MASS_THRUST * vehicle.arm / 2
    return level, level, about_z / MASS_THRUST * vehicle.twist


@dataclass(frozen=True, slots=True)
class Gains:
    """The controller's figures, for x, y and z; the firmware's where none are given.

    Args:
        stiffness, damping, integral: N for each m, m/s and m s.
        longest: bound on the integral, m s.
        turn, rate, lead: N m for each unit of attitude error, rad/s and rad/s².
        torque: the most that is asked for, N m.
        mass: what the controller thinks the vehicle weighs, kg.
    """

    stiffness: tuple[float, float, float] = (0.4, 0.4, 1.25)
    damping: tuple[float, float, float] = (0.2, 0.2, 0.4)
    integral: tuple[float, float, float] = (0.05, 0.05, 1.5)
    longest: tuple[float, float, float] = (2.0, 2.0, 0.4)
    turn: tuple[float, float, float] = _torque(70_000, 60_000)
    rate: tuple[float, float, float] = _torque(20_000, 12_000)
    lead: tuple[float, float, float] = _torque(200, 0)
    torque: tuple[float, float, float] = _torque(32_000, 32_000)
    mass: float = Vehicle().mass


@dataclass(slots=True)
class Controller:
    """One for each body, all alike.

    Args:
        vehicle: whose motors it tells what to do.
        seconds: between two commands.
    """

    vehicle: Vehicle
    gains: Gains
    seconds: float
    _sum: Array | None = field(default=None, init=False)
    _last: Array | None = field(default=None, init=False)

    def thrust(self, state: Array, reference: Array) -> Array:
        """What each motor is told: (17, bodies), (13, bodies) -> (4, bodies), N."""
        gains = self.gains
        error = reference[firmware_setpoints.POSITION] - state[quadrotor.POSITION]
        longest = _column(gains.longest)
        self._sum = np.clip((0.0 if self._sum is None else self._sum) + error * self.seconds, -longest, longest)
        force = (
            gains.mass * reference[firmware_setpoints.ACCELERATION]
            + _column(gains.stiffness) * error
            + _column(gains.damping) * (reference[firmware_setpoints.VELOCITY] - state[quadrotor.VELOCITY])
            + _column(gains.integral) * self._sum
        )
        force[2] += gains.mass * GRAVITY
        body = quadrotor.axes(state[quadrotor.ATTITUDE])
        slow = reference[firmware_setpoints.RATES] - state[quadrotor.RATES]
        quicker = np.zeros_like(slow) if self._last is None else (slow - self._last) / self.seconds
        self._last = slow
        torque = (
            -_column(gains.turn) * _apart(_aimed(force, reference[firmware_setpoints.YAW]), body)
            + _column(gains.rate) * slow
            + _column(gains.lead) * quicker
        )
        most = _column(gains.torque)
        return self._shared((force * body[2]).sum(axis=0), np.clip(torque, -most, most))

    def _shared(self, force: Array, torque: Array) -> Array:
        """Among the motors; where one cannot give so much, all give less, so that the torque stays."""
        vehicle = self.vehicle
        arms = _column((vehicle.arm, vehicle.arm, vehicle.twist))
        thrust: Array = (force + TURNS.T @ (torque / arms)) / 4
        thrust -= np.maximum(thrust.max(axis=0) - vehicle.strongest, 0.0)
        return np.asarray(np.maximum(thrust, 0.0) * (force > 0))


def _column(values: tuple[float, float, float]) -> Array:
    return np.array(values)[:, None]


def _aimed(force: Array, yaw: Array) -> tuple[Array, Array, Array]:
    """The axes of the attitude whose thrust is along the force: (3, bodies), (bodies,) -> (3, bodies) thrice."""
    up = force / np.sqrt((force**2).sum(axis=0))
    ahead = np.array([np.cos(yaw), np.sin(yaw), np.zeros_like(yaw)])
    left = _cross(up, ahead)
    left /= np.sqrt((left**2).sum(axis=0))
    return _cross(left, up), left, up


def _apart(aimed: tuple[Array, Array, Array], body: tuple[Array, Array, Array]) -> Array:
    """The error of an attitude on SO(3), twice the sine of the angle about each body axis: (3, bodies)."""

    def mixed(first: int, second: int) -> Array:
        return np.asarray((aimed[first] * body[second] - body[first] * aimed[second]).sum(axis=0))

    return np.array([mixed(2, 1), mixed(0, 2), mixed(1, 0)])


def _cross(first: Array, second: Array) -> Array:
    """(3, bodies) twice -> (3, bodies); numpy's own takes five times as long."""
    return np.array(
        [
            first[1] * second[2] - first[2] * second[1],
            first[2] * second[0] - first[0] * second[2],
            first[0] * second[1] - first[1] * second[0],
        ]
    )
