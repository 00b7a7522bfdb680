"""Benchmark of tracking errors by speed and acceleration, on every installed simulator.

    python bench/tracking.py [ENGINE...]

Flies three shapes with each engine, undisturbed: legs from rest to rest around a square that climbs and sinks, which
reach maximum speed and acceleration for an instant; circles, on which both are constant; and one leg that starts
abruptly, with a jump in jerk and thus in the commanded body rate. Prints the maximum distance from the reference, mm,
for each speed and acceleration within the limits of the profile `crazyflie21` and beyond them; below them, the
profile's tracking margin.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from importlib import import_module
from importlib.util import find_spec

if find_spec("crazyflow"):
    import_module("crazyflow")  # It must be set before scipy is loaded.

import numpy as np

from missionc.base.trace import Array
from missionc.flight.simulation import disturbance
from missionc.flight.simulation.default_engine import Flown, fly, sample_times
from missionc.flight.simulation.disturbance import UNDISTURBED, drawn, setpoints
from missionc.flight.simulation.engines import fly_with
from missionc.geometry.curves.piecewise_polynomials import Pieces
from missionc.ir.vehicle_profiles import profiles

SPEEDS = (0.5, 1.0, 1.5)
"""Speeds, m/s."""
ACCELERATIONS = (0.5, 1.0, 2.0, 3.0)
"""Accelerations, m/s²."""
TURNS = 1
"""Number of rounds of a circle, after two for its approach."""


def legs(speed: float, acceleration: float) -> Pieces:
    """Polynomials of degree seven from rest to rest around a square, alternating in height.

    One over d within T, with no jerk at its ends, reaches 35/16 d/T and 84/(5 √5) d/T².
    """
    seconds = 84 / (5 * np.sqrt(5)) * 16 / 35 * speed / acceleration
    far = speed * seconds * 16 / 35
    corners = np.array([(0, 0, 1), (far, 0, 1), (far, far, 1), (0, far, 1), (0, 0, 1)]) + 0.0
    corners[1::2, 2] += min(0.4, 0.25 * far)
    step = np.diff(corners, axis=0)
    step *= far / np.linalg.norm(step, axis=1, keepdims=True)
    corners = corners[0] + np.concatenate([np.zeros((1, 3)), np.cumsum(step, axis=0)])
    coefficients = np.zeros((4, 4, 8))
    coefficients[:, :3, 0] = corners[:-1]
    powers = seconds ** -np.array([4.0, 5.0, 6.0, 7.0]) * np.array([35.0, -84.0, 70.0, -20.0])
    coefficients[:, :3, 4:8] = step[..., None] * powers
    return rounded(np.full(4, seconds), coefficients)


def jumps(speed: float, acceleration: float) -> Pieces:
    """A quintic from rest to rest, then two seconds of rest.

    One over d within T reaches 15/8 d/T and 10/√3 d/T², and begins and ends with a jerk of 60 d/T³.
    """
    seconds = 10 / np.sqrt(3) * 8 / 15 * speed / acceleration
    far = speed * seconds * 8 / 15
    coefficients = np.zeros((2, 4, 8))
    coefficients[:, 2, 0] = 1.0
    coefficients[0, 0, 3:6] = far * seconds ** -np.array([3.0, 4.0, 5.0]) * np.array([10.0, -15.0, 6.0])
    coefficients[1, 0, 0] = far
    return rounded(np.array([seconds, 2.0]), coefficients)


def circles(speed: float, acceleration: float) -> Pieces:
    """From rest in the middle of a spiral onto a circle of radius v²/a, and around it."""
    radius, rate = speed**2 / acceleration, acceleration / speed
    begin, seconds = 4 * np.pi / rate, 2 * np.pi * (TURNS + 2) / rate

    def place(time: Array) -> Array:
        share = np.clip(time / begin, 0, 1)
        out = radius * share**5 * (126 - 420 * share + 540 * share**2 - 315 * share**3 + 70 * share**4)
        return np.stack([out * np.cos(rate * time), out * np.sin(rate * time), np.ones_like(time)], axis=-1)

    return hermite(place, np.linspace(0, seconds, 8 * (TURNS + 2) + 1))


def hermite(place: Callable[[Array], Array], knots: Array) -> Pieces:
    """Polynomials of degree seven with the place's value and three derivatives at each knot, (knots,), s."""
    step = 1e-3
    around = np.stack([place(knots + offset * step) for offset in range(-3, 4)])
    first = (around[4] - around[2]) / (2 * step)
    second = (around[4] - 2 * around[3] + around[2]) / step**2
    third = (around[5] - 2 * around[4] + 2 * around[2] - around[1]) / (2 * step**3)
    known = np.stack([around[3], first, second, third], axis=1)
    coefficients = np.zeros((knots.size - 1, 4, 8))
    for piece, seconds in enumerate(np.diff(knots).tolist()):
        rows = [[_falling(power, order) * (power == order) for power in range(8)] for order in range(4)]
        rows += [
            [_falling(power, order) * seconds ** max(power - order, 0) for power in range(8)] for order in range(4)
        ]
        both = np.concatenate([known[piece], known[piece + 1]])
        coefficients[piece, :3] = np.linalg.solve(np.array(rows), both).T
    return rounded(np.diff(knots), coefficients)


def _falling(power: int, order: int) -> float:
    """Falling factorial power (power - 1) …: coefficient of the derivative of that order."""
    return float(np.prod([power - each for each in range(order)])) if power >= order else 0.0


def rounded(durations: Array, coefficients: Array) -> Pieces:
    """Pieces in float32, as uploaded; durations (pieces,), s, coefficients (pieces, 4, 8)."""
    return Pieces(durations.astype(np.float32).astype(float), coefficients.astype(np.float32).astype(float))


def error(pieces: Pieces, engine: str) -> float:
    """Maximum tracking error, mm."""
    seconds = float(pieces.duration.sum())
    times = sample_times(seconds)
    flown: Flown
    if engine == "quadrotor":
        flown = fly([pieces], drawn(UNDISTURBED, 0, range(1), 1, times.size), seconds)
    else:
        flown = fly_with(engine, [pieces], seconds)
    told = setpoints(pieces, times)[disturbance.POSITION].T
    return float(1000 * np.linalg.norm(flown.position[0, 0] - told, axis=-1).max())


def main() -> None:
    engines = [name for name in ("quadrotor", "rotorpy", "crazyflow") if name == "quadrotor" or find_spec(name)]
    engines = [name for name in engines if name in sys.argv[1:]] or engines
    print("| engine | shape | speed m/s | " + " | ".join(f"{each:g} m/s²" for each in ACCELERATIONS) + " |")
    print("|---|---|---|" + "---|" * len(ACCELERATIONS))
    for engine in engines:
        for shape in (legs, circles, jumps):
            for speed in SPEEDS:
                row = [f"{error(shape(speed, each), engine):.0f}" for each in ACCELERATIONS]
                print(f"| {engine} | {shape.__name__} | {speed:g} | " + " | ".join(row) + " |", flush=True)
    vehicle = profiles()["crazyflie21"]
    print(
        f"\ncrazyflie21: {vehicle.speed:g} m/s, {vehicle.acceleration:g} m/s², tracking {1000 * vehicle.tracking:g} mm"
    )


if __name__ == "__main__":
    main()
