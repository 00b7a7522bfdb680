"""Task scheduling (vehicle routing with time windows): when, which option and who goes where, by insertion and repair.

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
from copy import copy
from dataclasses import replace
from itertools import combinations

import numpy as np

from missionc.backends.clot.schedule.asked_shapes import formations, is_denied, shapes, tied_agents
from missionc.backends.clot.schedule.geodesics import Geodesics
from missionc.backends.clot.schedule.goal_sets import GoalSets
from missionc.backends.clot.schedule.mutex_literals import (
    TEAM,
    TimedLiterals,
    capacities,
    denials,
    mutex_seconds,
    timed_literals,
)
from missionc.backends.clot.schedule.places import Places
from missionc.backends.clot.schedule.presence import NOBODY, PresenceConstraints, attendance, implied
from missionc.backends.clot.schedule.tasks import Event, Hold, Option, Outline, Task
from missionc.backends.clot.schedule.timetable import (
    LATE,
    PerturbedDistances,
    Timetable,
    _deadline,
    _Draft,
    pause,
)
from missionc.backends.clot.schedule.visits import Appointment, Escort, Key, Schedule, Visit, schedule_of
from missionc.backends.clot.settings import clot_settings
from missionc.base.trace import Array
from missionc.ir import InitialSet, Mission, Predicate, Region
from missionc.ir.kernel.nodes import Node

VAST = 0.5
"""A place of more than this share of all there is is nowhere to go to: who is there may leave its nearest point."""

UNHURRIED = 0.5, 0.0, 1.0
"""Where between the soonest and the latest moment that the rest leaves it a visit is put: first, and in other
schedules, which draw among these."""


class Scheduler(Timetable):
    """Schedules of a mission. Distances are in metres, times in seconds.

    ``tied``: those whom a formation or links hold together at some time; everybody else goes a way of their own.

    Args:
        links: whether links tie; without, they are left to whoever makes motions of the schedule.
    """

    def __init__(
        self,
        mission: Mission,
        outline: Outline,
        geodesics: Geodesics,
        generator: np.random.Generator,
        *,
        links: bool = True,
    ) -> None:
        self.mission, self.outline, self.generator = mission, outline, generator
        self.places = Places(mission)
        self.shaped: dict[tuple[tuple[Predicate, ...], bytes], Array] = {}
        self.speed = np.array([agent.dynamics.top_speed for agent in mission.agents])
        self.pace = self.speed * clot_settings(mission).schedule.speed
        self.unhurried = UNHURRIED[0]
        self.stopping = np.array([pause(agent.dynamics) for agent in mission.agents])
        self.starts = np.array([self._place(agent.start) for agent in mission.agents])
        self.finishes = [None if agent.finish is None else self._place(agent.finish) for agent in mission.agents]
        self.always = [hold for hold in outline.holds if self._whole(hold)]
        self.company = attendance(mission, self.always)
        self.tied = tied_agents(outline, self.company, links=links)
        self.goals = GoalSets(mission, geodesics, self._kept(geodesics))
        self.numbers = [number for number, task in enumerate(outline.tasks) if self._scheduled(task)]
        settings = clot_settings(mission).schedule
        self.capacities = capacities(outline.holds, mission.step, settings.passing * mission.step)
        scheduled = replace(outline, tasks=tuple(outline.tasks[number] for number in self.numbers))
        self.formations = formations(outline)
        self.denied = denials(scheduled, self._seconds_apart)
        kept_or_not = {(TEAM, shape, holds) for shape in self.formations for holds in (True, False)}
        for literal in kept_or_not.union(*(each.literals for each in self.capacities)):
            self.denied.setdefault(literal, {})[literal] = 0.0
        self.standing = self._visits(-1, (), self._passing(outline.holds))
        self.draft = _Draft(list(self.standing))
        self.unstopped: _Draft | None = None
        self.between: tuple[Key | None, Key | None] = (None, None)
        self.waits = {}

    def with_stop(self, options: tuple[Option, ...], after: Key | None, before: Key | None) -> Scheduler:
        """The order that was made last with one more task of one visit, after and before these where they are given."""
        more, number = copy(self), len(self.outline.tasks)
        more.outline = replace(self.outline, tasks=(*self.outline.tasks, Task("stop", options)))
        more.numbers = [*self.numbers, number]
        more.unstopped, more.between = self.draft, (after, before)
        if before is not None:
            more.waits = {**self.waits, before: (*self.waits.get(before, ()), (number, 0))}
        return more

    def _seconds_apart(self, agent: int, one: Predicate, other: Predicate) -> float:
        """What an agent takes at least from where one predicate holds to where another does; 0 if unknown."""
        return self.goals.apart(agent, one, other) / float(self.pace[agent])

    def schedule(self, noise: float) -> Schedule:
        """A schedule; ``noise`` is by what share distances are misjudged on purpose, for another one than before."""
        perturbed = PerturbedDistances(noise, self.generator)
        self.unhurried = float(self.generator.choice(UNHURRIED)) if noise else UNHURRIED[0]
        settings = clot_settings(self.mission).schedule
        for share in (settings.speed, settings.late_speed):
            self.pace = self.speed * share
            made = self._made(perturbed)
            if made.late <= 0 or self.tied:
                break
        if noise and made.late > 0:  # perhaps only because ways were misjudged
            draft, again = self.draft, self._made(replace(perturbed, noise=0.0))
            made, self.draft = (again, self.draft) if again.late <= 0 else (made, draft)
        at = {each.visit.key: each.step for each in made.appointments}
        self.draft.order.sort(key=lambda visit: at[visit.key])
        return made

    def _made(self, perturbed: PerturbedDistances) -> Schedule:
        if self.unstopped is not None:
            self.draft = self.unstopped.without([])
            self._put(self.draft, self.numbers[-1], perturbed)
            return self._settled(self.draft, perturbed)
        tasks = self.outline.tasks
        first = sorted(self.numbers, key=lambda each: (len(tasks[each].options), _deadline(tasks[each].options)))
        draft = _Draft(sorted(self.standing, key=lambda visit: visit.event.low))
        for number in first:
            self._put(draft, number, perturbed)
        loose = [number for number in first if all(map(self._is_loose, draft.visits(number)))]
        self.draft = self._repaired(draft, loose, perturbed) if len(loose) > 1 else draft
        made = self._settled(self.draft, perturbed)
        if made.late > 0 and len(loose) > 1:
            self.draft = self._with_exchanges(self.draft, loose, perturbed)
            made = self._settled(self.draft, perturbed)
        return made

    # --------------------------------------------------------------- inserting

    def _put(
        self, draft: _Draft, number: int, perturbed: PerturbedDistances, options: Sequence[Option] | None = None
    ) -> None:
        """Adds a task to the order, with the option, of all or of these, and at the places that cost least."""
        noise = perturbed.noise
        cheapest: tuple[float, list[Visit], Option] | None = None
        for option in options or self.outline.tasks[number].options:
            visits = self._visits(number, option.events, self._passing(option.holds))
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
        begin, end = self._bounds(order, visit)
        for place in range(begin, end + 1):
            if (
                place == end
                or not mine.isdisjoint(order[place].agents)
                or (wary and (order[place].says or order[place].before))
            ):
                yield place

    def _bounds(self, order: list[Visit], visit: Visit) -> tuple[int, int]:
        """The first and the last place that an order has for a visit."""
        if visit.after is None and self.unstopped is None:
            return 0, len(order)
        place = {each.key: number for number, each in enumerate(order)}
        after, before = (visit.after, None) if self.unstopped is None else self.between
        begin = 0 if after is None else place[after] + 1
        return begin, len(order) if before is None else max(begin, place[before])

    def _visits(self, task: int, events: Iterable[Event], holds: Iterable[Hold]) -> tuple[Visit, ...]:
        """Events and those that come after them, each after the one it counts from; and what holds at fixed steps."""
        visits: list[Visit] = []
        stack: list[tuple[Event, Key | None]] = [(event, None) for event in reversed(tuple(events))]
        while stack:
            each, after = stack.pop()
            begun = *each.holds, *(hold for later in each.then for hold in later.before if hold.low == 0)
            regions = tuple(self._regions(begun).items())
            come = self._accompanied(attendance(self.mission, (*begun, *implied(each.holds, self.always))))
            asked = tuple(shapes(begun))
            lasts = min(max((hold.high for hold in each.holds), default=0), self.mission.steps)
            says, before = (
                timed_literals(holds, self.denied, self.mission.step) for holds in (each.holds, each.before)
            )
            key = task, len(visits)
            denied = frozenset(
                (TEAM, shape, False) for shape in self.formations if is_denied(shape, come, asked, self.goals)
            )
            if denied:
                says = (*says, TimedLiterals(denied, 0.0, lasts * self.mission.step))
            kept = tuple(shape for shape in shapes(each.before) if shape.formation is not None)
            visits.append(Visit(key, each, come, regions, asked, lasts, after, kept, says, before))
            stack.extend((later, key) for later in reversed(each.then))
        for hold in holds:
            come = attendance(self.mission, (hold,))
            event = Event(hold.node, hold.agent, hold.low, hold.low, hold.low, (hold,))
            lasts = 0 if come.moves_on else min(hold.high, self.mission.steps) - hold.low
            visits.append(Visit((task, len(visits)), event, come, (), (), lasts, fixed=True))
        return tuple(visits)

    def _repaired(self, draft: _Draft, numbers: list[int], perturbed: PerturbedDistances) -> _Draft:
        """These tasks taken out and put back in another order, as long as that is better and there is work left."""
        settings = clot_settings(self.mission).schedule
        best, work, vain = draft, 0, 0
        numbers = sorted(numbers)
        drawn = np.random.default_rng(len(numbers))
        while work < settings.work and vain < settings.vain * len(numbers):
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

    def _with_exchanges(self, draft: _Draft, numbers: list[int], perturbed: PerturbedDistances) -> _Draft:
        """Any two agents in each other's place, as long as that is better and there is work left."""
        best, work = draft, 0
        for pair in combinations(range(len(self.mission.agents)), 2):
            if work >= clot_settings(self.mission).schedule.work:
                break
            tried = self._exchanged(best, numbers, pair, perturbed)
            work += tried.work + 1
            if tried.cost < best.cost - 1e-9:
                best = tried
        return best

    def _exchanged(
        self, draft: _Draft, numbers: list[int], pair: tuple[int, int], perturbed: PerturbedDistances
    ) -> _Draft:
        """Two agents in each other's place in all tasks that one of them does alone and the other may."""
        whose = {number: set[int]().union(*(visit.agents for visit in draft.visits(number))) for number in numbers}
        out = [number for number in numbers if whose[number] in ({pair[0]}, {pair[1]})]
        tried = draft.without(out)
        for number in out:
            (other,) = set(pair) - whose[number]
            options = [option for option in self.outline.tasks[number].options if self._whose(option) == {other}]
            self._put(tried, number, replace(perturbed, noise=0.0), options or [draft.options[number]])
        return tried

    def _whose(self, option: Option) -> set[int]:
        """Who comes for the events of an option."""
        return set[int]().union(*(visit.agents for visit in self._visits(-1, option.events, ())))

    # ------------------------------------------------------------------ timing

    def _fixed(self, options: list[Option]) -> tuple[list[TimedLiterals], float]:
        """What holds at fixed times whatever the order is, and for how many seconds it denies itself."""
        holds = [*self.outline.holds, *(hold for option in options for hold in option.holds)]
        fixed = timed_literals(holds, self.denied, self.mission.step)
        amiss = sum(mutex_seconds(one, fixed[:number], self.mission.step) for number, one in enumerate(fixed))
        return list(fixed), amiss

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
        made = schedule_of(self.outline, appointments, options, run.late, self.mission.steps)
        return replace(made, company=self.company, escorts=tuple(self._escorts(options)))

    def _accompanied(self, come: PresenceConstraints) -> PresenceConstraints:
        """With those who stay near one who comes all the time, each of them near one other."""
        whose = {agent for agent, _ in come.goals}
        pairs = [pair for pair in self.company.meetings if len(pair.agents) == 2 and not whose.isdisjoint(pair.agents)]
        return replace(come, meetings=tuple(dict.fromkeys((*come.meetings, *pairs)))) if pairs else come

    def _escorts(self, options: Iterable[Option]) -> Iterator[Escort]:
        """Who stays near whom at fixed steps, and goes on meanwhile."""
        for hold in (*self.outline.holds, *(hold for option in options for hold in option.holds)):
            come = attendance(self.mission, (hold,)) if hold.timeless and not self._whole(hold) else NOBODY
            for meeting in come.meetings if come.moves_on else ():
                yield Escort(meeting, hold.low, min(hold.high, self.mission.steps))

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
            bound = sorted(some.goals, key=lambda each: (not kept[each[0]], each[0]))
            for agent, nodes in bound[: some.count]:
                kept[agent].extend(nodes)
        return kept

    def _whole(self, hold: Hold) -> bool:
        whole = 0.9  # share of the mission, from which a requirement bounds every path
        return hold.timeless and hold.low == 0 and hold.high >= whole * self.mission.steps

    def _passing(self, holds: Iterable[Hold]) -> Iterator[Hold]:
        """What holds at fixed steps, not all the time, and makes somebody go somewhere."""
        for hold in holds:
            if hold.timeless and not self._whole(hold):
                come = attendance(self.mission, (hold,))
                if not self.tied.isdisjoint(come.agents):
                    continue
                sets = [self.goals.of(agent, nodes) for agent, nodes in come.goals]
                if come.meetings or come.some or any(each is not None and each.share <= VAST for each in sets):
                    yield hold

    def _scheduled(self, task: Task) -> bool:
        """Whether it is decided here when its events are: not of a recurrence that leads nobody anywhere."""
        events = [event for option in task.options for event in option.all_events]
        if not any(event.again for event in events):
            return True
        come = [attendance(self.mission, event.holds) for event in events]
        goals = [goal for each in come for goal in (*each.goals, *(goal for some in each.some for goal in some.goals))]
        sets = [self.goals.of(agent, nodes) for agent, nodes in goals]
        loose = self.tied.isdisjoint(agent for each in come for agent in each.agents)
        return loose and bool(sets) and all(each is not None and each.share <= VAST for each in sets)

    def _place(self, place: InitialSet) -> Array:
        return np.array(place.point) if place.region is None else self.places.centre(place.region)

    def _regions(self, holds: tuple[Hold, ...]) -> dict[int, Region]:
        """Where holds want their agents, those that are about places."""
        regions: dict[int, Region] = {}
        for hold in holds:
            place = self.places.of(hold.node)
            if place is not None:
                before = regions.get(hold.agent)
                regions[hold.agent] = place if before is None else self.places.both(before, place)
        return regions
