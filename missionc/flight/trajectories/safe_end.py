"""Safe ends of a flight: at many times a stop of all agents, a hover, and a landing in turns.

    in   Mission, the complete flight
    out  Stops, each of which the verifier passes

A time without a short and clear stop within the limits has no safe end: the flight continues to the next stop time.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from missionc.flight.trajectories.stop_and_hover import ORDERS, quickest, stopping, with_hover
from missionc.geometry.curves.piecewise_polynomials import Pieces, curves_of, derivatives_at
from missionc.ir import Mission
from missionc.verification.flight.verify_safe_end import HOVER, failing_stops, last_to_stand, with_turns
from missionc.verification.flight.verify_whole_flight import Stop

EVERY, MOST = 0.5, 40
"""Interval between two stop times in seconds, and their maximum number: a long flight has larger intervals."""
ROUNDED = 1e-3
"""Resolution of stop times, seconds."""


def safe_ends(mission: Mission, whole: Mapping[str, Pieces], before: float, risen: float) -> tuple[Stop, ...]:
    """Stops from which all agents can land safely, in the order of their times; the last is at the flight's end.

    Arguments as for ``verify_safe_end``.
    """
    flown = [whole[agent.name] for agent in mission.agents]
    last = float(flown[0].times[-1])
    count = min(MOST, max(1, math.floor(last / EVERY)))
    times = [round(time / ROUNDED) * ROUNDED for time in np.linspace(0.0, last, count, endpoint=False).tolist()]
    stops = _stops(mission, flown, [*times, last], before)
    if not stops:
        return ()
    failing = failing_stops(mission, whole, before, stops)
    landed = with_turns(mission, whole, before, [stop for place, stop in enumerate(stops) if place not in failing])
    lasts = min(agent.vehicle.endurance for agent in mission.agents)
    return tuple(stop for stop in landed if last_to_stand(mission, stop, risen + before) <= lasts)


def _stops(mission: Mission, flown: list[Pieces], times: list[float], before: float) -> list[Stop]:
    """Stops at those of the given times from which all agents can stop within their limits; without landings."""
    vehicles = [agent.vehicle for agent in mission.agents]
    states = np.swapaxes(derivatives_at(curves_of(flown, slice(None)), np.array(times), ORDERS), 0, 1)
    # At the flight's end all agents hover.
    states[np.array(times) >= flown[0].times[-1], :, ORDERS - 1] = 0.0
    found = []
    for time, state, seconds in zip(times, states, quickest(states, vehicles).tolist(), strict=True):
        if math.isfinite(seconds):
            pieces = (with_hover(own, seconds, HOVER) for own in stopping(state, seconds))
            found.append(Stop(time - before, tuple(pieces), ()))
    return found
