"""Stops of a team: along the plan as far as needed, then to rest, until the next plan begins.

    in   the mission as it is now, the polynomials of all agents, the time, and the positions of agents off their plan
    out  Stopped: polynomials of all agents up to the step at which the next plan may begin; or the stops of some
         of them

Polynomials are cut at common times, and concatenated: the continued part, then a stop instead of the rest. Sent
polynomials have float32 numbers.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence

import numpy as np

from missionc.base.late_dataclass import Record
from missionc.base.trace import Array
from missionc.flight.trajectories.stop_and_hover import state_at, stop_and_hover, stop_together
from missionc.geometry.curves.piecewise_polynomials import Pieces, curves_of, refined, shifted, values
from missionc.ir import Mission, Vehicle
from missionc.planning.progression.rest_of_mission import counted_from
from missionc.verification.certificate import Check
from missionc.verification.flight.verify_stops import body_checks, vehicle_checks

SLIVER = 1e-4
"""Time difference in seconds up to which two joints are merged."""


def between(flight: Pieces, first: float, last: float = math.inf) -> Pieces:
    """Part of a trajectory from one time to another, seconds, or to its end."""
    whole = refined(curves_of([flight], slice(None)), np.array([first, last]))
    middle = (whole.times[:-1] + whole.times[1:]) / 2
    chosen = (middle > first) & (middle < last)
    return Pieces(whole.durations[chosen], whole.coefficients[0, chosen])


def in_two(flight: Pieces) -> Pieces:
    """The trajectory with at least two pieces, as trajectory files require."""
    if flight.duration.size > 1:
        return flight
    half = float(flight.duration[0]) / 2
    return joined([between(flight, 0.0, half), between(flight, half)])


def joined(flights: Sequence[Pieces]) -> Pieces:
    """Concatenation of trajectories."""
    return Pieces(
        np.concatenate([own.duration for own in flights]), np.concatenate([own.coefficients for own in flights])
    )


def with_stop(own: Pieces, stop: Pieces, moment: float, wait: float, lasting: float) -> Pieces:
    """Trajectory that follows ``own`` for ``wait`` seconds after ``moment``, then stops and hovers, for ``lasting``
    seconds.
    """
    hover = lasting - wait - float(stop.duration[0])
    parts = [between(own, moment, moment + wait), Pieces(stop.duration[:1], stop.coefficients[:1])]
    if hover > 1e-6:
        parts.append(Pieces(np.array([hover]), stop.coefficients[1:]))
    whole = joined(parts)
    return Pieces(_float32(whole.duration), _float32(whole.coefficients))


def aligned(flights: list[Pieces]) -> list[Pieces]:
    """The same trajectories split at common joints, so that their pieces have equal durations."""
    if len({own.duration.tobytes() for own in flights}) == 1:
        return [Pieces(_float32(own.duration), _float32(own.coefficients)) for own in flights]
    joints = np.unique(np.concatenate([own.times for own in flights]))
    joints = joints[np.concatenate([[True], np.diff(joints) > SLIVER])]
    joints[-1] = min(own.times[-1] for own in flights)
    durations = _float32(np.diff(joints))
    return [Pieces(durations, _float32(_with_joints(own, joints))) for own in flights]


def _with_joints(own: Pieces, joints: Array) -> Array:
    """Coefficients of a trajectory split at the given times, seconds, which include its own joints: (pieces, 4, 8)."""
    piece = (joints[:-1, None] > own.times[1:-1] - SLIVER).sum(axis=1)
    return np.asarray(shifted(own.coefficients[None, piece], joints[:-1] - own.times[piece])[0])


def _float32(numbers: Array) -> Array:
    return numbers.astype(np.float32).astype(np.float64)


SHARES = (1.0, 0.75, 0.5, 0.25, 0.0)
"""Fractions of the available time that agents may continue before a stop, in order of preference."""
SPARE = 1.25
"""Allowance for a later, longer stop, as a factor of the duration of a stop now."""


class Stopped(Record, eq=False):
    """Stops of all remaining agents, up to the step at which the next plan begins.

    Args:
        pieces: polynomials of each remaining agent, from the stop time to ``until``; equal durations.
        until: end, seconds of the flown plan: a multiple of the time step.
        step: number of these steps.
        moving: indices among them of agents that continue in motion.
    """

    pieces: list[Pieces]
    until: float
    step: int
    moving: frozenset[int] = frozenset()

    def state(self, row: int, time: float) -> Array:
        """State of an agent after ``time`` seconds, (5, 4), metres, rad and seconds; constant after the end."""
        return state_at(self.pieces[row], time)

    def states(self, moment: float, steps: Array, dimension: int) -> tuple[Array, Array, Array]:
        """Positions and velocities, (agents, steps, dim), metres, m/s, and headings, (agents, steps), rad, at later
        times.

        Args:
            moment: beginning of the stops, seconds.
            steps: times after ``moment``, seconds.
        """
        curves = curves_of(self.pieces, slice(None))
        place, slope = curves.at(steps - moment), curves.derivative().at(steps - moment)
        return place[..., :dimension], slope[..., :dimension], place[..., 3]


def stop_all(
    mission_at: Mission,
    flights: list[Pieces],
    moment: float,
    off: Mapping[int, Array],
    least: float,
    steps: int,
    stopping: Collection[int] | None = None,
) -> Stopped | tuple[Check, ...]:
    """First stop of the agents without contact, or the failed checks of the last attempt.

    Args:
        mission_at: remaining agents, and the world with times from the stop time on.
        flights: polynomials of each, in order.
        moment: stop time, seconds of the flights.
        off: by agent, the state (5, 4) of deviating agents, which stop at once.
        least: seconds until the next plan is ready.
        steps: number of steps of the flights.
        stopping: agents to stop, if not all; the others continue.
    """
    failed: tuple[Check, ...] = ()
    who = list(range(len(flights))) if stopping is None else sorted(stopping)
    vehicles = [mission_at.agents[index].vehicle for index in who]

    def together(wait: float) -> list[Pieces] | None:
        return stop_together([off.get(index, state_at(flights[index], moment + wait)) for index in who], vehicles)

    now = together(0.0) if who else None
    longest = max(0.0, least - SPARE * float(now[0].duration[0])) if now else least
    for wait in (share * longest for share in (SHARES if who else SHARES[:1])):
        stops = together(wait) if who else []
        if stops is None:
            continue
        over = moment + wait + (float(stops[0].duration[0]) if stops else 0.0)
        step = math.ceil(max(over, moment + least) / mission_at.step - 1e-9)
        until = step * mission_at.step
        if step >= steps:
            return failed
        pieces = [in_two(between(own, moment, until)) for own in flights]
        for index, stop in zip(who, stops, strict=True):
            pieces[index] = with_stop(flights[index], stop, moment, 0.0 if index in off else wait, until - moment)
        found = Stopped(aligned(pieces), until, step, frozenset(range(len(flights))) - frozenset(who))
        judged = (*vehicle_checks(mission_at, found.pieces).checks, *bodies(mission_at, found.pieces))
        failed = tuple(check for check in judged if not check.passed)
        if not failed:
            return found
    return failed


def stop_some(
    mission_at: Mission,
    flights: list[Pieces],
    moment: float,
    off: Mapping[int, Array],
    late: Mapping[int, Pieces],
    ahead: float,
) -> dict[int, Pieces]:
    """Fewest stops that avoid contact for some time while all other agents continue, by agent index.

    If impossible, the stops with the latest contact; empty if continuing is best.

    Args:
        off: states of deviating agents, (5, 4), metres, which can only stop at once.
        late: polynomials of deviating agents on their path; the others have to stop.
        ahead: seconds after the moment; the other arguments are those of ``stop_all``.
    """
    end = float(flights[0].duration.sum())
    lasting = min(ahead, end - moment)
    if lasting <= 0:
        return {}
    rest = [late.get(index) or between(own, moment) for index, own in enumerate(flights)]
    on = [between(own, 0.0, lasting) for own in rest]
    must = [each for each in off if each not in late]
    failing = [check for check in bodies(mission_at, on) if not check.passed]
    index = {agent.name: agent.index for agent in mission_at.agents}
    involved = [index[name] for name in dict.fromkeys(name for check in failing for name in check.agents)]
    touch = _first_touch(failing, lasting)
    everybody = list(range(len(flights)))
    best, latest = dict[int, Pieces](), 0.0 if must else touch
    for some in (*([each] for each in involved), involved, everybody):
        who = sorted({*some, *must})
        for wait in (share * touch for share in SHARES):
            stops = {}
            for each in who:
                vehicle, where = mission_at.agents[each].vehicle, off.get(each)
                stops[each] = _stop_at(flights[each], moment, wait if where is None else 0.0, lasting, where, vehicle)
            found = {each: stop for each, stop in stops.items() if stop is not None}
            if len(found) < len(who):
                continue
            pieces = [found.get(each) or on[each] for each in everybody]
            failing = [check for check in bodies(mission_at, pieces) if not check.passed]
            if not failing:
                return found
            if _first_touch(failing, lasting) > latest:
                best, latest = found, _first_touch(failing, lasting)
    return best


def _first_touch(failing: list[Check], lasting: float) -> float:
    """Seconds until the first contact in trajectories of ``lasting`` seconds.

    The times of the checks count from the end.
    """
    return min((lasting + check.at for check in failing if check.at is not None), default=lasting)


def _stop_at(
    flight: Pieces, moment: float, wait: float, lasting: float, off: Array | None, vehicle: Vehicle
) -> Pieces | None:
    """Trajectory that continues for ``wait`` seconds, stops, and hovers until ``lasting``; None if that is too short.

    Args:
        off: state of an agent that deviates from its plan, (5, 4), metres; None for an agent on its plan.
    """
    stop = stop_and_hover(off if off is not None else state_at(flight, moment + wait), vehicle)
    if stop is None or wait + float(stop.duration[0]) > lasting:
        return None
    return with_stop(flight, stop, moment, wait, lasting)


def bodies(mission: Mission, pieces: list[Pieces]) -> list[Check]:
    """Checks that bodies do not touch on trajectories of equal durations, with mission times from their beginning."""
    pieces = aligned(pieces)
    later = float(pieces[0].duration.sum())
    return body_checks(counted_from(mission, later), pieces)


def resting_state(position: Array, yaw: float, altitude: float) -> Array:
    """State of an agent that hovers at a position, (dim,), metres, from position to snap: (5, 4)."""
    state = np.zeros((5, 4))
    state[0, : position.size], state[0, 3] = position, yaw
    if position.size == 2:
        state[0, 2] = altitude
    return state


def ends(pieces: list[Pieces], dimension: int) -> Array:
    """Final positions of the stops: (agents, dim), metres."""
    return np.stack([values(own.coefficients[-1], np.asarray(own.duration[-1]))[:dimension] for own in pieces])
