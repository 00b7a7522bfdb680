"""Stops of a whole team: on along the plan as long as need be, to rest, and there until the next plan begins.

in   the mission as it is now, everybody's polynomials, the moment, and where those are who are off their plan
out  Stopped: everybody's polynomials from that moment to the step at which the next plan may begin
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from missionc.base.trace import Array
from missionc.curves.crazyflie_csv import Pieces
from missionc.curves.piecewise_polynomials import Curves, refined, values
from missionc.flight.stop_and_hover import state_at, stop_together
from missionc.ir import Mission
from missionc.progression.rest_of_mission import counted_from
from missionc.verify.certificate import Check
from missionc.verify.flight.verify_stops import checks

SHARES = (1.0, 0.75, 0.5, 0.25, 0.0)
"""In turn, shares of the time in which everybody may fly on before stopping: as long as can be, else sooner."""
SPARE = 1.25
"""Times what a stop takes now that it may take later."""


@dataclass(frozen=True, slots=True, eq=False)
class Stopped:
    """The stops.

    Args:
        pieces: of each agent that is left, from the moment to ``until``; all last as long.
        until: seconds after the beginning of the plan that was flown: a whole number of steps.
        step: that number.
    """

    pieces: list[Pieces]
    until: float
    step: int

    def states(self, moment: float, steps: Array, dimension: int) -> tuple[Array, Array, Array]:
        """Positions and velocities, (agents, steps, dim), and headings, (agents, steps), at steps after the moment.

        Args:
            moment: seconds, when the stops begin.
            steps: seconds, after ``moment``.
        """
        curves = Curves(self.pieces[0].times, np.stack([own.coefficients for own in self.pieces]))
        place, slope = curves.at(steps - moment), curves.derivative().at(steps - moment)
        return place[..., :dimension], slope[..., :dimension], place[..., 3]


def stop_all(
    mission_at: Mission, flights: list[Pieces], moment: float, off: Mapping[int, Array], least: float, steps: int
) -> Stopped | tuple[Check, ...]:
    """The first stop of all with which nobody touches anything; the checks that fail of the last, where there is none.

    Args:
        mission_at: the agents that are left, and the world with its times counted from the moment on.
        flights: what each flies, in their order.
        moment: seconds after the flights began.
        off: by agent, the state (5, 4) of who is not where its flight has it.
        least: seconds that the next plan needs to be ready.
        steps: that the flights last.
    """
    failed: tuple[Check, ...] = ()
    vehicles = [agent.vehicle for agent in mission_at.agents]
    now = stop_together([off.get(index, state_at(own, moment)) for index, own in enumerate(flights)], vehicles)
    longest = max(0.0, least - SPARE * float(now[0].duration[0])) if now else least
    for wait in (share * longest for share in SHARES):
        states = [off.get(index, state_at(own, moment + wait)) for index, own in enumerate(flights)]
        stops = stop_together(states, vehicles)
        if stops is None:
            continue
        over = moment + wait + float(stops[0].duration[0])
        step = math.ceil(max(over, moment + least) / mission_at.step - 1e-9)
        until = step * mission_at.step
        if step >= steps:
            return failed
        pieces = [
            _whole(own, stop, moment, wait, until - over, index in off)
            for index, (own, stop) in enumerate(zip(flights, stops, strict=True))
        ]
        found = Stopped(pieces, until, step)
        failed = tuple(check for check in _bodies(mission_at, pieces) if not check.passed)
        if not failed:
            return found
    return failed


def _bodies(mission: Mission, pieces: list[Pieces]) -> list[Check]:
    """The checks of bodies, with times counted from the beginning of the stops."""
    later = float(pieces[0].duration.sum())
    return [check for check in checks(counted_from(mission, later), pieces) if check.name != "stop"]


def flown_on(mission_at: Mission, flights: list[Pieces], moment: float) -> list[Check]:
    """The checks of bodies where everybody flies on to the end; arguments as of ``stop_all``."""
    end = float(flights[0].duration.sum())
    if moment >= end - 1e-6:
        return []
    return _bodies(mission_at, [from_moment(own, moment) for own in flights])


def from_moment(flight: Pieces, moment: float) -> Pieces:
    """The flight from a moment on, seconds."""
    whole = refined(Curves(flight.times, flight.coefficients[None]), np.array([moment]))
    chosen = whole.times[:-1] > moment - 1e-6
    return Pieces(whole.durations[chosen], whole.coefficients[0, chosen])


def _whole(own: Pieces, stop: Pieces, moment: float, wait: float, hover: float, is_off: bool) -> Pieces:
    """What is flown until the stop begins, the stop, and the hover: that of one that is off stays where it is first."""
    durations, coefficients = [], []
    if wait > 0:
        part = refined(Curves(own.times, own.coefficients[None]), np.array([moment, moment + wait]))
        chosen = (part.times[:-1] > moment - 1e-9) & (part.times[1:] < moment + wait + 1e-9)
        durations.append(part.durations[chosen])
        flown = part.coefficients[0, chosen]
        coefficients.append(_still(flown, stop.coefficients[0, :, 0]) if is_off else flown)
    durations.append(stop.duration[:1])
    coefficients.append(stop.coefficients[:1])
    if hover > 1e-6:
        durations.append(np.array([hover]))
        coefficients.append(stop.coefficients[1:])
    return Pieces(_float32(np.concatenate(durations)), _float32(np.concatenate(coefficients)))


def _still(flown: Array, place: Array) -> Array:
    """As many pieces that stay at a place."""
    still = np.zeros_like(flown)
    still[:, :, 0] = place
    return still


def _float32(numbers: Array) -> Array:
    return numbers.astype(np.float32).astype(np.float64)


def resting_state(position: Array, yaw: float, altitude: float) -> Array:
    """(5, 4): the state of one that is told to stay at a place, (dim,), metres."""
    state = np.zeros((5, 4))
    state[0, : position.size], state[0, 3] = position, yaw
    if position.size == 2:
        state[0, 2] = altitude
    return state


def ends(pieces: list[Pieces], dimension: int) -> Array:
    """(agents, dim): where the stops end."""
    return np.stack([values(own.coefficients[-1], np.asarray(own.duration[-1]))[:dimension] for own in pieces])
