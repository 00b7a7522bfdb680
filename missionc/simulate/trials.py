"""Monte Carlo trials: flights judged one by one, flown many at a time.

    in   Mission, its kernel, each agent's Pieces, how to fly
    out  Trials

Only as many flights as fit into ``MOST_BYTES`` are in the air together.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from missionc.base.trace import Array
from missionc.curves.crazyflie_csv import Pieces
from missionc.ir import Mission
from missionc.kernel.nodes import Kernel
from missionc.simulate import firmware_setpoints
from missionc.simulate.confidence_interval import Fraction, fraction
from missionc.simulate.default_engine import Flown, fly, sample_times
from missionc.simulate.disturbance import UNDISTURBED, Disturbance, drawn
from missionc.simulate.engines import fly_with
from missionc.simulate.firmware_setpoints import setpoints
from missionc.simulate.judge_flight import Error, Flight, judge
from missionc.simulate.trial_bounds import QUADROTOR
from missionc.verify.certificate import Check

MOST_BYTES = 1 << 28
"""Bytes for the paths of flights that are in the air together."""
NUMBERS = 40
"""Numbers for one agent at one sample: what it is told, the wind, where it is and was, some of it twice."""
TRACKING = 0.05
"""Metres an agent may be off where its vehicle says nothing: what a Crazyflie's profile says."""


@dataclass(frozen=True, slots=True)
class Trial:
    """How to fly.

    Args:
        engine: one of ``trial_bounds.ENGINES``; those but the first fly once and undisturbed.
        flights: how many.
        seed: of everything that is drawn.
        kept: paths of so many flights, the first ones, are given back.
    """

    engine: str = QUADROTOR
    flights: int = 1
    disturbance: Disturbance = UNDISTURBED
    seed: int = 0
    kept: int = 1


@dataclass(frozen=True, slots=True, eq=False)
class Trials:
    """What the flights came to.

    Args:
        allowed: (agents,), m: how far each may be off.
        planned: (agents, samples, 3), m: where everybody should be.
        flown: the paths of the first flights.
        flights: every flight's verdict.
    """

    trial: Trial
    allowed: Array
    planned: Array
    flown: Flown
    flights: tuple[Flight, ...]

    @property
    def passed(self) -> bool:
        """Every requirement holds, nobody touches anything or is too far off, in every flight."""
        return all(flight.satisfied and flight.untouched and self.tracked(flight) for flight in self.flights)

    def tracked(self, flight: Flight) -> bool:
        return all(error.most <= most for error, most in zip(flight.error, self.allowed, strict=True))

    def error(self, agent: int) -> Error:
        """The tracking error over all flights: the average mean, the worst of what is usual, the most and when."""
        each = [flight.error[agent] for flight in self.flights]
        worst = max(each, key=lambda error: error.most)
        mean = sum(error.mean for error in each) / len(each)
        return Error(mean, max(error.usual for error in each), worst.most, worst.at)

    def room(self) -> tuple[Check, ...]:
        """The least room of all flights, between two bodies and to each obstacle."""
        return tuple(
            min(same, key=lambda check: check.margin)
            for same in zip(*(flight.room for flight in self.flights), strict=True)
        )

    def fractions(self) -> dict[str, Fraction]:
        """The fraction of flights that kept each requirement, then everybody's tracking, then room for the bodies."""
        names = [each.name for each in self.flights[0].requirements]
        held = {
            name: [flight.requirements[index].satisfied for flight in self.flights] for index, name in enumerate(names)
        }
        held["tracking"] = [self.tracked(flight) for flight in self.flights]
        held["nothing touched"] = [flight.untouched for flight in self.flights]
        return {name: fraction(sum(each), len(each)) for name, each in held.items()}


def nobody(done: int) -> None:
    """The listener of those who do not watch."""


def run(
    mission: Mission,
    kernel: Kernel,
    pieces: Sequence[Pieces],
    trial: Trial,
    listen: Callable[[int], None] = nobody,
) -> Trials:
    """Fly and judge; ``listen`` hears how many flights are over."""
    times = sample_times(mission.horizon)
    planned = np.stack([np.moveaxis(setpoints(own, times)[firmware_setpoints.POSITION], 0, -1) for own in pieces])
    allowed = np.array([agent.vehicle.tracking or TRACKING for agent in mission.agents])
    together = max(1, MOST_BYTES // (planned[..., 0].size * NUMBERS * 8))
    flights: list[Flight] = []
    paths: list[Flown] = []
    for first in range(0, trial.flights, together):
        numbers = range(first, min(first + together, trial.flights))
        flown = _flown(pieces, trial, numbers, times, float(mission.horizon))
        paths += [_first(flown, trial.kept - first)] if first < trial.kept else []
        for index in range(len(numbers)):
            path = flown.position[index], flown.velocity[index], flown.heading[index]
            flights.append(judge(mission, kernel, times, planned, *path))
            listen(len(flights))
    return Trials(trial, allowed, planned, _joined(paths), tuple(flights))


def _flown(pieces: Sequence[Pieces], trial: Trial, numbers: range, times: Array, seconds: float) -> Flown:
    if trial.engine != QUADROTOR:
        return fly_with(trial.engine, pieces, seconds)
    return fly(pieces, drawn(trial.disturbance, trial.seed, numbers, len(pieces), times.size), seconds)


def _first(flown: Flown, count: int) -> Flown:
    return Flown(flown.times, flown.position[:count], flown.velocity[:count], flown.heading[:count])


def _joined(parts: list[Flown]) -> Flown:
    columns = zip(*((part.position, part.velocity, part.heading) for part in parts), strict=True)
    return Flown(parts[0].times, *(np.concatenate(column) for column in columns))
