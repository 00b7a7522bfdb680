"""The rotorpy engine: its Crazyflie model with rotor aerodynamics and motors, and its SE(3) controller.

Source:
    Folk, Paulos and Kumar, "RotorPy: A Python-based Multirotor Simulator with Aerodynamics for Education and
    Research" (2023).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from rotorpy.controllers.quadrotor_control import SE3Control
from rotorpy.vehicles.crazyflie_params import quad_params
from rotorpy.vehicles.multirotor import Multirotor

from missionc.base.trace import Array
from missionc.flight.simulation import disturbance
from missionc.flight.simulation.default_engine import Flown, sample_times
from missionc.flight.simulation.disturbance import GRAVITY, SETPOINTS_PER_SECOND, setpoints
from missionc.geometry.curves.piecewise_polynomials import Pieces


def fly(pieces: Sequence[Pieces], seconds: float) -> Flown:
    """Flight in which each agent is simulated separately, because the engine supports one vehicle."""
    times = sample_times(seconds)
    states = np.stack([_one(setpoints(own, times), times) for own in pieces])
    x, y, z, w = np.moveaxis(states[..., 6:], -1, 0)
    heading = np.arctan2(2 * (x * y + w * z), 1 - 2 * (y * y + z * z))
    return Flown(times, states[None, ..., :3], states[None, ..., 3:6], heading[None])


def _one(reference: Array, times: Array) -> Array:
    """Trajectory of one agent from setpoints: (13, samples) -> (samples, 10).

    A row has the position, metres, the velocity, m/s, and the attitude (x, y, z, w).
    """
    hover = float(np.sqrt(quad_params["mass"] * GRAVITY / 4 / quad_params["k_eta"]))
    state = {
        "x": reference[disturbance.POSITION, 0].copy(),
        "v": np.zeros(3),
        "q": np.array(
            [
                0.0,
                0.0,
                np.sin(reference[disturbance.YAW, 0] / 2),
                np.cos(reference[disturbance.YAW, 0] / 2),
            ]
        ),
        "w": np.zeros(3),
        "wind": np.zeros(3),
        "rotor_speeds": np.full(4, hover),
    }
    vehicle, controller = Multirotor(quad_params, initial_state=state), SE3Control(quad_params)
    track = np.empty((times.size, 10))
    for tick, time in enumerate(times.tolist()):
        track[tick] = np.concatenate([state["x"], state["v"], state["q"]])
        flat = {
            "x": reference[disturbance.POSITION, tick],
            "x_dot": reference[disturbance.VELOCITY, tick],
            "x_ddot": reference[disturbance.ACCELERATION, tick],
            "yaw": reference[disturbance.YAW, tick],
            "yaw_dot": reference[disturbance.RATES, tick][2],
        }
        command = controller.update(time, _seen(state, reference[disturbance.RATES, tick]), flat)
        state = vehicle.step(state, command, 1 / SETPOINTS_PER_SECOND)
    return track


def _seen(state: dict[str, Array], rates: Array) -> dict[str, Array]:
    """State as the controller receives it, with roll and pitch rates reduced by their commands.

    The controller supports only the yaw rate and damps all others, which delays its attitude by 0.18 s (``kd_att`` over
    ``kp_att``). The firmware, and the controller in the source, take all body rates.

    Source:
        Lee, Leok and McClamroch, "Geometric Tracking Control of a Quadrotor UAV on SE(3)" (2010), equation 11.

    Args:
        rates: commanded body rates, (3,), rad/s.
    """
    return {**state, "w": state["w"] - np.array([rates[0], rates[1], 0.0])}
