"""The planned motion and the polynomials that are flown, sampled on even grids fine enough for the eye."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from missionc.ir import DoubleIntegrator, Mission
from missionc.plan import Array, Trace
from missionc.verify.columns import Pieces, curves_of, read
from missionc.verify.curves import Curves, motion

MOST_NUMBERS = 60_000
"""Of the positions of one motion: a finer grid than this allows is not taken."""
RATES = (8, 5, 4, 2, 1)


@dataclass(frozen=True, slots=True, eq=False)
class Sampled:
    """``rate`` times to a step, the first at 0 and the last at the mission's end.

    Args:
        times: (samples,), seconds.
        position, velocity, acceleration: (agents, samples, dim), metres and seconds.
    """

    rate: int
    times: Array
    position: Array
    velocity: Array
    acceleration: Array


@dataclass(frozen=True, slots=True, eq=False)
class Flights:
    """``flown`` is absent where there are no polynomials that can be read."""

    planned: Sampled
    flown: Sampled | None

    def by_name(self) -> Iterator[tuple[str, Sampled]]:
        yield "planned", self.planned
        if self.flown is not None:
            yield "flown", self.flown


def flights(mission: Mission, trace: Trace, files: Mapping[str, str]) -> Flights:
    """Both motions; ``files`` are the texts of the polynomials, by agent."""
    numbers = trace.position.size
    rate = next((rate for rate in RATES if rate * numbers <= MOST_NUMBERS), 1)
    bends = any(isinstance(agent.dynamics, DoubleIntegrator) for agent in mission.agents)
    planned = _sampled(motion(mission, trace), mission, rate if bends else 1)
    pieces = [read(files.get(agent.name, "")) for agent in mission.agents]
    whole = [own for own in pieces if isinstance(own, Pieces)]
    if len(whole) < len(pieces) or any(not np.array_equal(own.duration, whole[0].duration) for own in whole):
        return Flights(planned, None)
    return Flights(planned, _sampled(curves_of(whole, slice(mission.dimension)), mission, rate))


def _sampled(curves: Curves, mission: Mission, rate: int) -> Sampled:
    times = np.asarray(np.arange(rate * mission.steps + 1) * (mission.step / rate), dtype=np.float64)
    velocity = curves.derivative()
    return Sampled(rate, times, curves.at(times), velocity.at(times), velocity.derivative().at(times))
