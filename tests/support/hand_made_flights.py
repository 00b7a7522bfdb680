"""Flights of hand-made missions for tests of exports."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
from numpy.typing import NDArray

from missionc.flight.trajectories.crazyflie import Flyable, crazyflie
from missionc.geometry.curves.piecewise_polynomials import Pieces, written
from missionc.output.export.verified_flight import Flight, Part, flight
from tests.support.legal_plans import NOTHING, mission_of, straight, wandering

Array = NDArray[np.float64]


@cache
def wandered(agents: int = 2, steps: int = 6, dimension: int = 3, step: float = 1.0, seed: int = 3) -> Flight:
    """Random walks, in separate columns at both ends."""
    path = wandering(seed, agents, steps, dimension)
    if dimension == 3:
        # No agent starts or ends above another.
        path[..., 0] += 12.0 * np.arange(agents)[:, None]
    mission = mission_of(path[:, 0].tolist(), steps, step=step, size=10.0 + 12.0 * agents)
    trace = straight(path, step)
    found = crazyflie(mission, NOTHING, trace)
    assert isinstance(found, Flyable), found
    return flight(mission, NOTHING, trace, found.files)


def turning(flown: Flight, rate: float) -> Flight:
    """Flight with constant yaw rate, rad/s, from 0.5 rad on."""
    texts = {}
    for each in flown.parts:
        coefficients = each.pieces.coefficients.copy()
        coefficients[:, 3, 0] = 0.5 + rate * flown.times[:-1]
        coefficients[:, 3, 1] = rate
        texts[each.agent.name] = written(Pieces(each.pieces.duration, coefficients))
    return flight(flown.mission, flown.kernel, flown.trace, texts)


def cramped(flown: Flight, memory: int) -> Flight:
    """Flight of vehicles with ``memory`` bytes of trajectory memory."""
    agents = tuple(replace(agent, vehicle=replace(agent.vehicle, memory=memory)) for agent in flown.mission.agents)
    texts = {each.agent.name: each.text for each in flown.parts}
    return flight(replace(flown.mission, agents=agents), flown.kernel, flown.trace, texts)


def place(vehicle: Part, time: float, order: int = 0) -> Array:
    """Setpoint of the firmware or a derivative of it, (4,): x, y, z in metres, yaw in rad."""
    durations, coefficients = vehicle.pieces.duration, vehicle.pieces.coefficients
    piece, local = 0, time
    while piece < len(durations) - 1 and local > durations[piece]:
        local -= float(durations[piece])
        piece += 1
    local = min(local, float(durations[piece]))
    return np.array([np.polynomial.Polynomial(axis).deriv(order)(local) for axis in coefficients[piece]])
