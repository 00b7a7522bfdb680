"""Disturbances of a flight: of the air, of the vehicle, of what it knows, and of what it is told.

Every flight draws from a generator of its own, made of the seed and the
flight's number: the same whichever flights are flown with it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from missionc.base.trace import Array
from missionc.simulate.firmware_setpoints import SETPOINTS_PER_SECOND

GUST_SECONDS = 0.5
"""After so long a gust has lost all but 37 % of itself: chosen as quick as a Crazyflie's answer to its position."""
NOISE_SECONDS = 0.2
"""Likewise of the estimator's error: chosen; an estimate that is filtered wanders, and does not jump."""


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
        noise: standard deviation along each axis of the error of the position that its controller is shown, m; for each
            agent an Ornstein-Uhlenbeck process of its own.
        latency: position and velocity are shown so late, s.
        packets: this share of the position updates is lost; from one that came, the controller goes on at the velocity
            that it had.
        missed: this share of the vehicles never hears the start, and hovers where it began.
        battery: the most that a motor gives falls by this share until the end of the flight.
        motor: one motor of each vehicle gives up to this share less than it is told.
        downwash: who is below another one is pushed down by so many times the force of a published model
            (``downwash.push``).
        lose: whose motors stop, and when, s.
    """

    wind: float = 0.0
    gust: float = 0.0
    mass: float = 0.0
    start: float = 0.0
    clock: float = 0.0
    noise: float = 0.0
    latency: float = 0.0
    packets: float = 0.0
    missed: float = 0.0
    battery: float = 0.0
    motor: float = 0.0
    downwash: float = 0.0
    lose: tuple[tuple[str, float], ...] = ()

    @property
    def random(self) -> bool:
        """Flights differ: something is drawn for each. Otherwise all of them are one and the same."""
        drawn = self.wind, self.gust, self.mass, self.start, self.clock, self.noise, self.packets, self.missed
        return any((*drawn, self.motor))


UNDISTURBED = Disturbance()


@dataclass(frozen=True, slots=True, eq=False)
class Drawn:
    """What was drawn for some flights. A tick is the time between two setpoints.

    Args:
        mass: (flights, agents), factors.
        start: (flights, agents, 3), m.
        clock: (flights, agents), s; infinite where the start is never heard.
        motors: (flights, agents, 4), the share that each motor gives of what it is told.
        wind: (flights, agents, ticks, 3), m/s.
        noise: (flights, agents, ticks, 3), m: how far beside its position each is shown.
        stale: (flights, agents, ticks): no position update comes.
    """

    mass: Array
    start: Array
    clock: Array
    motors: Array
    wind: Array
    noise: Array | None = None
    stale: NDArray[np.bool_] | None = None


def drawn(disturbance: Disturbance, seed: int, flights: range, agents: int, ticks: int) -> Drawn:
    """For the flights with these numbers."""
    each = [np.random.default_rng([seed, flight]) for flight in flights]
    shape = (len(flights), agents)

    def uniform(low: float, high: float, *more: int) -> Array:
        return np.stack([random.uniform(low, high, (agents, *more)) for random in each])

    mass = 1 + disturbance.mass * uniform(-1, 1)
    beside = disturbance.start * uniform(-1, 1, 2)
    clock = disturbance.clock * uniform(0, 1)
    angle = np.array([random.uniform(0, 2 * math.pi) for random in each])
    level = np.stack([np.cos(angle), np.sin(angle), np.zeros_like(angle)], axis=-1)
    weak = np.stack([random.integers(4, size=agents) for random in each])
    given = 1 - disturbance.motor * uniform(0, 1)
    clock[uniform(0, 1) < disturbance.missed] = math.inf
    wind = np.broadcast_to((disturbance.wind * level)[:, None, None], (*shape, ticks, 3))
    if disturbance.gust:
        wind = wind + disturbance.gust * _wandering(each, agents, ticks, GUST_SECONDS)
    stale = None
    if disturbance.packets:
        stale = np.stack([random.uniform(size=(agents, ticks)) < disturbance.packets for random in each])
    return Drawn(
        mass,
        np.concatenate([beside, np.zeros((*shape, 1))], axis=-1),
        clock,
        np.where(np.arange(4) == weak[..., None], given[..., None], 1.0),
        wind,
        disturbance.noise * _wandering(each, agents, ticks, NOISE_SECONDS) if disturbance.noise else None,
        stale,
    )


def _wandering(each: list[np.random.Generator], agents: int, ticks: int, seconds: float) -> Array:
    """Ornstein-Uhlenbeck processes of variance one, exact at their ticks: (flights, agents, ticks, 3).

    Args:
        seconds: after which one has lost all but 37 % of itself.
    """
    noise = np.empty((ticks, len(each), agents, 3))
    for flight, random in enumerate(each):
        noise[:, flight] = random.standard_normal((ticks, agents, 3))
    stays = math.exp(-1 / (SETPOINTS_PER_SECOND * seconds))
    noise[1:] *= math.sqrt(1 - stays**2)
    for tick in range(1, ticks):
        noise[tick] += stays * noise[tick - 1]
    return np.moveaxis(noise, 0, 2)
