"""Task scheduling (vehicle routing with time windows): times, disjuncts and agents, by insertion and repair.

Every task's options are tried at every position of the current order, and the option with the earliest arrivals is
selected. Then some tasks are removed and reinserted differently while this improves the order. Paths avoid static
obstacles (``goal_sets``). Without a goal region, agents move to the required formation or graph. Mutually exclusive
conditions wait for each other. Several schedules of a mission result from perturbed distances, and from delays of
events without a goal region.

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
from missionc.backends.clot.schedule.places import Places
from missionc.backends.clot.schedule.presence import NOBODY, PresenceConstraints, attendance, implied
from missionc.backends.clot.schedule.responses import with_responses
from missionc.backends.clot.schedule.tasks import (
    TEAM,
    Event,
    Hold,
    Option,
    Outline,
    Task,
    TimedLiterals,
    capacities,
    denials,
    mutex_seconds,
    timed_literals,
)
from missionc.backends.clot.schedule.timed_paths import TimedPaths
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
"""Size of a goal set, as a fraction of the world, above which the set gives no target: an agent may leave a point."""

UNHURRIED = 0.5, 0.0, 1.0
"""Time of a visit between its earliest (0) and latest (1) possible time: the first value in the first schedule, a
random value in others."""


class Scheduler(Timetable):
    """Scheduler of a mission's tasks. Distances are in metres, times in seconds.

    ``tied``: agents coupled by a formation or links at some time; all others move separately.

    Args:
        links: True if links couple agents; otherwise the trajectories must satisfy them by chance.
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
        self.outline = outline = with_responses(outline, self.goals)
        self.timed = TimedPaths(self.goals)
        fixed = [hold for hold in outline.holds if not self._whole(hold)]
        self.closures = [self.timed.closures(agent.index, fixed) for agent in mission.agents]
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
        """Scheduler with the last order and one more task of one visit, inserted between the given visits."""
        more, number = copy(self), len(self.outline.tasks)
        more.outline = replace(self.outline, tasks=(*self.outline.tasks, Task("stop", options)))
        more.numbers = [*self.numbers, number]
        more.unstopped, more.between = self.draft, (after, before)
        if before is not None:
            more.waits = {**self.waits, before: (*self.waits.get(before, ()), (number, 0))}
        return more

    def _seconds_apart(self, agent: int, one: Predicate, other: Predicate) -> float:
        """Least travel time of an agent between the goal sets of two predicates, seconds; 0 if unknown."""
        return self.goals.apart(agent, one, other) / float(self.pace[agent])

    def schedule(self, noise: float) -> Schedule:
        """Schedule of the mission; ``noise`` is the relative random perturbation of distances, for variety."""
        perturbed = PerturbedDistances(noise, self.generator)
        self.unhurried = float(self.generator.choice(UNHURRIED)) if noise else UNHURRIED[0]
        settings = clot_settings(self.mission).schedule
        for share in (settings.speed, settings.late_speed):
            self.pace = self.speed * share
            made = self._made(perturbed)
            if made.late <= 0 or self.tied:
                break
        if noise and made.late > 0:  # possibly only because of perturbed paths
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
        """Add a task to the order, with the option (of ``options``, or of all) and the positions of least cost."""
        noise = perturbed.noise
        cheapest: tuple[float, list[Visit], Option] | None = None
        for option in options or self.outline.tasks[number].options:
            visits = self._visits(number, option.events, self._passing(option.holds))
            fixed, amiss = self._fixed([*draft.options.values(), option])
            cost, order = self._inserted(draft, visits, perturbed, fixed)
            cost += LATE * amiss
            if noise:  # a late visit stays late
                cost += (cost % LATE) * float(np.expm1(0.3 * noise * self.generator.standard_normal()))
            if cheapest is None or cost < cheapest[0]:
                cheapest = cost, order, option
        if cheapest is not None:
            draft.cost, draft.order, draft.options[number] = cheapest

    def _inserted(
        self, draft: _Draft, visits: tuple[Visit, ...], perturbed: PerturbedDistances, fixed: list[TimedLiterals]
    ) -> tuple[float, list[Visit]]:
        """Cost and order of visits after these visits are inserted one by one, each at least cost."""
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
        """Yield the positions in an order that make a difference for a visit, after the visit from which its window
        counts."""
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
        """First and last allowed position of a visit in an order."""
        if visit.after is None and self.unstopped is None:
            return 0, len(order)
        place = {each.key: number for number, each in enumerate(order)}
        after, before = (visit.after, None) if self.unstopped is None else self.between
        begin = 0 if after is None else place[after] + 1
        return begin, len(order) if before is None else max(begin, place[before])

    def _visits(self, task: int, events: Iterable[Event], holds: Iterable[Hold]) -> tuple[Visit, ...]:
        """Visits for events and their successors, each after the visit from which its window counts; conditions at
        fixed steps are included."""
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
        """Order of visits after tasks were removed and reinserted in other orders, while this reduces the cost and work
        is left."""
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
        """Order of visits after exchanges of two agents, while this reduces the cost and work is left."""
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
        """Order of visits with two agents exchanged in all tasks that one of the two does alone and the other may
        do."""
        whose = {number: set[int]().union(*(visit.agents for visit in draft.visits(number))) for number in numbers}
        out = [number for number in numbers if whose[number] in ({pair[0]}, {pair[1]})]
        tried = draft.without(out)
        for number in out:
            (other,) = set(pair) - whose[number]
            options = [option for option in self.outline.tasks[number].options if self._whose(option) == {other}]
            self._put(tried, number, replace(perturbed, noise=0.0), options or [draft.options[number]])
        return tried

    def _whose(self, option: Option) -> set[int]:
        """Agents that take part in an option's events."""
        return set[int]().union(*(visit.agents for visit in self._visits(-1, option.events, ())))

    # ------------------------------------------------------------------ timing

    def _fixed(self, options: list[Option]) -> tuple[list[TimedLiterals], float]:
        """Conditions at fixed times, and the seconds for which they exclude each other."""
        holds = [*self.outline.holds, *(hold for option in options for hold in option.holds)]
        fixed = timed_literals(holds, self.denied, self.mission.step)
        amiss = sum(mutex_seconds(one, fixed[:number], self.mission.step) for number, one in enumerate(fixed))
        return list(fixed), amiss

    def _settled(self, draft: _Draft, perturbed: PerturbedDistances) -> Schedule:
        """Schedule with the steps of all visits, as late as windows and horizon allow in proportion."""
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
        """Presence constraints with the meetings of permanent companions added."""
        whose = {agent for agent, _ in come.goals}
        pairs = [pair for pair in self.company.meetings if len(pair.agents) == 2 and not whose.isdisjoint(pair.agents)]
        return replace(come, meetings=tuple(dict.fromkeys((*come.meetings, *pairs)))) if pairs else come

    def _escorts(self, options: Iterable[Option]) -> Iterator[Escort]:
        """Yield meetings at fixed steps whose agents continue to move meanwhile."""
        for hold in (*self.outline.holds, *(hold for option in options for hold in option.holds)):
            come = attendance(self.mission, (hold,)) if hold.timeless and not self._whole(hold) else NOBODY
            for meeting in come.meetings if come.moves_on else ():
                yield Escort(meeting, hold.low, min(hold.high, self.mission.steps))

    # ------------------------------------------------------------------ places

    def _kept(self, geodesics: Geodesics) -> list[list[Node]]:
        """Conditions on each agent's position that apply at all times."""
        kept: list[list[Node]] = [[] for _ in self.mission.agents]
        for agent, nodes in self.company.goals:
            kept[agent].extend(nodes)
        for some in sorted(self.company.some, key=lambda each: each.count):
            sets = GoalSets(self.mission, geodesics, kept)
            if any(goal is None or goal.share > VAST for goal in (sets.of(*each) for each in some.goals)):
                continue  # conditions satisfied nearly everywhere restrict no agent
            bound = sorted(some.goals, key=lambda each: (not kept[each[0]], each[0]))
            for agent, nodes in bound[: some.count]:
                kept[agent].extend(nodes)
        return kept

    def _whole(self, hold: Hold) -> bool:
        whole = 0.9  # share of the mission from which a requirement restricts every path
        return hold.timeless and hold.low == 0 and hold.high >= whole * self.mission.steps

    def _passing(self, holds: Iterable[Hold]) -> Iterator[Hold]:
        """Yield conditions at fixed steps, not all steps, that require an agent to move."""
        for hold in holds:
            if hold.timeless and not self._whole(hold):
                come = attendance(self.mission, (hold,))
                if not self.tied.isdisjoint(come.agents):
                    continue
                sets = [self.goals.of(agent, nodes) for agent, nodes in come.goals]
                if come.meetings or come.some or any(each is not None and each.share <= VAST for each in sets):
                    yield hold

    def _scheduled(self, task: Task) -> bool:
        """Return true if the scheduler decides the task's events; false for a recurrence without goal regions."""
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
        """Region of each agent in holds about positions."""
        regions: dict[int, Region] = {}
        for hold in holds:
            place = self.places.of(hold.node)
            if place is not None:
                before = regions.get(hold.agent)
                regions[hold.agent] = place if before is None else self.places.both(before, place)
        return regions
