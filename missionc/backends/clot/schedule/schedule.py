"""Task scheduling: the time of each event, the option of each task and who goes where, by insertion and repair.

Every task's options are tried at every place of the order found so far, and the one with which
all arrive soonest is kept; then some tasks are taken out again and put back in another way, as long as that is better.
Ways go round what stands (``goal_sets``). Where nobody is asked to be in a place, agents are under way to the
formation or graph that is asked for. What must not hold while something else does waits for
it. Several schedules come from the same mission by weighing
distances a little differently each time, and by putting off what has no place.

Source:
    Rosenkrantz, Stearns and Lewis, cheapest insertion, 1977; Shaw, large neighbourhoods, 1998; Dechter, Meiri and
    Pearl, simple temporal networks, 1991; here for visits and meetings of several agents with windows.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from math import ceil

import numpy as np

from missionc.backends.clot.optimise.active_set import Choices
from missionc.backends.clot.schedule.attendance import NOBODY, Attendance, attendance, implied
from missionc.backends.clot.schedule.gather_team import can_be_gathered, gather_team
from missionc.backends.clot.schedule.geodesics import Geodesics
from missionc.backends.clot.schedule.goal_sets import GoalSet, GoalSets
from missionc.backends.clot.schedule.mutex_literals import (
    TimedLiterals,
    earliest_time,
    mutex_literals,
    mutex_seconds,
    timed_literals,
)
from missionc.backends.clot.schedule.perturbed_distances import PerturbedDistances
from missionc.backends.clot.schedule.places import Places
from missionc.backends.clot.schedule.tasks import Decision, Event, Hold, Option, Outline, Task
from missionc.base.trace import Array
from missionc.ir import Anywhere, Exactly, Mission, Predicate, Region
from missionc.kernel.nodes import Atom, Node
from missionc.kernel.walk import graph_of, postorder

SHARES = 0.8, 0.95
"""The share of an agent's top speed that a sketch counts on, and that of one which would be late otherwise."""

ROUNDING = 1e-6
"""The share of a step that a time may be over a whole number of steps and count as that number."""

LATE = 1e3
"""What a second too late costs against a second on the way."""

WHOLE = 0.9
"""What holds from the first step on for this share of the mission is kept to by everybody who goes anywhere."""

VAST = 0.5
"""A place of more than this share of all there is is nowhere to go to: who is there may leave its nearest point."""

WORK, VAIN = 30_000, 6
"""Visits looked at while tasks are put in other ways, and tries in vain for each task, after which that ends."""

UNHURRIED = 0.5, 0.0, 1.0
"""Where between the soonest and the latest moment that the rest leaves it a visit is put: first, and in other
schedules, which draw among these."""

Key = tuple[int, int]
"""A visit: the number of its task, -1 for none, and its own within that."""


@dataclass(frozen=True, slots=True)
class Visit:
    """An event, the regions its agents are asked to be in, and which visit it comes after (``then``).

    ``shapes`` are the formations and graphs asked for. ``says`` is what
    else may deny, in seconds from the event; ``before`` likewise up to it, from the event around it.
    ``fixed``: it stands for what holds at fixed steps, and decides nothing.
    """

    key: Key
    event: Event
    come: Attendance
    regions: tuple[tuple[int, Region], ...]
    shapes: tuple[Predicate, ...]
    lasts: int
    after: Key | None = None
    says: tuple[TimedLiterals, ...] = ()
    before: tuple[TimedLiterals, ...] = ()
    fixed: bool = False

    @property
    def agents(self) -> set[int]:
        """Who has to get somewhere for it."""
        return self.come.agents | {agent for shape in self.shapes for agent in shape.others}


@dataclass(frozen=True, slots=True, eq=False)
class Place:
    """Where an agent goes, (dim,), metres.

    ``goal``: where else would do, where that is known. ``sure``: a way there is known.
    """

    agent: int
    point: Array
    goal: GoalSet | None = None
    sure: bool = True


@dataclass(frozen=True, slots=True, eq=False)
class Appointment:
    """A visit at a step of the mission; ``places``: where its agents go for it."""

    visit: Visit
    step: int
    places: tuple[Place, ...] = ()


@dataclass(frozen=True, slots=True)
class Schedule:
    """Everything decided: what holds at which steps of the mission, and the choices to tell the cost graph.

    ``late`` is by how many seconds it cannot be kept, by this estimate;
    ``company``: who has to be near whom all the time.
    """

    appointments: tuple[Appointment, ...]
    holds: tuple[Hold, ...]
    decisions: tuple[Decision, ...]
    choices: Choices
    late: float
    company: Attendance = NOBODY


