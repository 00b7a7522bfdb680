"""Disturbances of a flight (wind, vehicle, estimates), and setpoints computed like the firmware.

Every flight has a separate generator from the seed and the flight's number, independent of other flights. Setpoints are
computed from polynomials in float32, as on board of a Crazyflie.

Source:
    crazyflie-firmware, src/modules/src/pptraj.c: ``piecewise_eval`` and ``poly4d_eval``.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from missionc.base.late_dataclass import Record
from missionc.base.trace import Array
from missionc.geometry.curves.piecewise_polynomials import Pieces

GRAVITY = 9.81
"""Gravitational acceleration, m/s²."""

SETPOINTS_PER_SECOND = 100
"""Rate at which the firmware evaluates a trajectory; in between it holds the last setpoint (RATE_HL_COMMANDER)."""

POSITION, VELOCITY, ACCELERATION, RATES, YAW = slice(0, 3), slice(3, 6), slice(6, 9), slice(9, 12), 12
"""Rows of a setpoint array: position m, velocity m/s, acceleration m/s², body rates rad/s, yaw rad."""

Float32 = NDArray[np.float32]


def setpoints(pieces: Pieces, times: Array) -> Array:
    """Setpoints of the controller at times since the start, seconds: (...) -> (13, ...), metres and rad.

    Before the start and after the end, the setpoint is the trajectory's first or last position.
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
    """Index of the polynomial piece at each time, (...), and the time since the piece's beginning, seconds.

    Times after the end belong to the last piece.
    """
    index, local = np.zeros(times.shape, dtype=np.int64), times.copy()
    for piece, duration in enumerate(durations[:-1].tolist()):
        beyond = (index == piece) & (local > np.float32(duration))
        index[beyond] += 1
        local[beyond] -= np.float32(duration)
    return index, np.minimum(local, durations[-1], out=local, where=index == durations.size - 1)


def _horner(coefficients: Float32, local: Float32) -> Float32:
    """Values of polynomials at given times, by Horner's rule: (4, ...), metres and rad.

    Args:
        coefficients: (4, powers, ...).
        local: times since the beginning of the piece, (...), seconds.
    """
    value = coefficients[:, -1]
    for power in range(coefficients.shape[1] - 2, -1, -1):
        value = value * local + coefficients[:, power]
    return value


def _derivative(coefficients: Float32) -> Float32:
    powers = np.arange(1, coefficients.shape[1], dtype=np.float32)
    return coefficients[:, 1:] * powers.reshape(1, -1, *[1] * (coefficients.ndim - 2))


def _rates(acceleration: Float32, jerk: Float32, yaw: Float32, yaw_rate: Float32) -> Float32:
    """Body rates by differential flatness, rad/s: (3, ...).

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


GUST_SECONDS = 0.5
"""Time constant of gusts, seconds: chosen as fast as a Crazyflie's position response."""
NOISE_SECONDS = 0.2
"""Time constant of the estimator's error, seconds: chosen, since a filtered estimate drifts and does not jump."""


class Disturbance(Record):
    """Magnitudes of all disturbances of a simulated flight; 0 by default.

    Args:
        wind: speed of the constant horizontal wind, m/s; random direction.
        gust: standard deviation of gusts along each axis, m/s; a separate Ornstein-Uhlenbeck process for each agent.
        mass: maximum relative error of the controller's mass estimate.
        start: maximum error of the start along x and along y, m.
        clock: maximum delay of the start, s.
        noise: standard deviation of the position estimate's error along each axis, m; a separate Ornstein-Uhlenbeck
            process for each agent.
        latency: delay of position and velocity, s.
        packets: fraction of lost position updates; the controller extrapolates from the last one at constant velocity.
        missed: fraction of the vehicles that miss the start command, and hover at their start.
        battery: decrease of a motor's maximum thrust until the end of the flight, as a fraction.
        motor: maximum loss of thrust in one motor of each vehicle, as a fraction.
        downwash: factor of the force of a published model (``default_engine.push``) on lower vehicles.
        lose: agents whose motors stop, with times, s.
    """

    wind: float = 0.0
    gust: float = 0.0
    mass: float = 0.0
    start: float = 0.0
    clock: float = 0.0
    noise: float = 0.0
    latency: float = 0.0
    packets: float = 0.0
    missed: float = 0.0
    battery: float = 0.0
    motor: float = 0.0
    downwash: float = 0.0
    lose: tuple[tuple[str, float], ...] = ()

    @property
    def random(self) -> bool:
        """True if flights differ randomly; otherwise all flights are equal."""
        drawn = self.wind, self.gust, self.mass, self.start, self.clock, self.noise, self.packets, self.missed
        return any((*drawn, self.motor))


