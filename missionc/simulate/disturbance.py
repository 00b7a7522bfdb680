"""Disturbances of a flight: wind, a wrong mass, a start beside the start, a late clock.

Every flight draws from a generator of its own, made of the seed and the
flight's number: the same whichever flights are flown with it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from missionc.base.trace import Array
from missionc.simulate.firmware_setpoints import SETPOINTS_PER_SECOND

GUST_SECONDS = 0.5
"""After so long a gust has lost all but 37 % of itself: chosen as quick as a Crazyflie's answer to its position."""


@dataclass(frozen=True, slots=True)
class Disturbance:
    """How much of everything; nothing where nothing is given.

    Args:
        wind: speed of the constant wind, m/s; level, and from anywhere.
        gust: standard deviation along each axis of what is added to it, m/s; for each agent an Ornstein-Uhlenbeck
            process of its own.
        mass: a vehicle weighs up to this share more or less than its controller thinks.
        start: it begins up to so far beside its start, along x and along y, m.
        clock: it begins up to so late, s.
    """

    wind: float = 0.0
    gust: float = 0.0
    mass: float = 0.0
    start: float = 0.0
    clock: float = 0.0


UNDISTURBED = Disturbance()


@dataclass(frozen=True, slots=True, eq=False)
class Drawn:
    """What was drawn for some flights.

    Args:
        mass: (flights, agents), factors.
        start: (flights, agents, 3), m.
        clock: (flights, agents), s.
        wind: (flights, agents, ticks, 3), m/s; a tick is the time between two setpoints.
    """

    mass: Array
    start: Array
    clock: Array
    wind: Array


def drawn(disturbance: Disturbance, seed: int, flights: range, agents: int, ticks: int) -> Drawn:
    """For the flights with these numbers."""
    each = [_one(disturbance, np.random.default_rng([seed, flight]), agents, ticks) for flight in flights]
    mass, start, clock, wind = (np.stack(column) for column in zip(*each, strict=True))
    return Drawn(mass, start, clock, wind)


def _one(
    disturbance: Disturbance, random: np.random.Generator, agents: int, ticks: int
) -> tuple[Array, Array, Array, Array]:
    mass = 1 + disturbance.mass * random.uniform(-1, 1, agents)
    beside = disturbance.start * random.uniform(-1, 1, (agents, 2))
    start = np.concatenate([beside, np.zeros((agents, 1))], axis=1)
    clock = disturbance.clock * random.uniform(0, 1, agents)
    angle = random.uniform(0, 2 * math.pi)
    wind = np.tile(disturbance.wind * np.array([math.cos(angle), math.sin(angle), 0.0]), (agents, ticks, 1))
    if disturbance.gust:
        wind += disturbance.gust * _gusts(random, agents, ticks)
    return mass, start, clock, wind


def _gusts(random: np.random.Generator, agents: int, ticks: int) -> Array:
    """An Ornstein-Uhlenbeck process of variance one, exact at its ticks: (agents, ticks, 3)."""
    noise = random.standard_normal((agents, ticks, 3))
    stays = math.exp(-1 / (SETPOINTS_PER_SECOND * GUST_SECONDS))
    for tick in range(1, ticks):
        noise[:, tick] = stays * noise[:, tick - 1] + math.sqrt(1 - stays**2) * noise[:, tick]
    return noise
