"""Replanning in flight: what was flown is the past, and the rest of the mission is planned with the world as it is.

in   Flying, Request, Limits
out  Replanned: the plan kept where it still holds, else repaired, else made anew; or what can no longer be kept
says MC719 to MC724

The past and the new plan together satisfy the mission: what is left of each requirement after the past
(``progression``) is what the plan is made and verified for.
"""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np

from missionc.backends.api import Budget, Impossible
from missionc.base.limits import Limits
from missionc.base.trace import Array, Trace
from missionc.base.units import Seconds
from missionc.curves.crazyflie_csv import Pieces, polynomials, written
from missionc.diagnostics.model import Diagnostic
from missionc.flight.stop_and_hover import state_at
from missionc.ir import Mission
from missionc.lower.choose_backend import choose_backend
from missionc.pipeline import driver
from missionc.pipeline.checked import Checked
from missionc.pipeline.provenance import texts
from missionc.pipeline.remaining import earlier, remaining
from missionc.pipeline.replan.cannot_replan import no_longer_kept, no_plan_in_time, no_safe_stop, nobody_left
from missionc.pipeline.replan.request import Flying, Replanned, Request, Way
from missionc.pipeline.replan.stop_all import Stopped, ends, flown_on, from_moment, resting_state, stop_all
from missionc.pipeline.results import Compiled, Verified
from missionc.progression.past_document import Flown, Past
from missionc.progression.rest_of_mission import team_at
from missionc.progression.stretches import Stretch
from missionc.verify.certificate import Certificate, Check
from missionc.verify.verify_plan import verify, verify_polynomials

OFF = 0.25
"""Metres: who is further from where its flight has it is told to stay where it is."""
SHARE = 0.4
"""The share of the time that a repair may take, before everything is planned anew."""


def replan(flying: Flying, request: Request, limits: Limits) -> Replanned:
    """The rest of a mission that is being flown."""
    began = time.monotonic()
    found = _Replanning(flying, request, limits, began).run()
    return replace(found, seconds=time.monotonic() - began)


