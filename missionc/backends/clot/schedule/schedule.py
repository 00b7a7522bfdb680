"""Task scheduling by cheapest insertion: the time of each event and the option of each task, ways as the crow flies.

Every task's options are tried at every place of the order found so far, and the one with which
all arrive soonest is kept. Where nobody is asked to be in a place, agents are under way to the
formation or graph that is asked for. What must not hold while something else does waits for
it. Several schedules come from the same mission by weighing
distances a little differently each time, and by putting off what has no place.

Source:
    Rosenkrantz, Stearns and Lewis, cheapest insertion, 1977; here for visits of several agents with windows.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from math import ceil

import numpy as np

from missionc.backends.clot.optimise.active_set import Choices
from missionc.backends.clot.schedule.gather_team import can_be_gathered, gather_team
from missionc.backends.clot.schedule.mutex_literals import (
    TimedLiterals,
    earliest_time,
    mutex_literals,
    mutex_seconds,
    timed_literals,
)
from missionc.backends.clot.schedule.perturbed_distances import PerturbedDistances
from missionc.backends.clot.schedule.places import Places
from missionc.backends.clot.schedule.tasks import Decision, Event, Hold, Option, Outline
from missionc.base.trace import Array
from missionc.ir import Anywhere, Exactly, Mission, Predicate, Region
from missionc.kernel.nodes import Atom, Node
from missionc.world.signed_distance import signed_distance

SHARE = 0.8
"""The share of an agent's top speed that a sketch counts on."""

ROUNDING = 1e-6
"""The share of a step that a time may be over a whole number of steps and count as that number."""

LATE = 1e3
"""What a second too late costs against a second on the way."""


@dataclass(frozen=True, slots=True)
class Visit:
    """An event, the regions its agents are asked to be in, and which visit it comes after (``then``).

    ``shapes`` are the formations and graphs asked for. ``says`` is what
    else may deny, in seconds from the event; ``before`` likewise up to it, from the event around it.
    """

    event: Event
    regions: tuple[tuple[int, Region], ...]
    shapes: tuple[Predicate, ...]
    lasts: int
    after: int | None
    says: tuple[TimedLiterals, ...] = ()
    before: tuple[TimedLiterals, ...] = ()

    @property
    def agents(self) -> set[int]:
        """Who has to get somewhere for it."""
        return {agent for agent, _ in self.regions} | {agent for shape in self.shapes for agent in shape.others}


@dataclass(frozen=True, slots=True)
class Appointment:
    """A visit at a step of the mission."""

    visit: Visit
    step: int


@dataclass(frozen=True, slots=True)
class Schedule:
    """Everything decided: what holds at which steps of the mission, and the choices to tell the cost graph.

    ``late`` is by how many seconds it cannot be kept, by this estimate.
    """

    appointments: tuple[Appointment, ...]
    holds: tuple[Hold, ...]
    decisions: tuple[Decision, ...]
    choices: Choices
    late: float


