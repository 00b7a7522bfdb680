"""Safe ends of a flight: at many moments a stop of everybody, a hover, and a landing in turns.

    in   Mission, the whole of its flight
    out  Stops, each of which the verifier passes, and one at the end

A moment at which no stop is short, clear and within the limits has none: the flight goes on to the next that has.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from itertools import combinations

import numpy as np

from missionc.base.trace import Array
from missionc.curves.crazyflie_csv import Pieces
from missionc.flight.stop_and_hover import state_at, stop_together
from missionc.ir import Mission
from missionc.verify.flight.landing_in_turns import Stop, in_turns
from missionc.verify.flight.verify_safe_end import HOVER, judge_stops, missing_by_skew

EVERY, MOST = 0.5, 40
"""Seconds from a moment to the next, and how many there are at most: of a long flight they are further apart."""
SAMPLES = 9
"""Where a stop is looked at before it is judged."""
ROUNDED = 1e-3
"""Seconds: to which moments are written."""


def safe_ends(mission: Mission, whole: Mapping[str, Pieces], before: float) -> tuple[Stop, ...]:
    """The stops in the order of their moments; arguments as of ``verify_safe_end``."""
    flown = [whole[agent.name] for agent in mission.agents]
    last = float(flown[0].times[-1])
    wide = missing_by_skew(mission, flown)
    count = min(MOST, max(1, math.floor(last / EVERY)))
    times = [round(time / ROUNDED) * ROUNDED for time in np.linspace(0.0, last, count, endpoint=False).tolist()]
    stops = [stop for time in times if (stop := _stop(wide, flown, time, before)) is not None]
    end = _stop(wide, flown, last, before)
    assert end is not None, "who is at rest may stay there"
    return (*_good(mission, whole, before, stops), end)


def _stop(mission: Mission, flown: list[Pieces], time: float, before: float) -> Stop | None:
    """The stop at a time of the flight, if there is one that seems clear."""
    vehicles = [agent.vehicle for agent in mission.agents]
    pieces = stop_together([state_at(own, time) for own in flown], vehicles, HOVER)
    if pieces is None:
        return None
    stop = Stop(time - before, tuple(pieces), ())
    return replace(stop, turns=in_turns(mission, stop)) if _apart(mission, stop) else None


def _apart(mission: Mission, stop: Stop) -> bool:
    """Whether nobody seems to come too near to another; what stands there is left to the verifier."""
    share = np.linspace(0.0, stop.seconds, SAMPLES)
    powers = share[:, None] ** np.arange(8)
    places: Array = np.stack([powers @ own.coefficients[0, :3].T for own in stop.pieces])
    for one, other in combinations(range(len(mission.agents)), 2):
        first, second = mission.agents[one], mission.agents[other]
        bodies = max(first.radius + second.radius, first.vehicle.pair_distance, second.vehicle.pair_distance)
        need = bodies + first.vehicle.tracking + second.vehicle.tracking
        if np.linalg.norm(places[one] - places[other], axis=-1).min() < need:
            return False
    return True


def _good(mission: Mission, whole: Mapping[str, Pieces], before: float, stops: list[Stop]) -> list[Stop]:
    """Those that the verifier passes: all at once where it can, else by halves."""
    if not stops or judge_stops(mission, whole, before, stops).passed:
        return stops
    if len(stops) == 1:
        return []
    middle = len(stops) // 2
    return [*_good(mission, whole, before, stops[:middle]), *_good(mission, whole, before, stops[middle:])]
