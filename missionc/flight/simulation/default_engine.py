"""The default simulation engine: all agents of several flights moved together, with estimates and downwash.

    in   Pieces of each agent, the disturbances drawn for each flight
    out  Flown

``Airborne`` moves along setpoints from any source; ``fly`` takes them from polynomials. The controller runs 500 times
a second, as on board, and the body moves as often. Agents do not touch.

The controller sees an estimate of position and velocity: late, and with updates missing. Downwash is the force with
which a vehicle's rotors push the vehicles below it down.

Source:
    Panerati et al., "Learning to Fly: a Gym Environment with PyBullet Physics for Reinforcement Learning of
    Multi-agent Quadcopter Control" (2021), III-B, and the figures for a Crazyflie 2.x that its code has.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

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
    """One for each body. A state is position and velocity, (6, bodies), m and m/s.

    Args:
        first: the state that they begin in, and have been in.
        late: a state is shown so many commands later.
        seconds: between two commands.
    """

    def __init__(self, first: Array, late: int, seconds: float) -> None:
        self._past = deque([first.copy()] * late)
        self._seconds = seconds
        self._held: Array | None = None

    def shown(self, state: Array, noise: Array | None, stale: NDArray[np.bool_] | None) -> tuple[Array, Array]:
        """Position and velocity for this command: (3, bodies) twice.

        Args:
            noise: (3, bodies), m, added to the position.
            stale: (bodies,): those to whom no update comes are shown where they would be at the velocity that they were
                last shown.
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
"""N, of a rotor's radius below."""
WIDTH = (-0.11, 0.16)
"""Metres at no distance, and for each metre below: how wide the stream is."""
NEAREST = 0.1
"""Metres below: nearer, the model grows beyond all bounds, and bodies touch."""


def push(position: Array, together: int, still: NDArray[np.bool_] | None = None) -> Array:
    """Downward force on each body, of all that are above it: (3, bodies), m -> (bodies,), N.

    Args:
        together: so many neighbouring columns fly in the same air.
        still: (bodies,): whose rotors stand; nobody's where none is given.
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
"""Commands of the controller for each setpoint."""
COMMAND_SECONDS = 1 / (SETPOINTS_PER_SECOND * COMMANDS)
"""Between two commands of the controller."""
CHUNK = 100
"""Ticks whose setpoints are evaluated together."""


@dataclass(frozen=True, slots=True, eq=False)
class Flown:
    """Where everybody was, ``SETPOINTS_PER_SECOND`` times a second.

    Args:
        times: (samples,), s.
        position: (flights, agents, samples, 3), m.
        velocity: likewise, m/s.
        heading: (flights, agents, samples), rad.
    """

    times: Array
    position: Array
    velocity: Array
    heading: Array


def sample_times(seconds: float) -> Array:
    """Every tick until the end is reached: (samples,), s."""
    ticks = int(np.ceil(seconds * SETPOINTS_PER_SECOND - 1e-9))
    return np.arange(ticks + 1) / SETPOINTS_PER_SECOND


class Airborne:
    """Bodies in the air, each with its controller, moved together from setpoint to setpoint.

    They begin hovering, or in motion. What they are told may change with every setpoint, so that whoever plans anew in
    flight tells them something else from then on. A body is a column everywhere.

    Args:
        position: where they begin, (3, bodies), m.
        yaw: (bodies,), rad.
        mass: what each weighs, (bodies,), kg; what its controller thinks where none is given.
        motors: the share of what it is told that each motor gives, (4, bodies); all of it where none is given.
        latency: so late a controller is shown position and velocity, s.
        sag: the most that a motor gives falls by this share with every second.
        downwash: those below are pushed down by so many times ``downwash.push``.
        together: so many neighbouring bodies fly in the same air; all of them where none is given.
        velocity: in which they begin, (3, bodies), m/s; none where none is given.
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
        """(3, bodies), m."""
        return self._state[quadrotor.POSITION].copy()

    @property
    def velocity(self) -> Array:
        """(3, bodies), m/s."""
        return self._state[quadrotor.VELOCITY].copy()

    @property
    def heading(self) -> Array:
        """(bodies,), rad."""
        return quadrotor.heading(self._state[quadrotor.ATTITUDE])

    @property
    def lost(self) -> NDArray[np.bool_]:
        """(bodies,): whose motors have stopped."""
        return self._lost.copy()

    def lose(self, body: int) -> None:
        """Stop a body's motors for good: it falls to height 0 and lies there.

        Raises:
            IndexError: there is no such body.
        """
        self._lost[body] = True

    def advance(
        self,
        reference: Array,
        wind: Array | None = None,
        noise: Array | None = None,
        stale: NDArray[np.bool_] | None = None,
    ) -> None:
        """Move on by the time between two setpoints, ``1 / SETPOINTS_PER_SECOND`` s.

        Args:
            reference: what each is told, (13, bodies), as ``firmware_setpoints.setpoints`` makes it.
            wind: (3, bodies), m/s; still air where none is given.
            noise: how far beside its position each is shown to be, (3, bodies), m; nothing where none is given.
            stale: (bodies,): to whom no position update comes; to everybody one does where none is given.
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
        """By those above whose rotors turn: (bodies,), N."""
        if not self._downwash or self._together < 2:
            return None
        return self._downwash * push(self._state[quadrotor.POSITION], self._together, self._lost)

    def _land(self) -> None:
        """The lost ones that are at height 0 lie there."""
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
    """Flights from the start, at rest or in the motion in which they begin, until ``seconds`` are over.

    Args:
        disturbance: of which all that is not drawn is taken, and not whom it loses.
        lost: which agents' motors stop in every flight, and when, s.
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
    """What each body is told: (flights, agents), s and (ticks,), s -> (13, ticks, bodies)."""
    flights, agents = clock.shape
    each = np.empty((13, times.size, flights, agents))
    for agent, own in enumerate(pieces):
        late = clock[:, agent]
        alike = flights > 1 and not late.any()
        each[..., agent] = setpoints(own, times[:, None] - (late[:1] if alike else late))
    return each.reshape(13, times.size, flights * agents)


def _rows(values: Array, tick: int) -> Array:
    """One tick of (flights, agents, ticks, 3): (3, bodies)."""
    return np.ascontiguousarray(values[:, :, tick].reshape(-1, 3).T)
