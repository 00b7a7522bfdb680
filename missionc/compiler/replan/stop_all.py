"""Stops of a team: on along the plan as far as needed, then to rest, until the next plan begins.

    in   the mission as it is now, the polynomials of all agents, the time, and the positions of agents off their plan
    out  Stopped: the polynomials of all agents up to the step at which the next plan may begin; or the stops of some
         of them

Polynomials are cut at times that all agents share, and joined: the part that is flown on, then a stop in place of the
rest. They hold float32 numbers if they are sent.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from missionc.base.trace import Array
from missionc.flight.trajectories.stop_and_hover import state_at, stop_and_hover, stop_together
from missionc.geometry.curves.piecewise_polynomials import Pieces, curves_of, refined, shifted, values
from missionc.ir import Mission, Vehicle
from missionc.planning.progression.rest_of_mission import counted_from
from missionc.verification.certificate import Check
from missionc.verification.flight.verify_stops import body_checks, vehicle_checks

SLIVER = 1e-4
"""Seconds: joints nearer than this are one."""


def between(flight: Pieces, first: float, last: float = math.inf) -> Pieces:
    """The flight from one moment to another, seconds, or to its end."""
    whole = refined(curves_of([flight], slice(None)), np.array([first, last]))
    middle = (whole.times[:-1] + whole.times[1:]) / 2
    chosen = (middle > first) & (middle < last)
    return Pieces(whole.durations[chosen], whole.coefficients[0, chosen])


def in_two(flight: Pieces) -> Pieces:
    """The flight in at least two pieces, as files have them."""
    if flight.duration.size > 1:
        return flight
    half = float(flight.duration[0]) / 2
    return joined([between(flight, 0.0, half), between(flight, half)])


def joined(flights: Sequence[Pieces]) -> Pieces:
    """One flight after the other."""
    return Pieces(
        np.concatenate([own.duration for own in flights]), np.concatenate([own.coefficients for own in flights])
    )


def with_stop(own: Pieces, stop: Pieces, moment: float, wait: float, lasting: float) -> Pieces:
    """What is flown until the stop begins, the stop, and the hover, of so many seconds in all."""
    hover = lasting - wait - float(stop.duration[0])
    parts = [between(own, moment, moment + wait), Pieces(stop.duration[:1], stop.coefficients[:1])]
    if hover > 1e-6:
        parts.append(Pieces(np.array([hover]), stop.coefficients[1:]))
    whole = joined(parts)
    return Pieces(_float32(whole.duration), _float32(whole.coefficients))


def aligned(flights: list[Pieces]) -> list[Pieces]:
    """The same motions with the joints of all, so that their pieces last as long."""
    if len({own.duration.tobytes() for own in flights}) == 1:
        return [Pieces(_float32(own.duration), _float32(own.coefficients)) for own in flights]
    joints = np.unique(np.concatenate([own.times for own in flights]))
    joints = joints[np.concatenate([[True], np.diff(joints) > SLIVER])]
    joints[-1] = min(own.times[-1] for own in flights)
    durations = _float32(np.diff(joints))
    return [Pieces(durations, _float32(_with_joints(own, joints))) for own in flights]


def _with_joints(own: Pieces, joints: Array) -> Array:
    """(pieces, 4, 8): the coefficients of a flight between joints that have its own among them."""
    piece = (joints[:-1, None] > own.times[1:-1] - SLIVER).sum(axis=1)
    return np.asarray(shifted(own.coefficients[None, piece], joints[:-1] - own.times[piece])[0])


def _float32(numbers: Array) -> Array:
    return numbers.astype(np.float32).astype(np.float64)


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
        moving: the places among them of those who fly on, and are in motion then.
    """

    pieces: list[Pieces]
    until: float
    step: int
    moving: frozenset[int] = frozenset()

    def state(self, row: int, time: float) -> Array:
        """(5, 4): the state of an agent after so many seconds; after the end, the state there."""
        return state_at(self.pieces[row], time)

    def states(self, moment: float, steps: Array, dimension: int) -> tuple[Array, Array, Array]:
        """Positions and velocities, (agents, steps, dim), and headings, (agents, steps), at steps after the moment.

        Args:
            moment: seconds, when the stops begin.
            steps: seconds, after ``moment``.
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
    """The first stop of all with which nobody touches anything; the checks that fail of the last, where there is none.

    Args:
        mission_at: the agents that are left, and the world with its times counted from the moment on.
        flights: what each flies, in their order.
        moment: seconds after the flights began.
        off: by agent, the state (5, 4) of who is not where its flight has it: it stops at once.
        least: seconds that the next plan needs to be ready.
        steps: that the flights last.
        stopping: who is to stop, if not all are: the others fly on.
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
    """The stops of as few as can be with which nobody touches anything for some time, while all others fly on.

    Where there are none, those with which somebody touches something last; nothing, where that is to fly on.

    Args:
        off: those who are not where their flights have them: if they are to stop, then at once.
        late: of those among them who are on their way, what they fly from the moment on; the others have to stop.
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
    """Seconds after the beginning of flights of so many seconds, when bodies touch; checks count from the end."""
    return min((lasting + check.at for check in failing if check.at is not None), default=lasting)


def _stop_at(
    flight: Pieces, moment: float, wait: float, lasting: float, off: Array | None, vehicle: Vehicle
) -> Pieces | None:
    """Flown on for some seconds, stopped, and hovered until ``lasting``; None where that is too short for it."""
    stop = stop_and_hover(off if off is not None else state_at(flight, moment + wait), vehicle)
    if stop is None or wait + float(stop.duration[0]) > lasting:
        return None
    return with_stop(flight, stop, moment, wait, lasting)


def bodies(mission: Mission, pieces: list[Pieces]) -> list[Check]:
    """The checks of bodies in flights that last as long, with the mission's times counted from their beginning."""
    pieces = aligned(pieces)
    later = float(pieces[0].duration.sum())
    return body_checks(counted_from(mission, later), pieces)


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
