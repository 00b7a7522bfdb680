"""Timetable of an order of visits: earliest times of a simple temporal network, and steps of visits.

Travel times of a restart are perturbed at random, so that each schedule differs slightly. Between two paths an agent
pauses, to stop and accelerate or to turn.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import ceil

import numpy as np

from missionc.backends.clot.schedule.gather_team import gather_team
from missionc.backends.clot.schedule.goal_sets import GoalSet, GoalSets
from missionc.backends.clot.schedule.presence import PresenceConstraints
from missionc.backends.clot.schedule.tasks import (
    TEAM,
    Capacity,
    Event,
    Option,
    TimedLiterals,
    earliest_time,
    mutex_seconds,
)
from missionc.backends.clot.schedule.timed_paths import Closure, TimedPaths
from missionc.backends.clot.schedule.visits import Appointment, Key, Leg, Place, Visit, VisitRun
from missionc.base.late_dataclass import Record
from missionc.base.trace import Array
from missionc.geometry.dynamics import can_wait, speeds
from missionc.ir import Dynamics, Mission, Predicate
from missionc.ir.kernel.nodes import Node


class PerturbedDistances(Record):
    """Random perturbations of distances and delays for one schedule; none if ``noise`` is 0.

    ``stretch`` is the factor on the path length to each event; ``delay`` is the fraction of the available time by which
    an event without a region is delayed.
    """

    noise: float
    generator: np.random.Generator
    stretch: dict[tuple[Node, int, int], float] = field(default_factory=dict)
    delay: dict[tuple[Node, int, int], float] = field(default_factory=dict)

    def factor(self, event: Event) -> float:
        key = event.chooser, event.agent, event.step
        if self.noise and key not in self.stretch:
            self.stretch[key] = float(np.exp(self.noise * self.generator.standard_normal()))
        return self.stretch[key] if self.noise else 1.0

    def put_off(self, event: Event) -> float:
        """Delay of an event as a fraction of the available time: 0 without noise, otherwise random in [0, 1]."""
        key = event.chooser, event.agent, event.step
        if self.noise and key not in self.delay:
            self.delay[key] = max(0.0, float(self.generator.uniform(-0.5, 1.0)))
        return self.delay.get(key, 0.0)


ABOUT = np.pi
"""Assumed turn, radians, between two paths of an agent that can wait."""


def pause(dynamics: Dynamics) -> float:
    """Time to stop and accelerate between two paths, or to turn in place, seconds."""
    turning = ABOUT / dynamics.top_turn if can_wait(dynamics) else 0.0
    return dynamics.top_speed / dynamics.top_acceleration + turning


ROUNDING = 1e-6
"""Fraction of a step by which a time may exceed a whole number of steps because of rounding."""

LATE = 1e3
"""Cost of a second of delay relative to a second of travel."""


@dataclass(slots=True)
class _Draft:
    """Order of visits with the selected option of each task; ``work`` is the number of visits examined for it."""

    order: list[Visit]
    options: dict[int, Option] = field(default_factory=dict)
    cost: float = 0.0
    work: int = 0

    def visits(self, task: int) -> list[Visit]:
        return [visit for visit in self.order if visit.key[0] == task]

    def without(self, tasks: list[int]) -> _Draft:
        left = [visit for visit in self.order if visit.key[0] not in tasks]
        return _Draft(left, {task: option for task, option in self.options.items() if task not in tasks}, self.cost)


def _deadline(options: tuple[Option, ...]) -> int:
    return min((event.high for option in options for event in option.events), default=0)


class Timetable:
    """Times of an order of visits for agents with given travel times.

    ``waits``: for a visit, the stops before it. ``tied``: agents tied by a formation or links. ``pace``, ``speed`` in
    m/s and ``stopping`` in seconds have a number for each agent. ``unhurried`` is the share of the slack before a
    visit. ``closures`` has the places that are closed to each agent for a time.
    """

    mission: Mission
    starts: Array
    finishes: list[Array | None]
    speed: Array
    pace: Array
    stopping: Array
    goals: GoalSets
    capacities: tuple[Capacity, ...]
    formations: tuple[Predicate, ...]
    tied: frozenset[int]
    waits: Mapping[Key, tuple[Key, ...]]
    unhurried: float
    shaped: dict[tuple[tuple[Predicate, ...], bytes], Array]
    timed: TimedPaths
    closures: list[tuple[Closure, ...]]

    def _run(self, visits: list[Visit], perturbed: PerturbedDistances, fixed: list[TimedLiterals]) -> VisitRun:
        """Times of the visits of an order, each as early as possible."""
        step = self.mission.step
        where, free = self.starts.copy(), np.zeros(len(self.starts))
        since = [-1] * len(self.starts)
        number_of: dict[Key, int] = {}
        sure, way, run = list(fixed), 0.0, VisitRun()
        guarded = [(number, visit) for number, visit in enumerate(visits) if visit.event.before]
        for number, visit in enumerate(visits):
            low, high = visit.event.low * step, visit.event.high * step
            base = 0.0
            if visit.after is not None:
                base = run.times[number_of[visit.after]]
                low, high = low + base, high + base
            begin = max(low, visit.event.not_before * step)
            if not visit.agents:
                begin = max([begin, *(run.times[number_of[stop]] for stop in self.waits.get(visit.key, ()))])
                begin = max(begin, min(high, self._awaited(visit, visits[number + 1 :], where, free, begin)))
            shaped = sorted({agent for shape in visit.shapes for agent in shape.others})
            places: list[Place] = []
            legs: list[Leg] = []
            takes: dict[int, float] = {}
            for place, length in self._ways(visit.come, where, free, begin, visits[number + 1 :]):
                agent = place.agent
                stretch = perturbed.factor(visit.event) if visit.come.goals else 1.0
                seconds = self._travel(agent, length) * stretch
                barring = [each for at, each in guarded if at >= number]
                closures = (*self.closures[agent], *self._closed_until(barring, agent, number_of, run))
                if closures and place.goal is not None:
                    place, arrival = self._among_closures(place, where[agent], float(free[agent]), seconds, closures)
                    seconds = arrival - float(free[agent])
                begin = max(begin, free[agent] + seconds)
                if not place.sure:
                    run.late += self.mission.horizon
                takes[agent] = seconds
                legs.append(self._leg(agent, since, free, run, seconds, length))
                way += length
                places.append(place)
            if visit.shapes:
                gaps = np.linalg.norm(self._gathered(visit.shapes, where) - where, axis=1)
                for agent in shaped:
                    length = float(gaps[agent])
                    seconds = self._travel(agent, length)
                    begin = max(begin, free[agent] + seconds if length else 0.0)
                    takes[agent] = max(seconds, takes.get(agent, 0.0))
                    legs.append(self._leg(agent, since, free, run, seconds, length))
                way += float(gaps.sum())
                beside = where.copy()
                for place in places:
                    beside[place.agent] = place.point
                where = self._gathered(visit.shapes, beside)
            if not visit.come.goals and not visit.fixed:
                latest = min(high, self._latest(visit) * step)
                begin += perturbed.put_off(visit.event) * max(0.0, latest - begin)
            begin = earliest_time(visit.says, begin, sure, self.capacities, step)
            begin = self._released(visit, begin, high, sure, takes)
            begin = earliest_time(visit.says, begin, sure, self.capacities, step)
            for each in visit.before:
                barred = TimedLiterals(each.literals, each.low + base, begin - step, each.gap)
                run.late += mutex_seconds(barred, sure, step)
                sure.append(barred)
            sure.extend(each.shifted(begin) for each in visit.says)
            run.late += max(0.0, begin - high)
            places = self._moving_on(visit, places, visits[number + 1 :])
            for agent in shaped:  # a team in formation may move on together
                free[agent], since[agent] = max(begin, free[agent]), number
            kept = [shape for first, last, shape in self._in_formation(sure) if first <= begin <= last]
            for agent, shift in self._carried((*visit.kept, *kept), places, where):
                where[agent] += shift
                free[agent], since[agent] = max(begin, free[agent]), number
            for place in places:
                agent = place.agent
                stays = begin + visit.lasts * step if visit.lasts < self.mission.steps else self.mission.horizon
                free[agent], since[agent] = max(begin, stays), number
                if not visit.shapes:
                    where[agent] = place.point if place.leaves is None else place.leaves
            number_of[visit.key] = number
            run.times.append(begin)
            run.legs.append(legs)
            run.places.append(tuple(places))
        for agent, finish in enumerate(self.finishes):
            if finish is not None:
                gap = float(np.linalg.norm(finish - where[agent]))
                way += gap
                seconds = self._travel(agent, gap)
                run.last.append(
                    (since[agent], free[agent] + seconds - (run.times[since[agent]] if since[agent] >= 0 else 0))
                )
                free[agent] += seconds
        run.end = float(free.max(initial=0.0))
        run.late += max(0.0, run.end - self.mission.horizon)
        run.cost = LATE * run.late + run.end + 0.1 * way / float(self.pace.mean())
        return run

    def _closed_until(
        self, visits: Sequence[Visit], agent: int, number_of: Mapping[Key, int], run: VisitRun
    ) -> Iterator[Closure]:
        """Places closed to an agent up to one of these visits, from the visit that it counts from."""
        for visit in visits:
            if visit.after is None or visit.after in number_of:
                base = 0.0 if visit.after is None else run.times[number_of[visit.after]]
                for each in self.timed.closures(agent, visit.event.before):
                    yield replace(each, low=base + each.low, high=math.inf)

    def _among_closures(
        self, place: Place, here: Array, free: float, seconds: float, closures: Sequence[Closure]
    ) -> tuple[Place, float]:
        """Place of a visit, and the earliest time of arrival, seconds, if places are closed to the agent for a time.

        Args:
            here: position, (dim,), metres, from ``free`` on, seconds.
            seconds: duration of the path without closed places.
        """
        agent, goal = place.agent, place.goal
        assert goal is not None
        path = self.timed.path(agent, here, free, goal.cells, closures, float(self.pace[agent]))
        if path is None:
            return replace(place, sure=False), free + seconds
        length = (path.arrival - free) * float(self.pace[agent])
        if length <= seconds * float(self.pace[agent]):
            return place, free + seconds
        there = goal.points[int(np.flatnonzero(goal.cells == path.cell)[0])]
        return replace(place, point=there), path.arrival + float(self.stopping[agent])

    def _moving_on(self, visit: Visit, places: list[Place], later: Sequence[Visit]) -> list[Place]:
        """Positions of a visit, with final positions for agents that meet and cannot wait."""
        if not visit.come.moves_on or not 0 < visit.lasts < self.mission.steps:
            return places
        who = [place.agent for place in places]
        if all(can_wait(self.mission.agents[agent].dynamics) for agent in who):
            return places
        goals = [self._onward(agent, later) for agent in who]
        points = np.stack([place.point for place in places])
        leaves = self.goals.moved_on(who, points, visit.lasts * self.mission.step, self.pace[who], goals)
        return [replace(place, leaves=there) for place, there in zip(places, leaves, strict=True)]

    def _awaited(self, visit: Visit, later: Sequence[Visit], where: Array, free: Array, begin: float) -> float:
        """Time of an event without a goal region such that agents reach the following event in time, seconds."""
        soonest = begin
        for each in later:
            if each.after == visit.key and not each.shapes:
                for place, length in self._ways(each.come, where, free, begin, ()):
                    there = float(free[place.agent]) + self._travel(place.agent, length)
                    soonest = max(soonest, there - each.event.high * self.mission.step)
        return soonest

    def _released(
        self, visit: Visit, begin: float, latest: float, sure: list[TimedLiterals], takes: dict[int, float]
    ) -> float:
        """Earliest time of agents that a formation must release first, seconds.

        A single agent waits for the release if there is time; for a formation that the visit excludes, all agents wait.

        Args:
            latest: deadline of arrival, seconds.
            takes: travel time of each agent, seconds.
        """
        denied = {what for each in visit.says for who, what, holds in each.literals if who == TEAM and not holds}
        for low, high, shape in self._in_formation(sure):
            if low <= begin:
                there = high + max((takes.get(agent, 0.0) for agent in shape.others), default=0.0)
                if there > high and (there <= latest or shape in denied):
                    begin = max(begin, there)
        return begin

    def _in_formation(self, sure: Iterable[TimedLiterals]) -> Iterator[tuple[float, float, Predicate]]:
        """Yield the formations that are certain, with begin and end times, seconds."""
        for each in sure if self.formations else ():
            for who, what, holds in each.literals:
                if who == TEAM and holds and what.formation is not None:
                    yield each.low, each.high, what

    def _carried(self, kept: Iterable[Predicate], places: list[Place], where: Array) -> Iterator[tuple[int, Array]]:
        """Yield the agents moved only by a formation, with their displacement, (dim,), metres."""
        going = {place.agent: place.point - where[place.agent] for place in places}
        for shape in kept:
            led = [shift for agent, shift in going.items() if agent in shape.others]
            if led:
                yield from ((agent, np.mean(led, axis=0)) for agent in sorted(shape.others - going.keys()))

    def _leg(self, agent: int, since: list[int], free: Array, run: VisitRun, seconds: float, length: float) -> Leg:
        stays = 0.0 if since[agent] < 0 else float(free[agent]) - run.times[since[agent]]
        soonest, latest = length / float(self.speed[agent]), self._dawdled(agent, length, seconds)
        return Leg(since[agent], stays + seconds, stays + soonest, stays + latest)

    def _ways(
        self, come: PresenceConstraints, where: Array, free: Array, begin: float, later: Sequence[Visit]
    ) -> Iterator[tuple[Place, float]]:
        """Yield the target positions of agents for a visit, with path lengths, metres.

        Args:
            where: positions, (agents, dim), metres.
            free: time at which each agent is free, (agents,), seconds.
            begin: earliest time, seconds.
            later: following visits.
        """
        own = dict(come.goals)
        for some in come.some:
            own.update(self._cheapest(some.goals, some.count, own, where, free))
        met = {agent for meeting in come.meetings for agent in meeting.agents}
        for meeting in come.meetings:
            who = list(meeting.agents)
            goals = [self.goals.of(agent, own[agent]) if agent in own else None for agent in who]
            onward = [self._onward(agent, later) for agent in who]
            ready = free[who] - begin
            points, lengths = self.goals.meeting(who, where[who], ready, self.pace[who], meeting.reach, goals, onward)
            yield from zip(map(Place, who, points), lengths.tolist(), strict=True)
        for agent, nodes in own.items():
            goal = None if agent in met else self.goals.of(agent, nodes)
            if goal is not None:
                there, length, sure = self.goals.way(goal, agent, where[agent])
                yield Place(agent, there, goal, sure), length

    def _onward(self, agent: int, later: Sequence[Visit]) -> GoalSet | None:
        """Next goal of an agent, if its next visit has a goal for this agent; None otherwise."""
        for visit in later:
            if agent in visit.agents:
                own = dict(visit.come.goals)
                return self.goals.of(agent, own[agent]) if agent in own else None
        return None

    def _cheapest(
        self,
        goals: tuple[tuple[int, tuple[Node, ...]], ...],
        count: int,
        taken: dict[int, tuple[Node, ...]],
        where: Array,
        free: Array,
    ) -> dict[int, tuple[Node, ...]]:
        """The ``count`` goals with the earliest arrivals, among agents without another goal; formulas by agent.

        Args:
            where: positions, (agents, dim), metres.
            free: time at which each agent is free, (agents,), seconds.
        """
        soonest: list[tuple[bool, float, int, tuple[Node, ...]]] = []
        for agent, nodes in goals:
            goal = self.goals.of(agent, nodes)
            if goal is not None and agent not in taken:
                _, length, sure = self.goals.way(goal, agent, where[agent])
                soonest.append((not sure, free[agent] + self._travel(agent, length), agent, nodes))
        chosen = sorted(soonest, key=lambda each: each[:3])[:count]
        return {agent: nodes for *_, agent, nodes in chosen}

    def _travel(self, agent: int, length: float) -> float:
        """Travel time of a path from rest to rest, seconds."""
        seconds = length / float(self.pace[agent])
        return seconds + min(float(self.stopping[agent]), seconds)

    def _dawdled(self, agent: int, length: float, seconds: float) -> float:
        """Greatest duration of a path, seconds, for an agent that cannot wait; infinite for others."""
        least = float(speeds(self.mission.agents[agent].dynamics)[0])
        return max(seconds, length / least) if least > 0 else math.inf

    def _at_steps(self, visits: list[Visit], run: VisitRun, slower: float) -> tuple[Appointment, ...]:
        """Appointments of the visits: earliest times multiplied by ``slower``; uncoupled visits are delayed within
        their slack."""
        step = self.mission.step
        unhurried = run.times if slower <= 1 else self._unhurried(visits, run, slower)
        appointments: list[Appointment] = []
        at: dict[Key, int] = {}
        for visit, first, time, places, legs in zip(visits, run.times, unhurried, run.places, run.legs, strict=True):
            base = 0 if visit.after is None else at[visit.after]
            latest = min(base + visit.event.high, self._latest(visit))
            begins = visit.event.low * step
            if visit.after is not None:
                begins += next(each for one, each in zip(visits, run.times, strict=True) if one.key == visit.after)
            if self._is_loose(visit) or visit.come.goals or (first > begins and not visit.come.meetings):
                wanted = ceil(time / step - ROUNDING) if self._is_loose(visit) or slower <= 1 else round(time / step)
            else:  # no agent must move for it, and the next visit may need the time
                wanted = max([round(first / step), *(each.step for each in appointments)])
            stops = [at[stop] for stop in self.waits.get(visit.key, ())]
            soonest = max([base + visit.event.low, visit.event.not_before, *stops])
            for leg in legs:
                since = 0 if leg.begin < 0 else appointments[leg.begin].step
                wanted = max(wanted, since + ceil(leg.least / step - ROUNDING))
            # a late agent is late at the end
            at[visit.key] = min(max(soonest, min(wanted, latest)), self.mission.steps)
            appointments.append(Appointment(visit, at[visit.key], places))
        return tuple(appointments)

    def _is_loose(self, visit: Visit) -> bool:
        """Return true if no agent of the visit is coupled to others, or in a formation up to the visit."""
        return not self.tied or (bool(visit.agents) and self.tied.isdisjoint(visit.agents) and not visit.kept)

    def _unhurried(self, visits: list[Visit], run: VisitRun, slower: float) -> list[float]:
        """Times of visits between the earliest and the latest that windows, paths and the horizon allow, seconds.

        Any mean of two solutions of a simple temporal network is a solution. Visits with coupled agents are delayed by
        the factor ``slower``.
        """
        soonest = [
            time if self._is_loose(visit) else time * slower for visit, time in zip(visits, run.times, strict=True)
        ]
        step, index = self.mission.step, {visit.key: number for number, visit in enumerate(visits)}
        latest = [
            self._latest(visit) * step if self._is_loose(visit) else time
            for visit, time in zip(visits, soonest, strict=True)
        ]
        for begin, seconds in run.last:
            if begin >= 0:
                latest[begin] = min(latest[begin], self.mission.horizon - seconds)
        for _ in range(len(visits) + 1):
            before = list(latest)
            for number in range(len(visits) - 1, -1, -1):
                visit = visits[number]
                low, high = visit.event.low * step, visit.event.high * step
                if visit.after is None:
                    latest[number] = min(latest[number], high)
                else:
                    base = index[visit.after]
                    latest[number] = min(latest[number], latest[base] + high)
                    latest[base] = min(latest[base], latest[number] - low)
                for stop in self.waits.get(visit.key, ()):
                    latest[index[stop]] = min(latest[index[stop]], latest[number])
                for leg in run.legs[number]:
                    if leg.begin >= 0:
                        latest[leg.begin] = min(latest[leg.begin], latest[number] - leg.seconds)
            for number, legs in enumerate(run.legs):  # not so late that it would have to be slower than possible
                for leg in legs:
                    begun, soon = (latest[leg.begin], run.times[leg.begin]) if leg.begin >= 0 else (0.0, 0.0)
                    latest[number] = min(latest[number], begun + max(leg.most, run.times[number] - soon))
            if latest == before:
                break
        return [
            soon + (self.unhurried * max(0.0, late - soon) if self._is_loose(visit) and not self._timed(visit) else 0.0)
            for visit, soon, late in zip(visits, soonest, latest, strict=True)
        ]

    def _timed(self, visit: Visit) -> bool:
        """Return whether an agent of the visit, if delayed, may meet a closed place."""
        return any(self.closures[agent] for agent in visit.agents)

    def _denied(self, appointments: tuple[Appointment, ...], fixed: list[TimedLiterals]) -> bool:
        """Return true if appointments or conditions at fixed times exclude each other."""
        step, sure = self.mission.step, list(fixed)
        at = {each.visit.key: each.step for each in appointments}
        for each in appointments:
            base = 0 if each.visit.after is None else at[each.visit.after]
            new = [one.shifted(each.step * step) for one in each.visit.says]
            new += [
                TimedLiterals(one.literals, one.low + base * step, (each.step - 1) * step, one.gap)
                for one in each.visit.before
            ]
            if any(one.mutex_time(other) is not None for one in new for other in sure):
                return True
            if any(capacity.until(one, sure) is not None for one in new for capacity in self.capacities):
                return True
            sure += new
        return False

    def _latest(self, visit: Visit) -> int:
        """Last step from which the visit's duration fits into the mission."""
        return self.mission.steps - (visit.lasts if visit.lasts < self.mission.steps else 0)

    def _gathered(self, shapes: tuple[Predicate, ...], where: Array) -> Array:
        """Positions of agents, (agents, dim), metres, in their formations and graphs."""
        key = shapes, where.tobytes()
        if key not in self.shaped:
            self.shaped[key] = gather_team(shapes, where)
        return self.shaped[key].copy()
