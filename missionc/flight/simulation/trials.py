"""Monte Carlo trials: evaluation of every flight, confidence bounds of the success rate, and the headline.

    in   Mission, its kernel, each agent's Pieces, the flight conditions
    out  Trials

Only as many flights as fit into ``MOST_BYTES`` are simulated together. Without disturbances all flights are equal, and
one is simulated. The headline states only what the trials show for all such flights.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from missionc.base.late_dataclass import Record
from missionc.base.trace import Array, counted
from missionc.flight.simulation import disturbance
from missionc.flight.simulation.default_engine import Flown, fly, sample_times
from missionc.flight.simulation.disturbance import UNDISTURBED, Disturbance, drawn, setpoints
from missionc.flight.simulation.engines import fly_with
from missionc.flight.simulation.judge_flight import Error, Flight, judge
from missionc.flight.simulation.trial_bounds import QUADROTOR
from missionc.geometry.curves.piecewise_polynomials import Pieces
from missionc.ir import Mission
from missionc.ir.kernel.nodes import Kernel
from missionc.verification.certificate import Check

CONFIDENCE = 0.95


class Fraction(Record):
    """Success rate: ``held`` of ``flights``, with exact bounds of the true fraction at a confidence of 95 %.

    ``least`` is the one-sided lower bound. ``low`` and ``high`` are the two-sided interval.
    """

    held: int
    flights: int
    least: float
    low: float
    high: float

    @property
    def share(self) -> float:
        return self.held / self.flights


def fraction(held: int, flights: int) -> Fraction:
    """Success rate with exact (Clopper–Pearson) confidence bounds, which are valid for any number of flights.

    Raises:
        ValueError: there are no flights, or fewer than ``held``.

    Source:
        Clopper and Pearson, "The Use of Confidence or Fiducial Limits Illustrated in the Case of the Binomial" (1934).
    """
    if not 0 <= held <= flights or flights == 0:
        raise ValueError(f"{held} of {flights} flights")
    from scipy.special import betaincinv  # slow to load, and few commands count flights

    def above(doubt: float) -> float:
        return float(betaincinv(held, flights - held + 1, doubt)) if held else 0.0

    doubt = 1 - CONFIDENCE
    high = float(betaincinv(held + 1, flights - held, 1 - doubt / 2)) if held < flights else 1.0
    return Fraction(held, flights, above(doubt), above(doubt / 2), high)


MOST_BYTES = 1 << 29
"""Memory limit for the trajectories of flights that are simulated together, bytes."""
NUMBERS = 26
"""Count of stored values per agent and sample: wind, noise, position, some of it twice."""
TRACKING = 0.05
"""Tracking tolerance of agents without a vehicle, metres: that of a Crazyflie's profile."""


class Trial(Record):
    """Settings of Monte Carlo trials.

    Args:
        engine: one of ``trial_bounds.ENGINES``; all except the first simulate one undisturbed flight.
        flights: number of flights.
        seed: seed of all random draws.
        kept: number of first flights whose trajectories are returned.
        first: number of the first flight, which determines its random draws.
    """

    engine: str = QUADROTOR
    flights: int = 1
    disturbance: Disturbance = UNDISTURBED
    seed: int = 0
    kept: int = 1
    first: int = 0


class Trials(Record, eq=False):
    """Results of Monte Carlo trials.

    Args:
        allowed: (agents,), m: tracking tolerance.
        planned: (agents, samples, 3), m: planned positions.
        flown: trajectories of the first flights.
        flights: evaluation of every flight.
    """

    trial: Trial
    allowed: Array
    planned: Array
    flown: Flown
    flights: tuple[Flight, ...]

    @property
    def passed(self) -> bool:
        """True if every flight satisfies all requirements, without contact, within the tracking tolerance."""
        return all(map(self.as_required, self.flights))

    @property
    def kept(self) -> Fraction:
        """Fraction of flights that satisfy all requirements, without contact, within the tracking tolerance."""
        return fraction(sum(map(self.as_required, self.flights)), len(self.flights))

    def as_required(self, flight: Flight) -> bool:
        """Return whether a flight satisfies every requirement, without contact, within the tracking tolerance."""
        return flight.satisfied and flight.untouched and self.tracked(flight)

    def tracked(self, flight: Flight) -> bool:
        return all(error.most <= most for error, most in zip(flight.error, self.allowed, strict=True))

    def error(self, agent: int) -> Error:
        """Tracking error of an agent over all flights: mean, largest ``USUAL`` quantile, and maximum with its time."""
        each = [flight.error[agent] for flight in self.flights]
        worst = max(each, key=lambda error: error.most)
        mean = sum(error.mean for error in each) / len(each)
        return Error(mean, max(error.usual for error in each), worst.most, worst.at)

    def room(self) -> tuple[Check, ...]:
        """Checks of the minimum clearance over all flights, between two bodies and to each obstacle."""
        return tuple(
            min(same, key=lambda check: check.margin)
            for same in zip(*(flight.room for flight in self.flights), strict=True)
        )

    def fractions(self) -> dict[str, Fraction]:
        """Fraction of flights that satisfied each requirement, then the tracking tolerance, then clearance of bodies,
        by name.
        """
        names = [each.name for each in self.flights[0].requirements]
        held = {
            name: [flight.requirements[index].satisfied for flight in self.flights] for index, name in enumerate(names)
        }
        held["tracking"] = [self.tracked(flight) for flight in self.flights]
        held["nothing touched"] = [flight.untouched for flight in self.flights]
        return {name: fraction(sum(each), len(each)) for name, each in held.items()}


