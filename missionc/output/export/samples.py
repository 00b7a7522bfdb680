"""Samples of a flight at regular times, for exports without polynomials."""

from __future__ import annotations

import math

import numpy as np

from missionc.base.late_dataclass import Record
from missionc.base.trace import Array
from missionc.output.export.verified_flight import Flight
from missionc.verification.certificate import CLOCK

RATE = 20
"""Number of samples per second."""


class Samples(Record, eq=False):
    """States of every agent at some times of a flight.

    Args:
        times: (samples,), seconds, including the beginning and the end of the flight.
        position, velocity, acceleration: (agents, samples, 3), metres, m/s, m/s².
        yaw, yaw_rate: (agents, samples), rad, rad/s.
    """

    times: Array
    position: Array
    velocity: Array
    acceleration: Array
    yaw: Array
    yaw_rate: Array


def sampled(flight: Flight) -> Samples:
    """Samples of a flight, ``RATE`` per second and one at the end.

    A sample too close to the end for clocks is omitted.
    """
    nearly = flight.duration - CLOCK * max(1.0, flight.duration)
    inner = np.arange(math.ceil(nearly * RATE)) / RATE
    times = np.append(inner, flight.duration)
    place, turn = flight.curves, flight.yaws
    velocity, rate = place.derivative(), turn.derivative()
    return Samples(
        times,
        place.at(times),
        velocity.at(times),
        velocity.derivative().at(times),
        turn.at(times)[..., 0],
        rate.at(times)[..., 0],
    )


def fixed(number: float) -> str:
    """Text of a number with nine decimals; adding zero after rounding turns -0 into 0."""
    return f"{round(number, 9) + 0.0:.9f}"


def clock(seconds: float) -> tuple[int, int]:
    """A time as seconds and nanoseconds."""
    return divmod(round(seconds * 1e9), 1_000_000_000)
