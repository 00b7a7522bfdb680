"""Default simulation engine: all agents of several flights moved together, with state estimates and downwash.

    in   Pieces of each agent, the disturbances of each flight
    out  Flown

``Airborne`` moves along setpoints from any source; ``fly`` takes them from polynomials. The controller runs 500 times a
second, as on board, and so does the integration of the body. Agents do not collide.

The controller gets an estimate of position and velocity, delayed and with missing updates. Downwash is the force with
which a vehicle's rotors push the vehicles below it down.

Source:
    Panerati et al., "Learning to Fly: a Gym Environment with PyBullet Physics for Reinforcement Learning of
    Multi-agent Quadcopter Control" (2021), III-B, and the figures for a Crazyflie 2.x that its code has.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from missionc.base.late_dataclass import Record
from missionc.base.trace import Array
from missionc.flight.simulation import quadrotor
from missionc.flight.simulation.controller import Controller, Gains
from missionc.flight.simulation.disturbance import (
    POSITION,
    SETPOINTS_PER_SECOND,
    UNDISTURBED,
    YAW,
    Disturbance,
    Drawn,
    setpoints,
)
from missionc.flight.simulation.quadrotor import Vehicle
from missionc.geometry.curves.piecewise_polynomials import Pieces


class Estimate:
    """Delayed estimates of the bodies' positions and velocities, (6, bodies), m and m/s.

    Args:
        first: initial state, also for the time before.
        late: delay of a state in commands.
        seconds: time between two commands.
    """

    def __init__(self, first: Array, late: int, seconds: float) -> None:
        self._past = deque([first.copy()] * late)
        self._seconds = seconds
        self._held: Array | None = None

    def shown(self, state: Array, noise: Array | None, stale: NDArray[np.bool_] | None) -> tuple[Array, Array]:
        """Estimated position and velocity for this command: (3, bodies) twice, m and m/s.

        Args:
            noise: (3, bodies), m, added to the position.
            stale: (bodies,): True without an update; the estimate is then extrapolated at constant velocity.
        """
        fresh = state
        if self._past:
            self._past.append(state.copy())
            fresh = self._past.popleft()
        if stale is not None:
            gone_on = fresh if self._held is None else self._held.copy()
            if self._held is not None:
                gone_on[:3] += self._seconds * self._held[3:]
            fresh = self._held = np.where(stale, gone_on, fresh)
        position = fresh[:3] if noise is None else fresh[:3] + noise
        return position, fresh[3:]


ROTOR = 0.0231348
"""Radius of a rotor, m."""
STRENGTH = 2267.18
"""Downwash force at a distance of one rotor radius below a vehicle, N."""
WIDTH = (-0.11, 0.16)
"""Width of the downwash stream: at distance 0, metres, and increase per metre below."""
NEAREST = 0.1
"""Smallest vertical distance used for the downwash, metres: the model diverges at 0, and bodies touch."""


def push(position: Array, together: int, still: NDArray[np.bool_] | None = None) -> Array:
    """Downwash force on each body from all bodies above it: (3, bodies), m -> (bodies,), N.

    Args:
        together: number of adjacent columns in the same flight.
        still: (bodies,): True for stopped rotors; default none.
    """
    x, y, z = position.reshape(3, -1, together)
    below = z[:, None, :] - z[:, :, None]
    beside = (x[:, None, :] - x[:, :, None]) ** 2 + (y[:, None, :] - y[:, :, None]) ** 2
    height = np.maximum(below, NEAREST)
    width = np.maximum(np.abs(WIDTH[0] + WIDTH[1] * height), 1e-3)
    each = STRENGTH * (ROTOR / (4 * height)) ** 2 * np.exp(-beside / (2 * width**2))
    blows = below > 0
    if still is not None:
        blows &= ~still.reshape(-1, 1, together)
    return np.asarray(np.where(blows, each, 0.0).sum(axis=-1).ravel())


COMMANDS = 5
"""Number of controller commands per setpoint."""
COMMAND_SECONDS = 1 / (SETPOINTS_PER_SECOND * COMMANDS)
"""Seconds between two commands of the controller."""
CHUNK = 100
"""Number of ticks whose setpoints are evaluated together; a tick is the time between setpoints."""


class Flown(Record, eq=False):
    """Trajectories of simulated flights at ``SETPOINTS_PER_SECOND`` samples a second.

    Args:
        times: (samples,), s.
        position, velocity: (flights, agents, samples, 3), m and m/s.
        heading: (flights, agents, samples), rad.
    """

    times: Array
    position: Array
    velocity: Array
    heading: Array


def sample_times(seconds: float) -> Array:
    """Times of all setpoints from 0 to the end of a flight, (samples,), seconds."""
    ticks = int(np.ceil(seconds * SETPOINTS_PER_SECOND - 1e-9))
    return np.arange(ticks + 1) / SETPOINTS_PER_SECOND


class Airborne:
    """Flying quadrotors, each with its controller, simulated together from setpoint to setpoint.

    They begin hovering, or in motion. Setpoints may change at any time, for example after replanning in flight. A body
    is a column in all arrays.

    Args:
        position: initial positions, (3, bodies), m.
        yaw: (bodies,), rad.
        mass: mass of each, (bodies,), kg; default: the controller's estimate.
        motors: efficiency of each motor, (4, bodies); default 1.
        latency: delay of position and velocity, s.
        sag: decrease of a motor's maximum thrust per second, as a fraction.
        downwash: factor of ``push``, the downwash force.
        together: number of adjacent bodies in the same flight; default all.
        velocity: initial velocity, (3, bodies), m/s; default 0.
    """

    def __init__(
        self,
        position: Array,
        yaw: Array,
        mass: Array | None = None,
        vehicle: Vehicle | None = None,
        gains: Gains | None = None,
        *,
        motors: Array | None = None,
        latency: float = 0.0,
        sag: float = 0.0,
        downwash: float = 0.0,
        together: int | None = None,
        velocity: Array | None = None,
    ) -> None:
        bodies = position.shape[1]
        self.vehicle = vehicle or Vehicle()
        self._state = quadrotor.at_rest(self.vehicle, position, yaw)
        if velocity is not None:
            self._state[quadrotor.VELOCITY] = velocity
        self._mass = np.full(bodies, self.vehicle.mass) if mass is None else mass
        self._motors, self._sag, self._downwash = motors, sag, downwash
        self._together = together or bodies
        self._controller = Controller(self.vehicle, gains or Gains(), COMMAND_SECONDS, bodies)
        self._estimate = Estimate(self._state[:6], round(latency / COMMAND_SECONDS), COMMAND_SECONDS)
        self._lost = np.zeros(bodies, dtype=bool)
        self._ticks = 0

    @property
    def position(self) -> Array:
        """Present positions of all bodies: (3, bodies), metres."""
        return self._state[quadrotor.POSITION].copy()

    @property
    def velocity(self) -> Array:
        """Present velocities of all bodies: (3, bodies), m/s."""
        return self._state[quadrotor.VELOCITY].copy()

    @property
    def heading(self) -> Array:
        """Present headings of all bodies: (bodies,), rad."""
        return quadrotor.heading(self._state[quadrotor.ATTITUDE])

    @property
    def lost(self) -> NDArray[np.bool_]:
        """Flags of bodies with stopped motors: (bodies,), boolean."""
        return self._lost.copy()

    def lose(self, body: int) -> None:
        """Stop a body's motors permanently: it falls to height 0 and stays there.

        Raises:
            IndexError: the body does not exist.
        """
        self._lost[body] = True

    def advance(
        self,
        reference: Array,
        wind: Array | None = None,
        noise: Array | None = None,
        stale: NDArray[np.bool_] | None = None,
    ) -> None:
        """Simulate the time between two setpoints, ``1 / SETPOINTS_PER_SECOND`` s.

        Args:
            reference: setpoints, (13, bodies), from ``firmware_setpoints.setpoints``.
            wind: (3, bodies), m/s; default 0.
            noise: error of the position estimate, (3, bodies), m; default 0.
            stale: (bodies,): True without a position update; default none.
        """
        vehicle = self.vehicle
        air = np.zeros_like(reference[:3]) if wind is None else wind
        ceiling = vehicle.strongest * max(0.0, 1 - self._sag * self._ticks / SETPOINTS_PER_SECOND)
        down = self._pushed_down()
        for _ in range(COMMANDS):
            position, velocity = self._estimate.shown(self._state[:6], noise, stale)
            thrust = self._controller.thrust(position, velocity, self._state, reference)
            if self._sag:
                thrust = np.minimum(thrust, ceiling)
            if self._motors is not None:
                thrust = thrust * self._motors
            thrust[:, self._lost] = 0.0
            self._state = quadrotor.moved(vehicle, self._mass, self._state, thrust, air, COMMAND_SECONDS, down)
        self._ticks += 1
        self._land()

    def _pushed_down(self) -> Array | None:
        """Downwash force on each body from bodies above it with turning rotors: (bodies,), newtons.

        None if not simulated.
        """
        if not self._downwash or self._together < 2:
            return None
        return self._downwash * push(self._state[quadrotor.POSITION], self._together, self._lost)

    def _land(self) -> None:
        """Set the position of bodies with stopped motors to height 0 once they have fallen below it."""
        if not self._lost.any():
            return
        down = self._lost & (self._state[2] <= 0)
        self._state[2, down] = 0.0
        self._state[quadrotor.VELOCITY, down] = 0.0
        self._state[quadrotor.RATES, down] = 0.0


def fly(
    pieces: Sequence[Pieces],
    drawn: Drawn,
    seconds: float,
    vehicle: Vehicle | None = None,
    gains: Gains | None = None,
    disturbance: Disturbance = UNDISTURBED,
    lost: Mapping[int, float] | None = None,
) -> Flown:
    """Simulate flights from the start, at rest or in motion, until ``seconds``.

    Args:
        pieces: polynomials of each agent.
        drawn: random disturbances of each flight.
        disturbance: constant parts of the disturbance, except lost agents.
        lost: stop time of agents' motors in every flight, s.
    """
    vehicle = vehicle or Vehicle()
    times = sample_times(seconds)
    flights, agents = drawn.mass.shape
    bodies = flights * agents
    at_first = _told(pieces, drawn.clock, times[:1])[:, 0]
    air = Airborne(
        at_first[POSITION] + drawn.start.reshape(bodies, 3).T,
        at_first[YAW],
        drawn.mass.ravel() * vehicle.mass,
        vehicle,
        gains,
        motors=drawn.motors.reshape(bodies, 4).T.copy() if disturbance.motor else None,
        latency=disturbance.latency,
        sag=disturbance.battery / seconds,
        downwash=disturbance.downwash,
        together=agents,
        velocity=np.tile(np.stack([own.coefficients[0, :3, 1] for own in pieces], axis=1), flights),
    )
    falls = sorted((when, agent) for agent, when in (lost or {}).items())
    track = np.empty((times.size, 7, bodies))
    for tick, time in enumerate(times.tolist()):
        while falls and falls[0][0] <= time:
            for body in range(falls.pop(0)[1], bodies, agents):
                air.lose(body)
        if tick % CHUNK == 0:
            reference = _told(pieces, drawn.clock, times[tick : tick + CHUNK])
        track[tick, :3], track[tick, 3:6], track[tick, 6] = air.position, air.velocity, air.heading
        air.advance(
            reference[:, tick % CHUNK],
            _rows(drawn.wind, tick),
            None if drawn.noise is None else _rows(drawn.noise, tick),
            None if drawn.stale is None else drawn.stale[:, :, tick].ravel(),
        )
    by_flight = np.moveaxis(track.reshape(times.size, 7, flights, agents), (2, 3), (0, 1))
    position, velocity = (np.ascontiguousarray(by_flight[..., rows]) for rows in (slice(0, 3), slice(3, 6)))
    return Flown(times, position, velocity, np.ascontiguousarray(by_flight[..., 6]))


def _told(pieces: Sequence[Pieces], clock: Array, times: Array) -> Array:
    """Setpoints of each body at some times: (13, ticks, bodies), metres and rad.

    Args:
        clock: delay of each agent, (flights, agents), s.
        times: (ticks,), s.
    """
    flights, agents = clock.shape
    each = np.empty((13, times.size, flights, agents))
    for agent, own in enumerate(pieces):
        late = clock[:, agent]
        alike = flights > 1 and not late.any()
        each[..., agent] = setpoints(own, times[:, None] - (late[:1] if alike else late))
    return each.reshape(13, times.size, flights * agents)


def _rows(values: Array, tick: int) -> Array:
    """Values of all bodies at one tick, (3, bodies), from an array (flights, agents, ticks, 3), metres or m/s."""
    return np.ascontiguousarray(values[:, :, tick].reshape(-1, 3).T)
