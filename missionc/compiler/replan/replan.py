"""Replanning in flight: the flight so far is the past, and the rest is planned in the present world.

    in   Flying, Request, Limits
    out  Replanned: the old plan if still valid, else a repaired or a new one; or the requirements that can no
         longer be satisfied
    says MC719 to MC724

The past and the new plan together satisfy the mission. The plan is found and verified for the rest of each requirement
after the past (``progression``).

To continue means to follow the old plan: the remaining agents continue their polynomials, and slow agents fall behind.
"""

from __future__ import annotations

import math
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from missionc.backends.choose_backend import choose_backend
from missionc.base.diagnostics.model import Diagnostic
from missionc.base.late_dataclass import Record
from missionc.base.limits import Limits
from missionc.base.trace import Array, Trace
from missionc.compiler.front_end import Checked
from missionc.compiler.provenance import texts
from missionc.compiler.remaining import earlier, remaining
from missionc.compiler.replan.cannot_replan import no_longer_kept, no_safe_stop, nobody_left
from missionc.compiler.replan.plan_rest import RestPlanner
from missionc.compiler.replan.request import Flying, Replanned, Request, Way
from missionc.compiler.replan.stop_all import Stopped, between, bodies, ends, resting_state, stop_all, stop_some
from missionc.flight.trajectories.stop_and_hover import flown_late, state_at, state_behind
from missionc.geometry.curves.piecewise_polynomials import Pieces, curves_of, polynomials, written
from missionc.ir import Mission
from missionc.planning.progression.past_document import Flown, Past
from missionc.planning.progression.rest_of_mission import slowed, team_at
from missionc.planning.progression.stretches import Stretch
from missionc.verification.certificate import Certificate, Check
from missionc.verification.flight.verify_whole_flight import verify_whole_flight
from missionc.verification.flight.way_missions import Stage, Ways, is_whole
from missionc.verification.monitoring.read_trace import ON_TIME, FlownSoFar
from missionc.verification.verify_plan import verify, verify_polynomials


class FlyOn(Record, eq=False):
    """Motion of the remaining agents if all of them continue the old plan.

    Args:
        pieces: polynomials of the remaining agents, from their last sample to the plan's end.
        late: indices among them of delayed agents.
        told: (agents, completed steps): states of all agents in the past.
        ahead: (remaining agents, remaining steps): states from the last of the completed steps on.
    """

    pieces: list[Pieces]
    late: tuple[int, ...]
    told: Trace
    ahead: Trace


def fly_on(
    mission: Mission,
    plan: Trace,
    flights: Sequence[Pieces],
    so_far: FlownSoFar,
    left: Sequence[int],
    late: Mapping[int, float],
) -> FlyOn:
    """Motion of the remaining agents if all of them continue the old plan.

    Args:
        mission: mission of the plan.
        flights: polynomials of each agent, including lost ones.
        left: indices of the remaining agents.
        late: by index, delayed agents with their top speeds, m/s.
    """
    until, end = so_far.until, float(flights[0].duration.sum())
    steps = so_far.trace.position.shape[1] - 1
    position, velocity, heading = (each[:, steps:].copy() for each in arrays(plan))
    pieces = []
    for agent in left:
        if agent not in late:
            pieces.append(between(flights[agent], until))
            continue
        own = flown_late(flights[agent], so_far.last[agent], until, late[agent], end - until)
        pieces.append(own)
        times = mission.step * np.arange(steps + 1, steps + position.shape[1]) - until
        position[agent, 0] = so_far.trace.position[agent, -1]
        position[agent, 1:] = curves_of([own], slice(mission.dimension)).at(times)[0]
        velocity[agent, :-1] = np.diff(position[agent], axis=0) / mission.step
        velocity[agent, -1] = 0.0
        ways = velocity[agent, :-1]
        moves = np.linalg.norm(ways, axis=-1) > 0
        heading[agent, :-1][moves] = np.arctan2(ways[moves, 1], ways[moves, 0])
        heading[agent, -1] = heading[agent, -2]
    told = [
        np.concatenate([old[:, :-1], new[:, :1]], axis=1)
        for old, new in zip(arrays(so_far.trace), (position, velocity, heading), strict=True)
    ]
    ahead = Trace(plan.step, position, velocity, heading).part(left, 0, position.shape[1] - 1)
    return FlyOn(
        pieces,
        tuple(number for number, agent in enumerate(left) if agent in late),
        Trace(plan.step, *told),
        ahead,
    )