class Scheduler:
    """Schedules of a mission. Distances are in metres, times in seconds."""

    def __init__(self, mission: Mission, outline: Outline, generator: np.random.Generator) -> None:
        self.mission, self.outline, self.generator = mission, outline, generator
        self.places = Places(mission)
        self.mutex = mutex_literals(outline)
        self.shaped: dict[tuple[tuple[Predicate, ...], bytes], Array] = {}
        self.speed = np.array([agent.dynamics.top_speed for agent in mission.agents]) * SHARE
        self.starts = np.array([self._place(agent.start) for agent in mission.agents])
        self.finishes = [None if agent.finish is None else self._place(agent.finish) for agent in mission.agents]

    def schedule(self, noise: float) -> Schedule:
        """A schedule; ``noise`` is by what share distances are misjudged on purpose, for another one than before."""
        order: list[Visit] = []
        options: list[Option] = []
        perturbed = PerturbedDistances(noise, self.generator)
        tasks = sorted(self.outline.tasks, key=lambda task: (len(task.options), _deadline(task.options)))
        for task in tasks:
            cheapest: tuple[float, list[Visit], Option] | None = None
            for option in task.options:
                fixed, amiss = self._fixed([*options, option])
                for visits in self._inserted(order, option):
                    cost = self._run(visits, perturbed, fixed)[0] + LATE * amiss
                    if noise:
                        cost *= float(np.exp(0.3 * noise * self.generator.standard_normal()))
                    if cheapest is None or cost < cheapest[0]:
                        cheapest = cost, visits, option
            if cheapest is not None:
                order = cheapest[1]
                options.append(cheapest[2])
        return self._settled(order, options, perturbed)

    # --------------------------------------------------------------- inserting

    def _inserted(self, visits: list[Visit], option: Option) -> Iterator[list[Visit]]:
        """The order with the option's events at every place where it makes a difference."""
        chains = [self._chain(event) for event in option.events]
        flat = [visit for chain in chains for visit in chain]
        if not flat:
            yield visits
            return
        mine = {agent for visit in flat for agent in visit.agents}
        wary = any(visit.says or visit.before for visit in flat)
        places = [
            place
            for place in range(len(visits) + 1)
            if place == len(visits)
            or not mine.isdisjoint(visits[place].agents)
            or (wary and (visits[place].says or visits[place].before))
        ]
        for place in places:
            moved = [self._renumbered(visit, place, len(flat)) for visit in visits]
            new = [
                visit if visit.after is None else replace(visit, after=visit.after + place)
                for visit in self._based(chains)
            ]
            yield [*moved[:place], *new, *moved[place:]]

    def _chain(self, event: Event) -> list[Visit]:
        """An event and those that come after it, each with the number in this list of the one it counts from."""
        chain: list[Visit] = []
        stack: list[tuple[Event, int | None]] = [(event, None)]
        while stack:
            each, after = stack.pop()
            regions = tuple(self._regions(each.holds).items())
            before = (hold for later in each.then for hold in later.before if hold.low == 0)
            lasts = max((hold.high for hold in each.holds), default=0)
            shapes = tuple(_shapes((*each.holds, *before)))
            says, barred = (timed_literals(holds, self.mutex, self.mission.step) for holds in (each.holds, each.before))
            chain.append(Visit(each, regions, shapes, min(lasts, self.mission.steps), after, says, barred))
            stack.extend((later, len(chain) - 1) for later in reversed(each.then))
        return chain

    def _based(self, chains: list[list[Visit]]) -> list[Visit]:
        visits: list[Visit] = []
        for chain in chains:
            base = len(visits)
            visits.extend(visit if visit.after is None else replace(visit, after=visit.after + base) for visit in chain)
        return visits

    def _renumbered(self, visit: Visit, place: int, count: int) -> Visit:
        if visit.after is None or visit.after < place:
            return visit
        return replace(visit, after=visit.after + count)

    # ------------------------------------------------------------------ timing

    def _fixed(self, options: list[Option]) -> tuple[list[TimedLiterals], float]:
        """What holds at fixed times whatever the order is, and for how many seconds it denies itself."""
        holds = [*self.outline.holds, *(hold for option in options for hold in option.holds)]
        fixed = timed_literals(holds, self.mutex, self.mission.step)
        amiss = sum(mutex_seconds(one, fixed[:number], self.mission.step) for number, one in enumerate(fixed))
        return list(fixed), amiss

    def _run(
        self, visits: list[Visit], perturbed: PerturbedDistances, fixed: list[TimedLiterals]
    ) -> tuple[float, list[float], float, float]:
        """Cost of an order, the soonest time of each visit, how much too late all that is, and when all is done."""
        step = self.mission.step
        where, free = self.starts.copy(), np.zeros(len(self.starts))
        times: list[float] = []
        late = way = 0.0
        sure = list(fixed)
        for visit in visits:
            low, high = visit.event.low * step, visit.event.high * step
            if visit.after is not None:
                low, high = low + times[visit.after], high + times[visit.after]
            begin, moved = low, np.zeros(0, dtype=np.int64)
            before = where.copy()
            for agent, region in visit.regions:
                target = self.places.centre(region)
                gap = max(
                    0.0, float(signed_distance(np, region.shape, where[agent])) + self.mission.agents[agent].radius
                )
                far = float(np.linalg.norm(target - where[agent]))
                if far > 0:
                    where[agent] += (target - where[agent]) * min(1.0, (gap + 0.1) / far)
                way += gap
                begin = max(begin, free[agent] + gap * perturbed.factor(region) / self.speed[agent])
            if visit.shapes:
                gaps = np.linalg.norm(self._gathered(visit.shapes, before) - before, axis=1)
                moved = np.flatnonzero(gaps)
                begin = max(begin, float((free + gaps / self.speed)[moved].max(initial=0.0)))
                way += float(gaps.sum())
                where = self._gathered(visit.shapes, where)
            if not visit.regions:
                latest = min(high, self._latest(visit) * step)
                begin += perturbed.put_off(visit.event) * max(0.0, latest - begin)
            begin = earliest_time(visit.says, begin, sure, step)
            base = 0.0 if visit.after is None else times[visit.after]
            for each in visit.before:
                barred = TimedLiterals(each.literals, each.low + base, begin - step)
                late += mutex_seconds(barred, sure, step)
                sure.append(barred)
            sure.extend(each.shifted(begin) for each in visit.says)
            late += max(0.0, begin - high)
            free[moved] = begin  # whoever is in shape may go on, all of them together
            for agent, _ in visit.regions:
                free[agent] = begin + visit.lasts * step
            times.append(begin)
        for agent, finish in enumerate(self.finishes):
            if finish is not None:
                gap = float(np.linalg.norm(finish - where[agent]))
                way += gap
                free[agent] += gap / self.speed[agent]
        end = float(free.max(initial=0.0))
        late += max(0.0, end - self.mission.horizon)
        return LATE * late + end + 0.1 * way / float(self.speed.mean()), times, late, end

    def _settled(self, visits: list[Visit], options: list[Option], perturbed: PerturbedDistances) -> Schedule:
        """Steps for all visits: everything as unhurried as windows and horizon let it be."""
        step = self.mission.step
        fixed, _ = self._fixed(options)
        _, soonest, late, end = self._run(visits, replace(perturbed, noise=0.0), fixed)
        room = [self.mission.horizon / end] if end > 0 else [1.0]
        for visit, time in zip(visits, soonest, strict=True):
            if visit.after is None and time > visit.event.low * step:
                room.append(visit.event.high * step / time)
        appointments: tuple[Appointment, ...] = ()
        for slower in (max(1.0, min(room)), 1.0):
            appointments = self._at_steps(visits, soonest, slower)
            if not self._denied(appointments, fixed):
                break
        return _schedule(self.outline, appointments, options, late, self.mission.steps)

    def _at_steps(self, visits: list[Visit], soonest: list[float], slower: float) -> tuple[Appointment, ...]:
        """Visits at their soonest times, in seconds, made so many times later."""
        step = self.mission.step
        appointments: list[Appointment] = []
        for visit, time in zip(visits, soonest, strict=True):
            base = 0 if visit.after is None else appointments[visit.after].step
            latest = min(base + visit.event.high, self._latest(visit))
            begins = visit.event.low * step + (0.0 if visit.after is None else soonest[visit.after])
            if visit.regions or time > begins:
                wanted = round(time * slower / step) if slower > 1 else ceil(time / step - ROUNDING)
            else:  # nobody has to get anywhere for it, and what comes after may need the time
                wanted = max([round(time / step), *(each.step for each in appointments)])
            appointments.append(Appointment(visit, max(base + visit.event.low, min(wanted, latest))))
        return tuple(appointments)

    def _denied(self, appointments: tuple[Appointment, ...], fixed: list[TimedLiterals]) -> bool:
        """Whether something that appointments or fixed times say is denied by another of them."""
        step, sure = self.mission.step, list(fixed)
        for each in appointments:
            base = 0 if each.visit.after is None else appointments[each.visit.after].step
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
    for appointment in appointments:
        event, at = appointment.visit.event, appointment.step
        holds.extend(
            Hold(hold.agent, hold.node, hold.low + at, min(hold.high + at, steps), hold.timeless)
            for hold in event.holds
        )
        base = 0 if appointment.visit.after is None else appointments[appointment.visit.after].step
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
