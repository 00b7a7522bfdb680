"""Flights in which some agents stop: their polynomials and states end in a hover.

in   Flying, the stops, their time
out  Flying
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from missionc.base.trace import Trace
from missionc.compiler.replan.replan import arrays
from missionc.compiler.replan.request import Flying
from missionc.compiler.replan.stop_all import between, joined
from missionc.geometry.curves.piecewise_polynomials import Pieces, curves_of, polynomials, values, written


def diverted(flying: Flying, stops: Mapping[str, str], moment: float) -> Flying:
    """The flight in which some agents follow a stop from a time on, and hover afterwards.

    Args:
        stops: text of polynomials, by agent name.
        moment: time of the stops, seconds.
    """
    mission = flying.checked.valid_mission
    position, velocity, heading = (each.copy() for each in arrays(flying.trace))
    flights = dict(flying.flights)
    times = float(mission.step) * np.arange(position.shape[1], dtype=np.float64)
    later = np.flatnonzero(times > moment)
    for agent in mission.agents:
        if agent.name not in stops:
            continue
        before = polynomials(flights[agent.name])
        stopped = joined([between(before, 0.0, moment), polynomials(stops[agent.name])])
        whole = _lasting(stopped, float(before.duration.sum()))
        flights[agent.name] = written(whole)
        states = curves_of([whole], slice(None)).at(times[later])[0]
        position[agent.index, later] = states[:, : mission.dimension]
        heading[agent.index, later] = states[:, 3]
        velocity[agent.index, :-1] = np.diff(position[agent.index], axis=0) / mission.step
    return replace(flying, trace=Trace(flying.trace.step, position, velocity, heading), flights=flights)


def _lasting(flight: Pieces, seconds: float) -> Pieces:
    """The trajectory extended by a hover, so that it lasts ``seconds``."""
    hover = seconds - float(flight.duration.sum())
    if hover <= 1e-6:
        return flight
    still = np.zeros_like(flight.coefficients[-1:])
    still[0, :, 0] = values(flight.coefficients[-1], np.asarray(flight.duration[-1]))
    return Pieces(np.append(flight.duration, hover), np.concatenate([flight.coefficients, still]))