@dataclass(slots=True)
class Run:
    """An order of visits as it comes out, each as soon as can be.

    ``legs``: for each visit who comes for it: from which visit (by its number, -1 for the start), in how many seconds,
    and in how many at the least, at top speed.
    """

    cost: float = 0.0
    late: float = 0.0
    end: float = 0.0
    times: list[float] = field(default_factory=list)
    legs: list[list[tuple[int, float, float]]] = field(default_factory=list)
    last: list[tuple[int, float]] = field(default_factory=list)
    places: list[tuple[Place, ...]] = field(default_factory=list)


class Scheduler:
    """Schedules of a mission. Distances are in metres, times in seconds.

    ``tied``: a formation or links hold some of the team together, so that not everybody goes a way of their own.
    """

    def __init__(
        self, mission: Mission, outline: Outline, geodesics: Geodesics, generator: np.random.Generator
    ) -> None:
        self.mission, self.outline, self.generator = mission, outline, generator
        self.places = Places(mission)
        self.shaped: dict[tuple[tuple[Predicate, ...], bytes], Array] = {}
        self.tied = _tied(outline)
        self.speed = np.array([agent.dynamics.top_speed for agent in mission.agents])
        self.pace = self.speed * SHARES[0]
        self.unhurried = UNHURRIED[0]
        self.stopping = np.array(
            [agent.dynamics.top_speed / agent.dynamics.top_acceleration for agent in mission.agents]
        )
        self.starts = np.array([self._place(agent.start) for agent in mission.agents])
        self.finishes = [None if agent.finish is None else self._place(agent.finish) for agent in mission.agents]
        self.always = [hold for hold in outline.holds if self._whole(hold)]
        self.company = attendance(mission, self.always)
        self.goals = GoalSets(mission, geodesics, self._kept(geodesics))
        self.numbers = [number for number, task in enumerate(outline.tasks) if self._scheduled(task)]
        self.mutex = mutex_literals(replace(outline, tasks=tuple(outline.tasks[number] for number in self.numbers)))
        self.standing = () if self.tied else self._visits(-1, (), self._passing(outline.holds))

    def schedule(self, noise: float) -> Schedule:
        """A schedule; ``noise`` is by what share distances are misjudged on purpose, for another one than before."""
        perturbed = PerturbedDistances(noise, self.generator)
        self.unhurried = float(self.generator.choice(UNHURRIED)) if noise else UNHURRIED[0]
        for share in SHARES:
            self.pace = self.speed * share
            made = self._made(perturbed)
            if made.late <= 0 or self.tied:
                break
        return made

    def _made(self, perturbed: PerturbedDistances) -> Schedule:
        tasks = self.outline.tasks
        first = sorted(self.numbers, key=lambda each: (len(tasks[each].options), _deadline(tasks[each].options)))
        draft = _Draft(sorted(self.standing, key=lambda visit: visit.event.low))
        for number in first:
            self._put(draft, number, perturbed)
        if not self.tied and len(first) > 1:
            draft = self._repaired(draft, perturbed)
        return self._settled(draft, perturbed)

    # --------------------------------------------------------------- inserting

    def _put(self, draft: _Draft, number: int, perturbed: PerturbedDistances) -> None:
        """Adds a task to the order, with the option and at the places that cost least."""
        noise = perturbed.noise
        cheapest: tuple[float, list[Visit], Option] | None = None
        for option in self.outline.tasks[number].options:
            visits = self._visits(number, option.events, () if self.tied else self._passing(option.holds))
            fixed, amiss = self._fixed([*draft.options.values(), option])
            cost, order = self._inserted(draft, visits, perturbed, fixed)
            cost += LATE * amiss
            if noise:  # what is late stays late
                cost += (cost % LATE) * float(np.expm1(0.3 * noise * self.generator.standard_normal()))
            if cheapest is None or cost < cheapest[0]:
                cheapest = cost, order, option
        if cheapest is not None:
            draft.cost, draft.order, draft.options[number] = cheapest

    def _inserted(
        self, draft: _Draft, visits: tuple[Visit, ...], perturbed: PerturbedDistances, fixed: list[TimedLiterals]
    ) -> tuple[float, list[Visit]]:
        """The cheapest order with these visits, put one after the other each where it makes least of a difference."""
        order, cost = draft.order, draft.cost
        if not visits:
            return self._run(order, perturbed, fixed).cost, order
        for visit in visits:
            best: tuple[float, list[Visit]] | None = None
            for place in self._places(order, visit):
                tried = [*order[:place], visit, *order[place:]]
                draft.work += len(tried)
                each = self._run(tried, perturbed, fixed).cost
                if best is None or each < best[0]:
                    best = each, tried
            assert best is not None
            cost, order = best
        return cost, order

    def _places(self, order: list[Visit], visit: Visit) -> Iterator[int]:
        """Where in an order a visit makes a difference, after the one that it counts from."""
        mine, wary = visit.agents, bool(visit.says or visit.before)
        begin = 0
        if visit.after is not None:
            begin = 1 + next(number for number, each in enumerate(order) if each.key == visit.after)
        for place in range(begin, len(order) + 1):
            if (
                place == len(order)
                or not mine.isdisjoint(order[place].agents)
                or (wary and (order[place].says or order[place].before))
            ):
                yield place

    def _visits(self, task: int, events: Iterable[Event], holds: Iterable[Hold]) -> tuple[Visit, ...]:
        """Events and those that come after them, each after the one it counts from; and what holds at fixed steps."""
        visits: list[Visit] = []
        stack: list[tuple[Event, Key | None]] = [(event, None) for event in reversed(tuple(events))]
        while stack:
            each, after = stack.pop()
            regions = tuple(self._regions(each.holds).items())
            come = attendance(self.mission, (*each.holds, *implied(each.holds, self.always)))
            until = (hold for later in each.then for hold in later.before if hold.low == 0)
            shapes = tuple(_shapes((*each.holds, *until)))
            lasts = min(max((hold.high for hold in each.holds), default=0), self.mission.steps)
            says, before = (timed_literals(holds, self.mutex, self.mission.step) for holds in (each.holds, each.before))
            key = task, len(visits)
            visits.append(Visit(key, each, come, regions, shapes, lasts, after, says, before))
            stack.extend((later, key) for later in reversed(each.then))
        for hold in holds:
            come = attendance(self.mission, (hold,))
            event = Event(hold.node, hold.agent, hold.low, hold.low, hold.low, (hold,))
            visits.append(
                Visit(
                    (task, len(visits)), event, come, (), (), min(hold.high, self.mission.steps) - hold.low, fixed=True
                )
            )
        return tuple(visits)

    def _repaired(self, draft: _Draft, perturbed: PerturbedDistances) -> _Draft:
        """Tasks taken out and put back in another order, as long as that is better and there is work left."""
        best, work, vain = draft, 0, 0
        numbers = sorted(draft.options)
        drawn = np.random.default_rng(len(numbers))
        while work < WORK and vain < VAIN * len(numbers):
            count = min(len(numbers), 1 + int(drawn.integers(0, 3)))
            out = [int(each) for each in drawn.permutation(numbers)[:count]]
            tried = best.without(out)
            for number in out:
                self._put(tried, number, replace(perturbed, noise=0.0))
            work += tried.work + 1
            vain += 1
            if tried.cost < best.cost - 1e-9:
                best, vain = tried, 0
        return best

    # ------------------------------------------------------------------ timing

    def _fixed(self, options: list[Option]) -> tuple[list[TimedLiterals], float]:
        """What holds at fixed times whatever the order is, and for how many seconds it denies itself."""
        holds = [*self.outline.holds, *(hold for option in options for hold in option.holds)]
        fixed = timed_literals(holds, self.mutex, self.mission.step)
        amiss = sum(mutex_seconds(one, fixed[:number], self.mission.step) for number, one in enumerate(fixed))
        return list(fixed), amiss

    def _run(self, visits: list[Visit], perturbed: PerturbedDistances, fixed: list[TimedLiterals]) -> Run:
        """Each visit of an order as soon as can be."""
        step = self.mission.step
        where, free = self.starts.copy(), np.zeros(len(self.starts))
        since = [-1] * len(self.starts)
        number_of: dict[Key, int] = {}
        sure, way, run = list(fixed), 0.0, Run()
        for number, visit in enumerate(visits):
            low, high = visit.event.low * step, visit.event.high * step
            base = 0.0
            if visit.after is not None:
                base = run.times[number_of[visit.after]]
                low, high = low + base, high + base
            begin, moved = max(low, visit.event.not_before * step), np.zeros(0, dtype=np.int64)
            places: list[Place] = []
            legs: list[tuple[int, float, float]] = []
            for place, length in self._ways(visit.come, where, free, begin, visits[number + 1 :]):
                agent = place.agent
                stretch = perturbed.factor(visit.event) if visit.come.goals else 1.0
                seconds = self._travel(agent, length) * stretch
                begin = max(begin, free[agent] + seconds)
                if not place.sure:
                    run.late += self.mission.horizon
                stays = 0.0 if since[agent] < 0 else free[agent] - run.times[since[agent]]
                legs.append((since[agent], stays + seconds, stays + length / self.speed[agent]))
                way += length
                places.append(place)
            if visit.shapes:
                gaps = np.linalg.norm(self._gathered(visit.shapes, where) - where, axis=1)
                moved = np.flatnonzero(gaps)
                begin = max(begin, float((free + gaps / self.pace)[moved].max(initial=0.0)))
                way += float(gaps.sum())
                beside = where.copy()
                for place in places:
                    beside[place.agent] = place.point
                where = self._gathered(visit.shapes, beside)
            if not visit.come.goals and not visit.fixed:
                latest = min(high, self._latest(visit) * step)
                begin += perturbed.put_off(visit.event) * max(0.0, latest - begin)
            begin = earliest_time(visit.says, begin, sure, step)
            for each in visit.before:
                barred = TimedLiterals(each.literals, each.low + base, begin - step)
                run.late += mutex_seconds(barred, sure, step)
                sure.append(barred)
            sure.extend(each.shifted(begin) for each in visit.says)
            run.late += max(0.0, begin - high)
            free[moved] = begin  # whoever is in shape may go on, all of them together
            for place in places:
                agent = place.agent
                stays = begin + visit.lasts * step if visit.lasts < self.mission.steps else self.mission.horizon
                free[agent], since[agent] = max(begin, stays), number
                if not visit.shapes:
                    where[agent] = place.point
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

    def _ways(
        self, come: Attendance, where: Array, free: Array, begin: float, later: Sequence[Visit]
    ) -> Iterator[tuple[Place, float]]:
        """Who goes where for it, and how far that is: metres.

        Args:
            begin: the first moment at which it may be, seconds.
            later: what comes after it.
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
        """Where an agent goes next, if the next that asks for it is a place of its own."""
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
        """So many of these goals, those that are reached soonest by agents who have no other."""
        soonest: list[tuple[bool, float, int, tuple[Node, ...]]] = []
        for agent, nodes in goals:
            goal = self.goals.of(agent, nodes)
            if goal is not None and agent not in taken:
                _, length, sure = self.goals.way(goal, agent, where[agent])
                soonest.append((not sure, free[agent] + self._travel(agent, length), agent, nodes))
        chosen = sorted(soonest, key=lambda each: each[:3])[:count]
        return {agent: nodes for *_, agent, nodes in chosen}

    def _travel(self, agent: int, length: float) -> float:
        """Seconds from rest to rest."""
        seconds = length / float(self.pace[agent])
        return seconds + min(float(self.stopping[agent]), seconds)

    def _settled(self, draft: _Draft, perturbed: PerturbedDistances) -> Schedule:
        """Steps for all visits: everything as unhurried as windows and horizon let it be."""
        step, visits, options = self.mission.step, draft.order, list(draft.options.values())
        fixed, _ = self._fixed(options)
        run = self._run(visits, replace(perturbed, noise=0.0), fixed)
        room = [self.mission.horizon / run.end] if run.end > 0 else [1.0]
        for visit, time in zip(visits, run.times, strict=True):
            if visit.after is None and time > visit.event.low * step:
                room.append(visit.event.high * step / time)
        appointments: tuple[Appointment, ...] = ()
        for slower in (max(1.0, min(room)), 1.0):
            appointments = self._at_steps(visits, run, slower)
            if not self._denied(appointments, fixed):
                break
        made = _schedule(self.outline, appointments, options, run.late, self.mission.steps)
        return replace(made, company=self.company)

    def _at_steps(self, visits: list[Visit], run: Run, slower: float) -> tuple[Appointment, ...]:
        """Visits at their soonest times, made so many times later; where nothing is tied, halfway to the latest."""
        step = self.mission.step
        times = run.times
        if not self.tied and slower > 1:
            times, slower = self._unhurried(visits, run), 1.0
        appointments: list[Appointment] = []
        at: dict[Key, int] = {}
        for visit, first, time, places, legs in zip(visits, run.times, times, run.places, run.legs, strict=True):
            base = 0 if visit.after is None else at[visit.after]
            latest = min(base + visit.event.high, self._latest(visit))
            begins = visit.event.low * step
            if visit.after is not None:
                begins += next(each for one, each in zip(visits, run.times, strict=True) if one.key == visit.after)
            if not self.tied or visit.come.goals or (first > begins and not visit.come.meetings):
                wanted = round(time * slower / step) if slower > 1 else ceil(time / step - ROUNDING)
            else:  # nobody has to get to a place for it, and what comes after may need the time
                wanted = max([round(time / step), *(each.step for each in appointments)])
            soonest = max(base + visit.event.low, visit.event.not_before)
            for begin, _, least in legs:
                since = 0 if begin < 0 else appointments[begin].step
                wanted = max(wanted, since + ceil(least / step - ROUNDING))
            at[visit.key] = max(soonest, min(wanted, latest))
            appointments.append(Appointment(visit, at[visit.key], places))
        return tuple(appointments)

    def _unhurried(self, visits: list[Visit], run: Run) -> list[float]:
        """Times of visits between the soonest and the latest that windows, ways and the horizon allow, seconds.

        Any mean of two solutions of a simple temporal network is one.
        """
        step, index = self.mission.step, {visit.key: number for number, visit in enumerate(visits)}
        latest = [self._latest(visit) * step for visit in visits]
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
                for begin, seconds, _ in run.legs[number]:
                    if begin >= 0:
                        latest[begin] = min(latest[begin], latest[number] - seconds)
            if latest == before:
                break
        return [soon + self.unhurried * max(0.0, late - soon) for soon, late in zip(run.times, latest, strict=True)]

    def _denied(self, appointments: tuple[Appointment, ...], fixed: list[TimedLiterals]) -> bool:
        """Whether something that appointments or fixed times say is denied by another of them."""
        step, sure = self.mission.step, list(fixed)
        at = {each.visit.key: each.step for each in appointments}
        for each in appointments:
            base = 0 if each.visit.after is None else at[each.visit.after]
            new = [one.shifted(each.step * step) for one in each.visit.says]
            new += [
                TimedLiterals(one.literals, one.low + base * step, (each.step - 1) * step) for one in each.visit.before
            ]
            if any(one.mutex_time(other) is not None for one in new for other in sure):
                return True
            sure += new
        return False

    def _latest(self, visit: Visit) -> int:
        """The last step from which it can last as long as it has to."""
        return self.mission.steps - (visit.lasts if visit.lasts < self.mission.steps else 0)

    # ------------------------------------------------------------------ places

    def _kept(self, geodesics: Geodesics) -> list[list[Node]]:
        """For each agent what its place has to make true all the time."""
        kept: list[list[Node]] = [[] for _ in self.mission.agents]
        for agent, nodes in self.company.goals:
            kept[agent].extend(nodes)
        for some in sorted(self.company.some, key=lambda each: each.count):
            sets = GoalSets(self.mission, geodesics, kept)
            if any(goal is None or goal.share > VAST for goal in (sets.of(*each) for each in some.goals)):
                continue  # so many may be nearly anywhere: that binds nobody
            sets = GoalSets(self.mission, geodesics, kept)
            if any(goal is None or goal.share > VAST for goal in (sets.of(*each) for each in some.goals)):
                continue  # so many may be nearly anywhere: that binds nobody
            bound = sorted(some.goals, key=lambda each: (not kept[each[0]], each[0]))
            for agent, nodes in bound[: some.count]:
                kept[agent].extend(nodes)
        return kept

    def _whole(self, hold: Hold) -> bool:
        return hold.timeless and hold.low == 0 and hold.high >= WHOLE * self.mission.steps

    def _passing(self, holds: Iterable[Hold]) -> Iterator[Hold]:
        """What holds at fixed steps, not all the time, and makes somebody go somewhere."""
        for hold in holds:
            if hold.timeless and not self._whole(hold):
                come = attendance(self.mission, (hold,))
                sets = [self.goals.of(agent, nodes) for agent, nodes in come.goals]
                if come.meetings or come.some or any(each is not None and each.share <= VAST for each in sets):
                    yield hold

    def _scheduled(self, task: Task) -> bool:
        """Whether it is decided here when its events are: not of a recurrence that leads nobody anywhere."""
        events = [event for option in task.options for event in option.events]
        if not any(event.again for event in events):
            return True
        come = [attendance(self.mission, event.holds) for event in events]
        sets = [self.goals.of(agent, nodes) for each in come for agent, nodes in each.goals]
        return not self.tied and bool(sets) and all(each is not None and each.share <= VAST for each in sets)

    def _gathered(self, shapes: tuple[Predicate, ...], where: Array) -> Array:
        """Where agents, (agents, dim), go to be in shape."""
        key = shapes, where.tobytes()
        if key not in self.shaped:
            self.shaped[key] = gather_team(shapes, where)
        return self.shaped[key].copy()

    def _place(self, place: Exactly | Anywhere) -> Array:
        return np.array(place.point) if isinstance(place, Exactly) else self.places.centre(place.region)

    def _regions(self, holds: tuple[Hold, ...]) -> dict[int, Region]:
        """Where holds want their agents, those that are about places."""
        regions: dict[int, Region] = {}
        for hold in holds:
            place = self.places.of(hold.node)
            if place is not None:
                before = regions.get(hold.agent)
                regions[hold.agent] = place if before is None else self.places.both(before, place)
        return regions


@dataclass(slots=True)
class _Draft:
    """An order of visits and the option of each task in it; ``work``: visits looked at for it."""

    order: list[Visit]
    options: dict[int, Option] = field(default_factory=dict)
    cost: float = 0.0
    work: int = 0

    def without(self, tasks: list[int]) -> _Draft:
        left = [visit for visit in self.order if visit.key[0] not in tasks]
        return _Draft(left, {task: option for task, option in self.options.items() if task not in tasks}, self.cost)


def _tied(outline: Outline) -> bool:
    """Whether a formation or links are asked for, at any time."""
    holds = list(outline.holds)
    events = [event for task in outline.tasks for option in task.options for event in option.events]
    holds.extend(hold for task in outline.tasks for option in task.options for hold in option.holds)
    while events:
        event = events.pop()
        holds.extend((*event.holds, *event.before))
        events.extend(event.then)
    return any(
        graph_of(node) is not None or (isinstance(node, Atom) and _of_team(node.predicate))
        for node in postorder({hold.node for hold in holds})
    )


def _of_team(predicate: Predicate) -> bool:
    return predicate.formation is not None or predicate.graph is not None


def _deadline(options: tuple[Option, ...]) -> int:
    return min((event.high for option in options for event in option.events), default=0)


def _shapes(holds: tuple[Hold, ...]) -> Iterator[Predicate]:
    """The formations and graphs that holds ask for, each once."""
    seen: set[Predicate] = set()
    for hold in holds:
        node = hold.node
        if isinstance(node, Atom) and can_be_gathered(node.predicate) and node.predicate not in seen:
            seen.add(node.predicate)
            yield node.predicate


def _schedule(
    outline: Outline, appointments: tuple[Appointment, ...], options: list[Option], late: float, steps: int
) -> Schedule:
    """Holds and decisions counted from step 0, and all choices by formula, agent and step."""
    holds = [*outline.holds, *(hold for option in options for hold in option.holds)]
    decisions = [decision for option in options for decision in option.decisions]
    choices: dict[tuple[Node, int, int], int] = {}
    step_of = {each.visit.key: each.step for each in appointments}
    for appointment in appointments:
        if appointment.visit.fixed or appointment.visit.event.again:
            continue
        event, at = appointment.visit.event, appointment.step
        holds.extend(
            Hold(hold.agent, hold.node, hold.low + at, min(hold.high + at, steps), hold.timeless)
            for hold in event.holds
        )
        base = 0 if appointment.visit.after is None else step_of[appointment.visit.after]
        holds.extend(
            Hold(hold.agent, hold.node, base + hold.low, at - 1, hold.timeless)
            for hold in event.before
            if at > base + hold.low
        )
        decisions.extend(
            Decision(each.node, each.agent, each.part, each.low + at, min(each.high + at, steps))
            for each in event.decisions
        )
        choices[event.chooser, event.agent, event.step + base] = at
    for each in decisions:
        for step in range(each.low, each.high + 1):
            choices[each.node, each.agent, step] = each.part
    return Schedule(appointments, tuple(holds), tuple(decisions), choices, late)