UNDISTURBED = Disturbance()


class Drawn(Record, eq=False):
    """Random disturbances drawn for some flights; a tick is the time between two setpoints.

    Args:
        mass: (flights, agents), factors.
        start: (flights, agents, 3), m.
        clock: (flights, agents), s; infinite for a missed start.
        motors: (flights, agents, 4), efficiency of each motor.
        wind: (flights, agents, ticks, 3), m/s.
        noise: (flights, agents, ticks, 3), m: error of the position estimate.
        stale: (flights, agents, ticks): True without a position update.
    """

    mass: Array
    start: Array
    clock: Array
    motors: Array
    wind: Array
    noise: Array | None = None
    stale: NDArray[np.bool_] | None = None


def drawn(disturbance: Disturbance, seed: int, flights: range, agents: int, ticks: int) -> Drawn:
    """Random disturbances of the flights with these numbers."""
    each = [np.random.default_rng([seed, flight]) for flight in flights]
    shape = (len(flights), agents)

    def uniform(low: float, high: float, *more: int) -> Array:
        return np.stack([random.uniform(low, high, (agents, *more)) for random in each])

    mass = 1 + disturbance.mass * uniform(-1, 1)
    beside = disturbance.start * uniform(-1, 1, 2)
    clock = disturbance.clock * uniform(0, 1)
    angle = np.array([random.uniform(0, 2 * math.pi) for random in each])
    level = np.stack([np.cos(angle), np.sin(angle), np.zeros_like(angle)], axis=-1)
    weak = np.stack([random.integers(4, size=agents) for random in each])
    given = 1 - disturbance.motor * uniform(0, 1)
    clock[uniform(0, 1) < disturbance.missed] = math.inf
    wind = np.broadcast_to((disturbance.wind * level)[:, None, None], (*shape, ticks, 3))
    if disturbance.gust:
        wind = wind + disturbance.gust * _wandering(each, agents, ticks, GUST_SECONDS)
    stale = None
    if disturbance.packets:
        stale = np.stack([random.uniform(size=(agents, ticks)) < disturbance.packets for random in each])
    return Drawn(
        mass,
        np.concatenate([beside, np.zeros((*shape, 1))], axis=-1),
        clock,
        np.where(np.arange(4) == weak[..., None], given[..., None], 1.0),
        wind,
        disturbance.noise * _wandering(each, agents, ticks, NOISE_SECONDS) if disturbance.noise else None,
        stale,
    )


def _wandering(each: list[np.random.Generator], agents: int, ticks: int, seconds: float) -> Array:
    """Ornstein-Uhlenbeck processes of variance one, exact at their ticks: (flights, agents, ticks, 3).

    Args:
        each: random generator of each flight.
        seconds: time constant.
    """
    noise = np.empty((ticks, len(each), agents, 3))
    for flight, random in enumerate(each):
        noise[:, flight] = random.standard_normal((ticks, agents, 3))
    stays = math.exp(-1 / (SETPOINTS_PER_SECOND * seconds))
    noise[1:] *= math.sqrt(1 - stays**2)
    for tick in range(1, ticks):
        noise[tick] += stays * noise[tick - 1]
    return np.moveaxis(noise, 0, 2)
