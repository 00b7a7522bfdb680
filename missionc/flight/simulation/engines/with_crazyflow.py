"""The crazyflow engine: a Crazyflie 2.1+ from first principles, flown by the firmware's Mellinger controller.

Source:
    crazyflow 0.4.0, drone ``cf2x_L250``: 32.8 g; its controller assumes 29 g.
"""

from __future__ import annotations

from collections.abc import Sequence

import jax.numpy as jnp
import numpy as np
from crazyflow.control import Control
from crazyflow.drones import Drone
from crazyflow.dynamics import Dynamics
from crazyflow.sim import Sim
from numpy.typing import NDArray

from missionc.base.trace import Array
from missionc.flight.simulation import disturbance
from missionc.flight.simulation.default_engine import COMMANDS, Flown, sample_times
from missionc.flight.simulation.disturbance import GRAVITY, SETPOINTS_PER_SECOND, setpoints
from missionc.geometry.curves.piecewise_polynomials import Pieces

HOVERED = 11
"""Hover before the start, seconds, in which the controller's integral settles: its duration in a start script."""


def fly(pieces: Sequence[Pieces], seconds: float) -> Flown:
    """Flight of all agents simulated together in one crazyflow world."""
    times = sample_times(seconds)
    reference = np.stack([setpoints(own, times) for own in pieces])
    simulator = Sim(
        n_worlds=1,
        n_drones=len(pieces),
        drone=Drone.cf2x_L250,
        dynamics=Dynamics.first_principles,
        control=Control.state,
        freq=SETPOINTS_PER_SECOND * COMMANDS,
        state_freq=SETPOINTS_PER_SECOND,
        attitude_freq=SETPOINTS_PER_SECOND * COMMANDS,
    )
    simulator.reset()
    commands = _commands(reference)
    state = simulator.data.states
    simulator.data = simulator.data.replace(
        states=state.replace(
            pos=jnp.asarray(commands[None, :, 0, :3]),
            quat=jnp.asarray(commands[None, :, 0, 9:13]),
            rotor_vel=jnp.full_like(state.rotor_vel, _hover(simulator)),
        )
    )
    simulator.state_control(commands[None, :, 0])
    simulator.step(HOVERED * SETPOINTS_PER_SECOND * COMMANDS)
    track = np.empty((len(pieces), times.size, 10))
    for tick in range(times.size):
        state = simulator.data.states
        track[:, tick] = np.concatenate([np.asarray(part)[0] for part in (state.pos, state.vel, state.quat)], axis=-1)
        simulator.state_control(commands[None, :, tick])
        simulator.step(COMMANDS)
    simulator.close()
    x, y, z, w = np.moveaxis(track[..., 6:], -1, 0)
    heading = np.arctan2(2 * (x * y + w * z), 1 - 2 * (y * y + z * z))
    return Flown(times, track[None, ..., :3], track[None, ..., 3:6], heading[None])


def _hover(simulator: Sim) -> float:
    """Rotor speed in rpm whose thrust is a quarter of the vehicle's weight."""
    params = simulator.data.params
    offset, linear, square = (float(value) for value in np.asarray(params.rpm2thrust).reshape(-1)[:3])
    lift = float(np.asarray(params.mass).reshape(-1)[0]) * GRAVITY / 4
    return float(max(np.roots([square, linear, offset - lift]).real))


def _commands(reference: Array) -> NDArray[np.float32]:
    """Crazyflow commands from setpoints: (agents, 13, samples) -> (agents, samples, 16).

    A command has metres to m/s², attitude (x, y, z, w), and rad/s.
    """
    yaw = reference[:, disturbance.YAW]
    flat = np.zeros_like(yaw)
    attitude = np.stack([flat, flat, np.sin(yaw / 2), np.cos(yaw / 2)], axis=1)
    rows = [reference[:, :9], attitude, reference[:, disturbance.RATES]]
    return np.ascontiguousarray(np.moveaxis(np.concatenate(rows, axis=1), 1, 2), dtype=np.float32)