def arrays(trace: Trace) -> tuple[Array, Array, Array]:
    """Positions, velocities and headings of a trace.

    Shape: (agents, steps + 1, dim) twice, metres, m/s, and (agents, steps + 1).
    """
    return trace.position, trace.velocity, trace.heading


OFF = 0.25
"""Deviation from the plan in metres above which an agent is commanded to stay at its position."""
BEHIND = 0.1
"""Deviation from the plan in metres above which an agent that is known to be slow counts as delayed on its path."""
BY_FEW = 0.4
"""Fraction of the time for a plan with few changed agents, before all agents stop."""


def replan(flying: Flying, request: Request, limits: Limits) -> Replanned:
    """Compute a new plan for the remaining part of a mission in flight."""
    began = time.monotonic()
    found = _Replanning(flying, request, limits, began).run()
    return replace(found, seconds=time.monotonic() - began)


class _Replanning:
    def __init__(self, flying: Flying, request: Request, limits: Limits, began: float) -> None:
        self.flying, self.request, self.limits, self.began = flying, request, limits, began
        self.mission: Mission = flying.checked.valid_mission
        self.must_stop = False
        self.late: dict[int, Pieces] = {}
        self.flown_on: tuple[str, ...] | None = None
        self.names = [agent.name for agent in self.mission.agents]
        self.left = [agent.index for agent in self.mission.agents if agent.name not in request.lost]
        self.flights = [polynomials(flying.flights[name]) for name in self.names]
        self.off = self._off()
        allowed = request.in_time if request.clock is None else request.clock
        self.planner = RestPlanner(
            flying.trace, tuple(self.names), tuple(self.left), request, limits, began + float(allowed)
        )
        self.asked_few = False

    def run(self) -> Replanned:
        found = self._run()
        found = replace(found, must_stop=self.must_stop, flown_on=self.flown_on)
        return found if found.way is not Way.NONE or not self.must_stop else replace(found, stops=self._stops_of_some())

    def _run(self) -> Replanned:
        if not self.left:
            return self._none(nobody_left(self.mission))
        now = self._now()
        if not isinstance(now, Checked):
            return now
        self.now = now
        kept = self._kept()
        if kept is not None:
            return kept
        by_few = self._by_few()
        if by_few is not None:
            return by_few
        stopped = self._stopped()
        if not isinstance(stopped, Stopped):
            return self._none(no_safe_stop(self.mission, stopped))
        rest = self._rest(self._told(stopped), stopped.step, stopped)
        if isinstance(rest, Diagnostic):
            return self._none(rest)
        lost = no_longer_kept(self.flying.checked, rest, self.request)
        if lost:
            assert rest.rest is not None
            cannot = (*rest.rest.violated, *rest.rest.nobodys)
            return replace(
                self._none(*lost), rest=rest, begins=stopped.until, stops=self.planner.stops(stopped), cannot=cannot
            )
        return self.planner.by_all(rest, stopped, refute=not self.asked_few)

    def _by_few(self) -> Replanned | None:
        """Plan with few changed agents; agents that need not stop stay in motion while it is found and as it begins.

        Agents with momentum have to stop, so there is no such plan for them (None).
        """
        if any(agent.dynamics.has_momentum for agent in self.mission.agents):
            return None
        stopped = self._stopped(frozenset(self._off_states()))
        if not isinstance(stopped, Stopped):
            named = {name for check in stopped for name in check.agents}
            stopped = self._stopped(
                frozenset(self._off_states())
                | {row for row, agent in enumerate(self.left) if self.names[agent] in named}
            )
        if not isinstance(stopped, Stopped) or not stopped.moving:
            return None
        rest = self._rest(self._told(stopped), stopped.step, stopped)
        if isinstance(rest, Diagnostic) or no_longer_kept(self.flying.checked, rest, self.request):
            return None
        self.asked_few = True
        return self.planner.by_few(rest, stopped, BY_FEW)

    def _none(self, *findings: Diagnostic) -> Replanned:
        return Replanned(Way.NONE, findings)

    # ------------------------------------------------------------------ the mission

    def _now(self) -> Checked | Replanned:
        """The complete mission of the present text, with engines that can plan it, or a result without a plan."""
        whole = self.flying.checked
        if self.request.texts or whole.past is not None:
            checked = earlier(whole, self.request.texts, self.limits)
            if checked.mission is None or checked.kernel is None or not checked.ok:
                return Replanned(Way.NONE, tuple(each for each in checked.findings if not each.code.warning))
            whole = replace(checked, file=whole.file)
        choice, findings = choose_backend(whole.valid_mission, None)
        return Replanned(Way.NONE, tuple(findings)) if choice is None else replace(whole, choice=choice)

    def _rest(self, told: Trace, steps: int, stopped: Stopped | None = None) -> Checked | Diagnostic:
        """Checked mission after the given steps of the flown plan and the stops that follow them, or a diagnostic."""
        states = told.part(range(len(self.names)), 0, steps)
        before = self._texts_before()
        earlier_ones = self.flying.checked.past.flown if self.flying.checked.past else ()
        earlier_ones = tuple(replace(each, texts={**before, **each.texts}) for each in earlier_ones)
        past = Past((*earlier_ones, *self._flown(states, before, stopped)))
        rest = remaining(self.now, past, self.limits)
        return rest if isinstance(rest, Diagnostic) else replace(rest, choice=self.now.choice)

    def _flown(self, states: Trace, before: Mapping[str, str], stopped: Stopped | None) -> Iterator[Flown]:
        """Yield the parts of the flight with the same agents.

        A part with lost agents ends at the step after their last sample.
        """
        request, step, steps = self.request, self.mission.step, states.position.shape[1] - 1
        begin, until, rows = 0, min(request.so_far.until, steps * step), list(range(len(self.names)))
        lost = [agent for agent in rows if agent not in self.left]
        if lost:
            begin = min(math.floor(float(request.so_far.seen[lost].min()) / step + ON_TIME) + 1, steps)
            yield Flown(
                Stretch(states.part(rows, 0, begin), request.lost), tuple(self.names), min(until, begin * step), before
            )
            rows = self.left
        names = tuple(self.names[agent] for agent in self.left)
        begins = {name: stopped.state(row, 0.0) for row, name in enumerate(names)} if stopped else {}
        moving = {names[row]: stopped.state(row, math.inf) for row in stopped.moving} if stopped else {}
        stretch = Stretch(states.part(rows, begin, steps), (), request.given_up, request.slow, moving)
        yield Flown(stretch, names, max(until - begin * step, 0.0), before, begins)

    def _texts_before(self) -> dict[str, str]:
        """Former texts of the files that have changed, by name."""
        return {name: text for name, text in texts(self.flying.checked) if dict(texts(self.now)).get(name) != text}

    # ------------------------------------------------------------------ the plan as it is

    def _off(self) -> dict[int, Array]:
        """Remaining agents that deviate too far from the plan, with their positions, (dim,), metres."""
        planned = _at(self.flights, self.request.so_far.until, self.mission.dimension)
        off = np.linalg.norm(self.request.so_far.last - planned, axis=-1)
        usual = [BEHIND if name in self.request.slow else OFF for name in self.names]
        return {agent: self.request.so_far.last[agent] for agent in self.left if off[agent] > usual[agent]}

    def _kept(self) -> Replanned | None:
        """The result that keeps the old plan, if it is still valid in the present world without the lost agents.

        None otherwise.
        """
        late = {
            agent: self.request.slow[self.names[agent]] for agent in self.off if self.names[agent] in self.request.slow
        }
        if len(late) < len(self.off):
            self.must_stop = True  # the path of a deviating agent is unknown
            return None
        on = fly_on(self.mission, self.flying.trace, self.flights, self.request.so_far, self.left, late)
        self.late = {place: on.pieces[place] for place in on.late}
        steps = on.told.position.shape[1] - 1
        rest = self._rest(on.told, steps)
        bodies_on = self._bodies_on(on.pieces)
        safe = all(check.passed for check in bodies_on)
        self.must_stop = not safe and not all(
            check.passed for check in self._bodies_on([between(own, 0.0, self._ahead()) for own in on.pieces])
        )
        if isinstance(rest, Diagnostic) or rest.mission is None or rest.kernel is None or rest.rest is None:
            return None
        certificate = verify(rest.mission, rest.kernel, on.ahead)
        if safe:
            failed = [each.name for each in certificate.judgements if not each.satisfied]
            self.flown_on = tuple(dict.fromkeys((*rest.rest.violated, *rest.rest.nobodys, *failed)))
        if rest.rest.violated or rest.rest.nobodys:
            return None
        if certificate.passed:
            proven = self._polynomials_on(rest, on, steps)
            certificate = certificate.joined(replace(proven, checks=(*proven.checks, *bodies_on)))
        if certificate.passed:
            flown = {self.names[agent]: written(own) for agent, own in zip(self.left, on.pieces, strict=True)}
            certificate = certificate.joined(way_home(rest.mission, flown, self.flying.ways))
        if not certificate.passed:
            return None
        return Replanned(Way.KEPT, (), rest, certificate, begins=steps * self.mission.step)

    def _ahead(self) -> float:
        """Seconds after the last samples in which a continuing flight must be without contact."""
        return self.request.moment - self.request.so_far.until + self.request.ahead

    def _bodies_on(self, pieces: list[Pieces]) -> list[Check]:
        """Checks that bodies do not touch if all agents continue."""
        return bodies(self._team(self.request.so_far.until), pieces)

    def _team(self, moment: float) -> Mission:
        """The mission for the remaining agents, with its world from a time of the plan on.

        Args:
            moment: seconds of the plan.
        """
        elapsed = self.flying.checked.past.steps if self.flying.checked.past else 0
        left = tuple(self.names[each] for each in self.left)
        seconds, slow = elapsed * self.mission.step + moment, self.flying.checked.rest
        team = team_at(self.now.valid_mission, seconds, self.request.so_far.last[self.left], left)
        return slowed(team, slow.slow if slow else {})

    def _polynomials_on(self, rest: Checked, on: FlyOn, steps: int) -> Certificate:
        """Checks of the polynomials of continuing agents from a step on, where they are in motion.

        The motion of a delayed agent is not a commanded polynomial; with delayed agents, only bodies and requirements
        are checked.
        """
        if on.late:
            return Certificate(rest.valid_mission.name, ())
        cut = steps * self.mission.step
        files = {self.names[agent]: written(between(self.flights[agent], cut)) for agent in self.left}
        proven = verify_polynomials(rest.valid_mission, rest.valid_kernel, on.ahead, files)
        return replace(proven, checks=tuple(check for check in proven.checks if check.name != "rest"))

    # ------------------------------------------------------------------ stopping

    def _stopped(self, stopping: frozenset[int] | None = None) -> Stopped | tuple[Check, ...]:
        moment, least, steps = self.request.moment, float(self.request.in_time), int(self.mission.steps)
        return stop_all(self._team(moment), self._own(), moment, self._off_states(), least, steps, stopping)

    def _own(self) -> list[Pieces]:
        """Polynomials of the remaining agents."""
        return [self.flights[agent] for agent in self.left]

    def _off_states(self) -> dict[int, Array]:
        """States of the deviating agents at the stop time, (5, 4), metres, rad and seconds, by index among the
        remaining agents.
        """
        moment = self.request.moment
        return {place: self._state(agent, moment) for place, agent in enumerate(self.left) if agent in self.off}

    def _state(self, agent: int, moment: float) -> Array:
        """State of an agent at a time, from position to snap: (5, 4), metres, rad and seconds.

        An agent that deviates from the plan is delayed on its path, or at rest.
        """
        if agent not in self.off:
            return state_at(self.flights[agent], moment)
        slow = self.request.slow.get(self.names[agent])
        if slow is not None:
            return state_behind(self.flights[agent], self.off[agent], moment, slow)
        yaw, altitude = _yaw(self.flights[agent], moment), float(self.mission.agents[agent].altitude)
        return resting_state(self.off[agent], yaw, altitude)

    def _stops_of_some(self) -> dict[str, str]:
        """Polynomials of the fewest stops that avoid contact while other agents continue, as text by agent name."""
        moment = self.request.moment
        late = {place: between(on, moment - self.request.so_far.until) for place, on in self.late.items()}
        stops = stop_some(self._team(moment), self._own(), moment, self._off_states(), late, self.request.ahead)
        return {self.names[self.left[place]]: written(stop) for place, stop in stops.items()}

    def _told(self, stopped: Stopped) -> Trace:
        """Trace of the flight so far and of the commanded motion until the new plan begins.

        Lost agents stay at their last positions.
        """
        seen, dimension = self.request.so_far.trace, self.mission.dimension
        flown = seen.position.shape[1]
        steps: Array = np.arange(flown, stopped.step + 1, dtype=np.float64) * self.mission.step
        position, velocity, heading = stopped.states(self.request.moment, steps, dimension)
        for number in np.flatnonzero(steps < self.request.moment).tolist():
            for row, agent in enumerate(self.left):
                state = self._state(agent, float(steps[number]))
                position[row, number], velocity[row, number] = state[0, :dimension], state[1, :dimension]
                heading[row, number] = state[0, 3]
        shape = (len(self.names), steps.size)
        whole = [
            np.repeat(seen.position[:, -1:], steps.size, axis=1),
            np.zeros((*shape, dimension)),
            np.repeat(seen.heading[:, -1:], steps.size, axis=1),
        ]
        for column, own in zip(whole, (position, velocity, heading), strict=True):
            column[self.left] = own
        whole[0][self.left, -1] = ends(stopped.pieces, dimension)
        for row in stopped.moving:  # they are at their planned places
            whole[0][self.left[row], -1] = self.flying.trace.position[self.left[row], stopped.step]
        whole[1][:, -1] = 0.0
        joined = [np.concatenate([old, new], axis=1) for old, new in zip(arrays(seen), whole, strict=True)]
        momentum = np.array([agent.dynamics.has_momentum for agent in self.mission.agents])
        straight = np.concatenate([np.diff(joined[0], axis=1) / self.mission.step, np.zeros_like(joined[0][:, :1])], 1)
        joined[1] = np.where(momentum[:, None, None], joined[1], straight)
        return Trace(self.mission.step, *joined)


def _at(flights: list[Pieces], moment: float, dimension: int) -> Array:
    """Positions of trajectories at a time in seconds: (agents, dim), metres."""
    return np.stack([state_at(own, moment)[0, :dimension] for own in flights])


def _yaw(flight: Pieces, moment: float) -> float:
    return float(state_at(flight, moment)[0, 3])


def way_home(mission: Mission, flown: Mapping[str, str], ways: Ways | None) -> Certificate:
    """Certificate of the return transfer and the landing; empty without pads.

    Args:
        flown: text of each agent's polynomials to the end of its mission, by agent name.
        ways: transfers planned with them, including lost agents; None if unknown.
    """
    if ways is None or not is_whole(mission):
        return Certificate(mission.name, ())
    home = ways.get(Stage.HOME)
    own = {} if home is None else {Stage.HOME: {agent.name: home[agent.name] for agent in mission.agents}}
    return verify_whole_flight(mission, flown, own)