class _Replanning:
    def __init__(self, flying: Flying, request: Request, limits: Limits, began: float) -> None:
        self.flying, self.request, self.limits, self.began = flying, request, limits, began
        assert flying.checked.mission is not None
        self.mission: Mission = flying.checked.mission
        self.must_stop = False
        self.names = [agent.name for agent in self.mission.agents]
        self.left = [agent.index for agent in self.mission.agents if agent.name not in request.lost]
        self.flights = [polynomials(flying.flights[name]) for name in self.names]
        self.off = self._off()

    def run(self) -> Replanned:
        found = self._run()
        return replace(found, must_stop=self.must_stop)

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
        stopped = self._stopped()
        if not isinstance(stopped, Stopped):
            return self._none(no_safe_stop(self.mission, stopped))
        rest = self._rest(self._told(stopped), stopped.step)
        if isinstance(rest, Diagnostic):
            return self._none(rest)
        lost = no_longer_kept(self.flying.checked, rest, self.request)
        if lost:
            assert rest.rest is not None
            cannot = (*rest.rest.violated, *rest.rest.nobodys)
            return replace(
                self._none(*lost), rest=rest, begins=stopped.until, stops=self._stops(stopped), cannot=cannot
            )
        return self._planned(rest, stopped)

    def _none(self, *findings: Diagnostic) -> Replanned:
        return Replanned(Way.NONE, findings)

    # ------------------------------------------------------------------ the mission

    def _now(self) -> Checked | Replanned:
        """The whole mission as it reads now, with engines that plan it."""
        whole = self.flying.checked
        if self.request.texts or whole.past is not None:
            checked = earlier(whole, self.request.texts, self.limits, 1.0)
            if checked.mission is None or checked.kernel is None or not checked.ok:
                return Replanned(Way.NONE, tuple(each for each in checked.findings if not each.code.warning))
            whole = replace(checked, file=whole.file)
        assert whole.mission is not None
        choice, findings = choose_backend(whole.mission, None)
        return Replanned(Way.NONE, tuple(findings)) if choice is None else replace(whole, choice=choice)

    def _rest(self, told: Trace, steps: int) -> Checked | Diagnostic:
        """The mission after those steps of the plan that was flown."""
        states = Trace(told.step, *(each[:, : steps + 1] for each in (told.position, told.velocity, told.heading)))
        stretch = Stretch(states, self.request.lost, self.request.given_up)
        until = min(self.request.so_far.until, steps * self.mission.step)
        before = self._texts_before()
        earlier_ones = self.flying.checked.past.flown if self.flying.checked.past else ()
        earlier_ones = tuple(replace(each, texts={**before, **each.texts}) for each in earlier_ones)
        past = Past((*earlier_ones, Flown(stretch, tuple(self.names), until, before)))
        rest = remaining(self.now, past, self.limits)
        return rest if isinstance(rest, Diagnostic) else replace(rest, choice=self.now.choice)

    def _texts_before(self) -> dict[str, str]:
        """The files that read otherwise now, as they were."""
        return {name: text for name, text in texts(self.flying.checked) if dict(texts(self.now)).get(name) != text}

    # ------------------------------------------------------------------ the plan as it is

    def _off(self) -> dict[int, Array]:
        """Those that are left and further from where their flights have them than is usual: where they are."""
        planned = _at(self.flights, self.request.so_far.until, self.mission.dimension)
        off = np.linalg.norm(self.request.so_far.last - planned, axis=-1)
        return {agent: self.request.so_far.last[agent] for agent in self.left if off[agent] > OFF}

    def _kept(self) -> Replanned | None:
        """The plan, where it still holds with the world as it is, without those who are lost."""
        steps = self.request.so_far.trace.position.shape[1] - 1
        if self.off:
            return None
        old = self.flying.trace
        told = Trace(
            old.step,
            *(
                np.concatenate([seen[:, :steps], plan[:, steps:]], axis=1)
                for seen, plan in zip(_arrays(self.request.so_far.trace), _arrays(old), strict=True)
            ),
        )
        rest = self._rest(told, steps)
        if isinstance(rest, Diagnostic) or rest.mission is None or rest.kernel is None or rest.rest is None:
            return None
        if rest.rest.violated or rest.rest.nobodys:
            return None
        ahead = Trace(old.step, *(each[self.left, steps:] for each in _arrays(old)))
        certificate = verify(rest.mission, rest.kernel, ahead)
        if certificate.passed:
            certificate = certificate.joined(self._flown_on(rest, ahead, steps))
        if not certificate.passed:
            return None
        return Replanned(Way.KEPT, (), rest, certificate, begins=steps * self.mission.step)

    def _flown_on(self, rest: Checked, ahead: Trace, steps: int) -> Certificate:
        """The polynomials of those that are left, from a step on; they do not rest where they are cut."""
        assert rest.mission is not None
        assert rest.kernel is not None
        cut = steps * self.mission.step
        files = {self.names[agent]: written(from_moment(self.flights[agent], cut)) for agent in self.left}
        proven = verify_polynomials(rest.mission, rest.kernel, ahead, files)
        return replace(proven, checks=tuple(check for check in proven.checks if check.name != "rest"))

    # ------------------------------------------------------------------ stopping

    def _stopped(self) -> Stopped | tuple[Check, ...]:
        assert self.now.mission is not None
        whole, so_far = self.now.mission, self.request.so_far
        elapsed = self.flying.checked.past.steps if self.flying.checked.past else 0
        moment = self.request.moment
        began = elapsed * self.mission.step + moment
        team = team_at(whole, began, so_far.last[self.left], tuple(self.names[each] for each in self.left))
        off = {}
        for place, agent in enumerate(self.left):
            if agent in self.off:
                yaw, altitude = _yaw(self.flights[agent], moment), float(self.mission.agents[agent].altitude)
                off[place] = resting_state(self.off[agent], yaw, altitude)
        own = [self.flights[agent] for agent in self.left]
        least = float(self.request.in_time)
        # Nothing is known of the way of one that is not where its flight has it.
        self.must_stop = bool(off) or not all(check.passed for check in flown_on(team, own, moment))
        return stop_all(team, own, moment, off, least, int(self.mission.steps))

    def _stops(self, stopped: Stopped) -> dict[str, str]:
        """The text of each agent's stop."""
        return {self.names[agent]: written(own) for agent, own in zip(self.left, stopped.pieces, strict=True)}

    def _told(self, stopped: Stopped) -> Trace:
        """What was flown, and what everybody is told until the new plan begins; the lost stay where they were seen."""
        seen, dimension = self.request.so_far.trace, self.mission.dimension
        flown = seen.position.shape[1]
        steps: Array = np.arange(flown, stopped.step + 1, dtype=np.float64) * self.mission.step
        position, velocity, heading = stopped.states(self.request.moment, steps, dimension)
        for number in np.flatnonzero(steps < self.request.moment).tolist():
            for row, agent in enumerate(self.left):
                state = state_at(self.flights[agent], float(steps[number]))
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
        whole[1][:, -1] = 0.0
        joined = [np.concatenate([old, new], axis=1) for old, new in zip(_arrays(seen), whole, strict=True)]
        momentum = np.array([agent.dynamics.has_momentum for agent in self.mission.agents])
        straight = np.concatenate([np.diff(joined[0], axis=1) / self.mission.step, np.zeros_like(joined[0][:, :1])], 1)
        joined[1] = np.where(momentum[:, None, None], joined[1], straight)
        return Trace(self.mission.step, *joined)

    # ------------------------------------------------------------------ planning

    def _planned(self, rest: Checked, stopped: Stopped) -> Replanned:
        allowed = self.request.in_time if self.request.clock is None else self.request.clock
        deadline = self.began + float(allowed)
        budget = Budget(deadline, seed=self.request.seed, limits=self.limits)
        stops = self._stops(stopped)
        rest = replace(rest, stops=tuple(stops.items()))
        # Where somebody is lost the way on is another one; a repair finds what is near.
        way, compiled = Way.REPAIRED, None if self.request.lost else self._repaired(rest, stopped, budget)
        if compiled is None:
            way = Way.ANEW
            compiled = driver.plan(rest, self.request.options, budget, exports=self.request.exports)
        if not isinstance(compiled.outcome, Verified):
            findings, outcome = no_plan_in_time(rest, compiled), compiled.outcome
            cannot = outcome.conflict[:1] if isinstance(outcome, Impossible) else ()
            ended = Replanned(Way.NONE, findings, rest, compiled=compiled, begins=stopped.until)
            return replace(ended, stops=stops, cannot=cannot)
        changed = tuple(self.names[agent] for agent in self.left)
        return Replanned(way, compiled.findings, rest, None, compiled, stopped.until, changed, stops)

    def _repaired(self, rest: Checked, stopped: Stopped, budget: Budget) -> Compiled | None:
        """The old plan from where everybody stopped, polished until it keeps what is left."""
        now = time.monotonic()
        more = replace(budget, deadline=now + SHARE * (budget.deadline - now))
        near = self._near(rest, stopped)
        compiled = driver.plan_near(rest, near, self.request.options, more, self.request.exports)
        return compiled if compiled is not None and isinstance(compiled.outcome, Verified) else None

    def _near(self, rest: Checked, stopped: Stopped) -> Trace:
        """From where everybody stopped back onto the old plan, as fast as agents go, and on along it."""
        assert rest.mission is not None
        old = self.flying.trace.position[self.left, stopped.step :]
        position = old.copy()
        position[:, 0] = ends(stopped.pieces, self.mission.dimension)
        for index, agent in enumerate(rest.mission.agents):
            reach = agent.dynamics.top_speed * float(rest.mission.step)
            for step in range(1, position.shape[1]):
                way = old[index, step] - position[index, step - 1]
                far = float(np.linalg.norm(way))
                position[index, step] = position[index, step - 1] + way * min(1.0, reach / far if far else 1.0)
        velocity = np.zeros_like(position)
        velocity[:, :-1] = np.diff(position, axis=1) / rest.mission.step
        return Trace(
            Seconds(rest.mission.step), position, velocity, self.flying.trace.heading[self.left, stopped.step :]
        )


def _arrays(trace: Trace) -> tuple[Array, Array, Array]:
    return trace.position, trace.velocity, trace.heading


def _at(flights: list[Pieces], moment: float, dimension: int) -> Array:
    """(agents, dim): where flights are at a moment, seconds."""
    return np.stack([state_at(own, moment)[0, :dimension] for own in flights])


def _yaw(flight: Pieces, moment: float) -> float:
    return float(state_at(flight, moment)[0, 3])
