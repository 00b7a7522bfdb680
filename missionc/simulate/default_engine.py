"""The default simulation engine: every agent of several flights, moved together through the air.

    in   Pieces of each agent, what was drawn for each flight
    out  Flown

``Airborne`` is moved from setpoint to setpoint by whoever has setpoints; ``fly``
has them of polynomials. The controller is asked 500 times a second, as on
board; the body moves as often. Agents do not touch and do not blow at each other.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from missionc.base.trace import Array
from missionc.curves.crazyflie_csv import Pieces
from missionc.simulate import firmware_setpoints, quadrotor
from missionc.simulate.controller import Controller, Gains
from missionc.simulate.disturbance import Drawn
from missionc.simulate.firmware_setpoints import SETPOINTS_PER_SECOND, setpoints
from missionc.simulate.quadrotor import Vehicle

COMMANDS = 5
"""Commands of the controller for each setpoint."""
COMMAND_SECONDS = 1 / (SETPOINTS_PER_SECOND * COMMANDS)
"""Between two commands of the controller."""


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

    They begin hovering. What they are told may change with every setpoint, so that whoever plans anew in flight tells
    them something else from then on. A body is a column everywhere.

    Args:
        position: where they begin, (3, bodies), m.
        yaw: (bodies,), rad.
        mass: what each weighs, (bodies,), kg; what its controller thinks where none is given.
    """

    def __init__(
        self,
        position: Array,
        yaw: Array,
        mass: Array | None = None,
        vehicle: Vehicle | None = None,
        gains: Gains | None = None,
    ) -> None:
        self.vehicle = vehicle or Vehicle()
        self._state = quadrotor.at_rest(self.vehicle, position, yaw)
        self._mass = np.full(position.shape[1], self.vehicle.mass) if mass is None else mass
        self._controller = Controller(self.vehicle, gains or Gains(), COMMAND_SECONDS)
        self._lost = np.zeros(position.shape[1], dtype=bool)

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

    def advance(self, reference: Array, wind: Array | None = None) -> None:
        """Move on by the time between two setpoints, ``1 / SETPOINTS_PER_SECOND`` s.

        Args:
            reference: what each is told, (13, bodies), as ``firmware_setpoints.setpoints`` makes it.
            wind: (3, bodies), m/s; still air where none is given.
        """
        air = np.zeros_like(reference[:3]) if wind is None else wind
        for _ in range(COMMANDS):
            thrust = self._controller.thrust(self._state, reference)
            thrust[:, self._lost] = 0.0
            self._state = quadrotor.moved(self.vehicle, self._mass, self._state, thrust, air, COMMAND_SECONDS)
        self._land()

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
) -> Flown:
    """Flights from rest at the start until ``seconds`` are over."""
    vehicle = vehicle or Vehicle()
    times = sample_times(seconds)
    flights, agents = drawn.mass.shape
    bodies = flights * agents
    each = np.empty((13, times.size, flights, agents))
    for agent, own in enumerate(pieces):
        each[..., agent] = setpoints(own, times[:, None] - drawn.clock[:, agent])
    reference = each.reshape(13, times.size, bodies)
    wind = np.moveaxis(drawn.wind.reshape(bodies, -1, 3), 0, 2)
    start = reference[firmware_setpoints.POSITION, 0] + drawn.start.reshape(bodies, 3).T
    mass = drawn.mass.ravel() * vehicle.mass
    air = Airborne(start, reference[firmware_setpoints.YAW, 0], mass, vehicle, gains)
    position, velocity = np.empty((2, times.size, 3, bodies))
    heading = np.empty((times.size, bodies))
    for tick in range(times.size):
        position[tick], velocity[tick], heading[tick] = air.position, air.velocity, air.heading
        air.advance(reference[:, tick], wind[tick].copy(order="C"))

    def by_flight(rows: Array) -> Array:
        """(samples, 3, bodies) -> (flights, agents, samples, 3)."""
        return np.ascontiguousarray(np.moveaxis(rows.reshape(times.size, 3, flights, agents), (2, 3), (0, 1)))

    turned = np.moveaxis(heading.reshape(times.size, flights, agents), 0, 2)
    return Flown(times, by_flight(position), by_flight(velocity), turned)
