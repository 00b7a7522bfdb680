"""Claims of each vehicle's profile about its flight: every limit that is finite, at every moment.

in   Mission, Flight
out  claims, and the checks of what does not change along the flight
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from missionc.base.trace import Array
from missionc.curves.bernstein_intervals import Enclosed
from missionc.curves.piecewise_polynomials import Indices
from missionc.ir import PLAIN, Mission, Vehicle
from missionc.verify.certificate import Check
from missionc.verify.flight.flight_curves import Flight
from missionc.verify.proof.claims import Claim, Judge, of_agents
from missionc.verify.proof.interval_margins import at_most, between, in_band, upright
from missionc.verify.tolerances import CERTAIN, MOTION

GRAVITY = 9.81
"""m/s², as the firmware has it."""

PIECE_BYTES = 132
"""What one piece takes of a vehicle's memory (crazyflie-firmware, pptraj.c)."""

COMPRESSED_BYTES = {2: 31, 3: 45}
"""The same in the firmware's compressed format, by the mission's dimension; and 11 more for its start and its end."""


def limits(mission: Mission, flight: Flight) -> list[Claim]:
    """One claim for each figure that some vehicle limits, about those vehicles."""
    acceleration = flight.derived(2)
    thrust = acceleration.moved(np.array([0.0, 0.0, GRAVITY]))
    lengths: tuple[tuple[str, str, str, Enclosed, Callable[[Vehicle], float]], ...] = (
        ("speed", "m/s", "sideways", flight.derived(1, (0, 1)), lambda vehicle: vehicle.speed),
        ("vertical speed", "m/s", "up and down", flight.derived(1, (2,)), lambda vehicle: vehicle.vertical_speed),
        ("acceleration", "m/s^2", "in any direction", acceleration, lambda vehicle: vehicle.acceleration),
        ("jerk", "m/s^3", "in any direction", flight.derived(3), lambda vehicle: vehicle.jerk),
        ("yaw rate", "rad/s", "about the vertical", flight.derived(1, (3,)), lambda vehicle: vehicle.yaw_rate),
    )
    claims = []
    for name, unit, which, curves, figure in lengths:
        most = np.array([figure(agent.vehicle) for agent in mission.agents])
        chosen = np.flatnonzero(np.isfinite(most))
        judge = at_most(_of_items(flight, most[chosen]))
        claims.append(_claim(flight, name, unit, f"no vehicle exceeds its limit {which}", chosen, curves, judge))
    most = np.array([agent.vehicle.tilt for agent in mission.agents])
    chosen = np.flatnonzero(np.isfinite(most))
    judge = upright(_of_items(flight, most[chosen]))
    detail = "no vehicle leans its thrust further from straight up than it may"
    claims.append(_claim(flight, "tilt", "rad", detail, chosen, thrust, judge))
    # A length is never negative: a band from 0 has no lower end.
    low = np.array([agent.vehicle.thrust.low or -np.inf for agent in mission.agents])
    high = np.array([agent.vehicle.thrust.high for agent in mission.agents])
    chosen = np.flatnonzero(np.isfinite(low) | np.isfinite(high))
    judge = in_band(_of_items(flight, low[chosen]), _of_items(flight, high[chosen]))
    detail = "every vehicle's thrust, in multiples of its weight, is in its band"
    claims.append(_claim(flight, "thrust", "g", detail, chosen, thrust.scaled(1 / GRAVITY), judge))
    low = np.array([agent.vehicle.height.low for agent in mission.agents])
    high = np.array([agent.vehicle.height.high for agent in mission.agents])
    chosen = np.flatnonzero(np.isfinite(low) | np.isfinite(high))
    judge = between(_of_items(flight, low[chosen])[:, None], _of_items(flight, high[chosen])[:, None])
    detail = "every vehicle is in its band of heights"
    claims.append(_claim(flight, "height", "m", detail, chosen, flight.position[:, :, [2]], judge))
    return [claim for claim in claims if claim.items]


def check_memory(mission: Mission, flight: Flight) -> list[Check]:
    """That each vehicle's memory holds its pieces; a plain agent's owner is only warned."""
    pieces = flight.durations.size
    raw, compressed = pieces * PIECE_BYTES, pieces * COMPRESSED_BYTES[mission.dimension] + 11
    size = min(raw, compressed)
    return [
        Check(
            "memory",
            agent.name,
            float(agent.vehicle.memory - size),
            "bytes",
            0.0,
            size <= agent.vehicle.memory,
            agents=(agent.name,),
            detail=f"{pieces} pieces take {raw} bytes, {compressed} compressed; it holds {agent.vehicle.memory}",
        )
        for agent in mission.agents
        if agent.vehicle != PLAIN
    ]


def check_endurance(mission: Mission, flight: Flight) -> list[Check]:
    """That the flight of each vehicle ends before its battery does."""
    seconds = float(flight.durations.sum())
    return [
        Check(
            "endurance",
            agent.name,
            agent.vehicle.endurance - seconds,
            "s",
            0.0,
            seconds <= agent.vehicle.endurance,
            agents=(agent.name,),
            detail=f"its polynomials last {seconds:g} s; on one charge it flies {agent.vehicle.endurance:g} s",
        )
        for agent in mission.agents
        if np.isfinite(agent.vehicle.endurance)
    ]


def _of_items(flight: Flight, figure: Array) -> Array:
    return np.repeat(figure, flight.durations.size)


def _claim(flight: Flight, name: str, unit: str, detail: str, chosen: Indices, curves: Enclosed, judge: Judge) -> Claim:
    return Claim(
        f"flown {name}",
        "vehicles",
        unit,
        MOTION,
        detail,
        chosen[:, None],
        flight.times,
        of_agents(curves[chosen]),
        judge,
        CERTAIN,
    )
