"""The default simulation engine: every agent of several flights, moved together through the air.

    in   Pieces of each agent, what was drawn for each flight
    out  Flown

The controller is asked 500 times a second, as on board; the body moves as
often. Agents do not touch and do not blow at each other.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from missionc.base.trace import Array
from missionc.curves.crazyflie_csv import Pieces
from missionc.simulate import firmware_setpoints, quadrotor
from missionc.simulate.controller import Controller, Gains
from missionc.simulate.disturbance import Drawn
from missionc.simulate.firmware_setpoints import SETPOINTS_PER_SECOND, setpoints
from missionc.simulate.quadrotor import Vehicle

COMMANDS = 5
"""Commands of the controller for each setpoint."""


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


def fly(
    pieces: Sequence[Pieces],
    drawn: Drawn,
    seconds: float,
    vehicle: Vehicle | None = None,
    gains: Gains | None = None,
) -> Flown:
    """Flights from rest at the start until ``seconds`` are over."""
    vehicle, gains = vehicle or Vehicle(), gains or Gains()
    times = sample_times(seconds)
    flights, agents = drawn.mass.shape
    bodies = flights * agents
    each = np.empty((13, times.size, flights, agents))
    for agent, own in enumerate(pieces):
        each[..., agent] = setpoints(own, times[:, None] - drawn.clock[:, agent])
    reference = each.reshape(13, times.size, bodies)
    wind = np.moveaxis(drawn.wind.reshape(bodies, -1, 3), 0, 2)
    mass = drawn.mass.ravel() * vehicle.mass
    start = reference[firmware_setpoints.POSITION, 0] + drawn.start.reshape(bodies, 3).T
    state = quadrotor.at_rest(vehicle, start, reference[firmware_setpoints.YAW, 0])
    step = 1 / (SETPOINTS_PER_SECOND * COMMANDS)
    controller = Controller(vehicle, gains, step)
    track = np.empty((10, times.size, bodies))
    for tick in range(times.size):
        track[:, tick] = state[:10]
        air = wind[tick].copy(order="C")
        for _ in range(COMMANDS):
            state = quadrotor.moved(vehicle, mass, state, controller.thrust(state, reference[:, tick]), air, step)

    def by_flight(rows: Array) -> Array:
        return np.moveaxis(rows.reshape(rows.shape[0], times.size, flights, agents), (2, 3, 1, 0), (0, 1, 2, 3))

    return Flown(
        times,
        np.ascontiguousarray(by_flight(track[quadrotor.POSITION])),
        np.ascontiguousarray(by_flight(track[quadrotor.VELOCITY])),
        by_flight(quadrotor.heading(track[quadrotor.ATTITUDE])[None])[..., 0],
    )