def nobody(done: int) -> None:
    """Do nothing; the default callback for progress."""


def cannot_lose(mission: Mission, disturbance: Disturbance) -> str:
    """Reason why the disturbance cannot stop an agent's motors; empty if it can stop all that it names."""
    names = [agent.name for agent in mission.agents]
    for name, when in disturbance.lose:
        if name not in names:
            return f"`{mission.name}` has no agent `{name}`"
        if when > mission.horizon:
            return f"`{name}` cannot be lost at {when:g} s: the flight ends at {float(mission.horizon):g} s"
    return ""


def lost_agents(mission: Mission, disturbance: Disturbance) -> dict[int, float]:
    """Stop time of each lost agent's motors, by agent index, seconds.

    Raises:
        ValueError: a lost agent is not in the mission.
    """
    names = [agent.name for agent in mission.agents]
    return {names.index(name): when for name, when in disturbance.lose}


def run(
    mission: Mission,
    kernel: Kernel,
    pieces: Sequence[Pieces],
    trial: Trial,
    listen: Callable[[int], None] = nobody,
) -> Trials:
    """Simulate and evaluate flights.

    Args:
        listen: called with the number of finished flights.

    Raises:
        ValueError: a lost agent is not in the mission.
    """
    times, seconds = sample_times(mission.horizon), float(mission.horizon)
    lost = lost_agents(mission, trial.disturbance)
    different = trial.flights if trial.disturbance.random else 1
    planned = np.stack([np.moveaxis(setpoints(own, times)[disturbance.POSITION], 0, -1) for own in pieces])
    allowed = np.array([agent.vehicle.tracking or TRACKING for agent in mission.agents])
    together = max(1, MOST_BYTES // (planned[..., 0].size * NUMBERS * 8))
    flights: list[Flight] = []
    paths: list[Flown] = []
    for first in range(0, different, together):
        numbers = range(trial.first + first, trial.first + min(first + together, different))
        flown = _flown(pieces, trial, numbers, times, seconds, lost)
        paths += [_first(flown, trial.kept - first)] if first < trial.kept else []
        for index in range(len(numbers)):
            path = flown.position[index], flown.velocity[index], flown.heading[index]
            flights.append(judge(mission, kernel, times, planned, *path, lost))
            listen(len(flights))
    return Trials(trial, allowed, planned, _joined(paths), tuple(flights * (trial.flights // different)))


def _flown(
    pieces: Sequence[Pieces], trial: Trial, numbers: range, times: Array, seconds: float, lost: Mapping[int, float]
) -> Flown:
    if trial.engine != QUADROTOR:
        return fly_with(trial.engine, pieces, seconds)
    found = drawn(trial.disturbance, trial.seed, numbers, len(pieces), times.size)
    return fly(pieces, found, seconds, disturbance=trial.disturbance, lost=lost)


def _first(flown: Flown, count: int) -> Flown:
    return Flown(flown.times, flown.position[:count], flown.velocity[:count], flown.heading[:count])


def _joined(parts: list[Flown]) -> Flown:
    columns = zip(*((part.position, part.velocity, part.heading) for part in parts), strict=True)
    return Flown(parts[0].times, *(np.concatenate(column) for column in columns))


def headline(trials: Trials) -> str:
    """Text for the success rate: its lower confidence bound, or for equal flights the result of one."""
    kept = trials.kept
    if kept.flights == 1 or not trials.trial.disturbance.random:
        verdict = "passed" if kept.held else "failed"
        alike = "" if kept.flights == 1 else " (identical flights: no random disturbance)"
        return f"{counted(kept.flights, 'simulated flight')} {verdict}{alike}"
    return (
        f"{kept.held} of {kept.flights} simulated flights passed; "
        f"success rate at least {shown(kept.least)} (one-sided 95 % lower confidence bound)"
    )


def shown(share: float) -> str:
    """Text of a lower bound in percent, rounded down to a tenth."""
    return f"{int(share * 1000) / 10:.1f} %"
