"""Trajectories for the report on regular time grids: the plan, the polynomials, and the simulated flight."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from missionc.base.late_dataclass import Record
from missionc.base.trace import Trace
from missionc.geometry.curves.piecewise_polynomials import Curves, Pieces, curves_of, motion, read
from missionc.ir import Mission
from missionc.output.report.loop_tracks import LoopFlights, loop_tracks
from missionc.output.report.sample_tracks import Placed, Sampled
from missionc.output.report.simulated_tracks import Simulated, simulated

MOST_NUMBERS = 60_000
"""Maximum number of position values of one motion, which limits the resolution of the grid."""
RATES = (8, 5, 4, 2, 1)


class Flights(Record, eq=False):
    """Motions that the report shows.

    ``flown`` is None without readable polynomials, ``simulated`` without a simulation.

    For a flight in a closed loop, ``told`` has the positions commanded by the uploads, and ``worlds`` the missions of
    the flight, each with its start time, s.
    """

    planned: Sampled
    flown: Sampled | None
    simulated: Simulated | None = None
    told: Placed | None = None
    worlds: tuple[tuple[float, Mission], ...] = ()

    def by_name(self) -> Iterator[tuple[str, Sampled]]:
        """Yield the names and motions with known speeds; with a flight in a closed loop, only the plan."""
        yield "planned", self.planned
        if self.flown is not None and self.told is None:
            yield "flown", self.flown

    def places(self) -> Iterator[tuple[str, Placed]]:
        """Yield the names and positions of all motions."""
        yield from self.by_name()
        if self.told is not None:
            yield "told", self.told
        if self.simulated is not None:
            yield "simulated", self.simulated.placed


def flights(
    mission: Mission, trace: Trace, files: Mapping[str, str], simulation: str = "", loop: LoopFlights | None = None
) -> Flights:
    """All available motions of a mission for the report.

    Args:
        files: texts of the polynomials, by agent.
        simulation: text of ``simulation.json``, or empty.
        loop: flights in a closed loop, shown instead of simulated ones.
    """
    numbers = trace.position.size
    rate = next((rate for rate in RATES if rate * numbers <= MOST_NUMBERS), 1)
    bends = any(agent.dynamics.has_momentum for agent in mission.agents)
    planned = _sampled(motion(mission, trace), mission, rate if bends else 1)
    pieces = [read(files.get(agent.name, "")) for agent in mission.agents]
    whole = [own for own in pieces if isinstance(own, Pieces)]
    if len(whole) < len(pieces) or any(not np.array_equal(own.duration, whole[0].duration) for own in whole):
        return Flights(planned, None)
    flown = _sampled(curves_of(whole, slice(mission.dimension)), mission, rate)
    if loop is not None:
        shown, told = loop_tracks(mission, loop, rate)
        return Flights(planned, flown, shown, told, loop.worlds)
    return Flights(planned, flown, simulated(mission, simulation, curves_of(whole, slice(3)), rate))


def _sampled(curves: Curves, mission: Mission, rate: int) -> Sampled:
    times = np.asarray(np.arange(rate * mission.steps + 1) * (mission.step / rate), dtype=np.float64)
    velocity = curves.derivative()
    return Sampled(rate, times, curves.at(times), velocity.at(times), velocity.derivative().at(times))
