"""Monte Carlo trials: flights judged one by one, confidence bounds of their success rate, and the headline.

    in   Mission, its kernel, each agent's Pieces, the flight conditions
    out  Trials

Only as many flights as fit into ``MOST_BYTES`` are in the air together. Without disturbances all flights are the
same, and one is flown. The headline states no more than the trials show of all flights like them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from missionc.base.figures import counted
from missionc.base.late_dataclass import dataclass
from missionc.base.trace import Array
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


@dataclass(frozen=True, slots=True)
class Fraction:
    """``held`` of ``flights``, and exact bounds of the true share with a confidence of 95 %.

    ``least`` is the one-sided lower bound, for "at least". ``low`` and ``high`` are the two-sided interval.
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
    """Exact (Clopper–Pearson) bounds: each covers the true share with at least its confidence, however few the flights.

    Raises:
        ValueError: there are no flights, or not so many.

    Source:
        Clopper and Pearson, "The Use of Confidence or Fiducial Limits Illustrated in the Case of the Binomial" (1934).
    """
    if not 0 <= held <= flights or flights == 0:
        raise ValueError(f"{held} of {flights} flights")
    from scipy.special import betaincinv  # takes a while to load, and few commands count flights

    def above(doubt: float) -> float:
        return float(betaincinv(held, flights - held + 1, doubt)) if held else 0.0

    doubt = 1 - CONFIDENCE
    high = float(betaincinv(held + 1, flights - held, 1 - doubt / 2)) if held < flights else 1.0
    return Fraction(held, flights, above(doubt), above(doubt / 2), high)


MOST_BYTES = 1 << 29
"""Bytes for the paths of flights that are in the air together."""
NUMBERS = 26
"""Numbers for one agent at one sample: the wind, the noise, where it is, some of it twice."""
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
        first: the number of the first flight, by which everything is drawn that is drawn.
    """

    engine: str = QUADROTOR
    flights: int = 1
    disturbance: Disturbance = UNDISTURBED
    seed: int = 0
    kept: int = 1
    first: int = 0


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
        """Every flight is as required."""
        return all(map(self.as_required, self.flights))

    @property
    def kept(self) -> Fraction:
        """The fraction of flights that are as required."""
        return fraction(sum(map(self.as_required, self.flights)), len(self.flights))

    def as_required(self, flight: Flight) -> bool:
        """Every requirement holds, nobody touches anything or is too far off."""
        return flight.satisfied and flight.untouched and self.tracked(flight)

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


def cannot_lose(mission: Mission, disturbance: Disturbance) -> str:
    """Why nobody of a name is lost then, in words; empty where all can be."""
    names = [agent.name for agent in mission.agents]
    for name, when in disturbance.lose:
        if name not in names:
            return f"`{mission.name}` has no agent `{name}`"
        if when > mission.horizon:
            return f"`{name}` cannot be lost at {when:g} s: the flight ends at {float(mission.horizon):g} s"
    return ""


def lost_agents(mission: Mission, disturbance: Disturbance) -> dict[int, float]:
    """Whose motors stop, by their index, and when, s.

    Raises:
        ValueError: somebody is to be lost who is no agent of the mission.
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
    """Fly and judge; ``listen`` hears how many flights are over.

    Raises:
        ValueError: somebody is to be lost who is no agent of the mission.
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
    """The lower bound of the share of flights that are as required; of flights that are all alike, how the one went."""
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
    """A lower bound in percent, rounded down to a tenth."""
    return f"{int(share * 1000) / 10:.1f} %"
