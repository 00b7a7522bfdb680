"""When each event happens and which option of each task is taken: the quickest way round, as the crow flies.

Every task's options are tried at every place of the order found so far, and the one with which
all arrive soonest is kept. Several schedules come from the same mission by weighing distances
a little differently each time.

Source:
    Rosenkrantz, Stearns and Lewis, cheapest insertion, 1977; here for visits of several agents with windows.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from missionc.backends.clot.active import Choices
from missionc.backends.clot.cost_graph import Margin, Term
from missionc.backends.clot.tasks import Decision, Event, Hold, Option, Outline
from missionc.ir import Anywhere, Exactly, Inside, Mission, Region, Touches, top_speed
from missionc.plan import Array
from missionc.world.distance import signed_distance
from missionc.world.sampling import points_in

SHARE = 0.8
"""Of an agent's top speed, that a sketch counts on."""

LATE = 1e3
"""What a second too late costs against a second on the way."""


@dataclass(frozen=True, slots=True)
class Visit:
    """An event, the regions its agents are asked to be in, and which visit it comes after (``then``)."""

    event: Event
    regions: tuple[tuple[int, Region], ...]
    lasts: int
    after: int | None


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
        self.deepest: dict[Region, Array] = {}
        self.speed = np.array([top_speed(agent.dynamics) for agent in mission.agents]) * SHARE
        self.starts = np.array([self._place(agent.start) for agent in mission.agents])
        self.finishes = [None if agent.finish is None else self._place(agent.finish) for agent in mission.agents]

    def schedule(self, noise: float) -> Schedule:
        """A schedule; ``noise`` is by what share distances are misjudged on purpose, for another one than before."""
        order: list[Visit] = []
        options: list[Option] = []
        stretch: dict[Region, float] = {}

        def factor(region: Region) -> float:
            if noise and region not in stretch:
                stretch[region] = float(np.exp(noise * self.generator.standard_normal()))
            return stretch.get(region, 1.0)

        tasks = sorted(self.outline.tasks, key=lambda task: (len(task.options), _deadline(task.options)))
        for task in tasks:
            found: tuple[float, list[Visit], Option] | None = None
            for option in task.options:
                for visits in self._inserted(order, option):
                    cost = self._run(visits, factor)[0]
                    if noise:
                        cost *= float(np.exp(0.3 * noise * self.generator.standard_normal()))
                    if found is None or cost < found[0]:
                        found = cost, visits, option
            if found is not None:
                order = found[1]
                options.append(found[2])
        return self._settled(order, options)

    # --------------------------------------------------------------- inserting

    def _inserted(self, visits: list[Visit], option: Option) -> Iterator[list[Visit]]:
        """The order with the option's events at every place where it makes a difference."""
        chains = [self._chain(event) for event in option.events]
        flat = [visit for chain in chains for visit in chain]
        if not flat:
            yield visits
            return
        mine = {agent for visit in flat for agent, _ in visit.regions}
        places = [
            place
            for place in range(len(visits) + 1)
            if place == len(visits) or any(agent in mine for agent, _ in visits[place].regions)
        ]
        for place in places:
            moved = [self._renumbered(visit, place, len(flat)) for visit in visits]
            new = [
                visit if visit.after is None else Visit(visit.event, visit.regions, visit.lasts, visit.after + place)
                for visit in self._based(chains)
            ]
            yield [*moved[:place], *new, *moved[place:]]

    def _chain(self, event: Event) -> list[Visit]:
        """An event and those that come after it, each with the number in this list of the one it counts from."""
        found: list[Visit] = []
        stack: list[tuple[Event, int | None]] = [(event, None)]
        while stack:
            each, after = stack.pop()
            regions = tuple(dict(_regions(each.holds)).items())
            lasts = max((hold.high for hold in each.holds), default=0)
            found.append(Visit(each, regions, min(lasts, self.mission.steps), after))
            stack.extend((later, len(found) - 1) for later in reversed(each.then))
        return found

    def _based(self, chains: list[list[Visit]]) -> list[Visit]:
        found: list[Visit] = []
        for chain in chains:
            base = len(found)
            found.extend(
                visit if visit.after is None else Visit(visit.event, visit.regions, visit.lasts, visit.after + base)
                for visit in chain
            )
        return found

    def _renumbered(self, visit: Visit, place: int, count: int) -> Visit:
        if visit.after is None or visit.after < place:
            return visit
        return Visit(visit.event, visit.regions, visit.lasts, visit.after + count)

    # ------------------------------------------------------------------ timing

    def _run(
        self, visits: list[Visit], factor: Callable[[Region], float] | None = None
    ) -> tuple[float, list[float], float, float]:
        """Cost of an order, the soonest time of each visit, how much too late all that is, and when all is done."""
        step = self.mission.step
        where, free = self.starts.copy(), np.zeros(len(self.starts))
        times: list[float] = []
        late = way = 0.0
        for visit in visits:
            low, high = visit.event.low * step, visit.event.high * step
            if visit.after is not None:
                low, high = low + times[visit.after], high + times[visit.after]
            begin = low
            for agent, region in visit.regions:
                target = self._centre(region)
                gap = max(
                    0.0, float(signed_distance(np, region.shape, where[agent])) + self.mission.agents[agent].radius
                )
                far = float(np.linalg.norm(target - where[agent]))
                if far > 0:
                    where[agent] += (target - where[agent]) * min(1.0, (gap + 0.1) / far)
                way += gap
                begin = max(begin, free[agent] + gap * (factor(region) if factor else 1.0) / self.speed[agent])
            late += max(0.0, begin - high)
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

    def _settled(self, visits: list[Visit], options: list[Option]) -> Schedule:
        """Steps for all visits: everything as unhurried as windows and horizon let it be."""
        step, steps = self.mission.step, self.mission.steps
        _, soonest, late, end = self._run(visits)
        room = [self.mission.horizon / end] if end > 0 else [1.0]
        for visit, time in zip(visits, soonest, strict=True):
            if visit.after is None and time > visit.event.low * step:
                room.append(visit.event.high * step / time)
        slower = max(1.0, min(room))
        appointments: list[Appointment] = []
        for visit, time in zip(visits, soonest, strict=True):
            base = 0 if visit.after is None else appointments[visit.after].step
            latest = min(base + visit.event.high, steps - (visit.lasts if visit.lasts < steps else 0))
            if visit.regions:
                wanted = round(time * slower / step)
            else:  # nobody has to get anywhere for it, and what comes after may need the time
                wanted = max([round(time / step), *(each.step for each in appointments)])
            wanted = max(base + visit.event.low, min(wanted, latest))
            appointments.append(Appointment(visit, wanted))
        return _told(self.outline, tuple(appointments), options, late, steps)

    # ------------------------------------------------------------------ places

    def _place(self, place: Exactly | Anywhere) -> Array:
        return np.array(place.point) if isinstance(place, Exactly) else self._centre(place.region)

    def _centre(self, region: Region) -> Array:
        """A point deep in a region."""
        if region not in self.deepest:
            points, depth = points_in(region.shape, self.mission.world, 256, np.random.default_rng(0))
            middle = np.array(self.mission.world.low) / 2 + np.array(self.mission.world.high) / 2
            best = depth >= depth.max(initial=0.0) * 0.98
            self.deepest[region] = points[best].mean(axis=0) if len(points) else middle
        return self.deepest[region]

    def centre(self, region: Region) -> Array:
        return self._centre(region)


def _deadline(options: tuple[Option, ...]) -> int:
    return min((event.high for option in options for event in option.events), default=0)


def _regions(holds: tuple[Hold, ...]) -> Iterator[tuple[int, Region]]:
    """Where holds want their agents, those that are about places."""
    for hold in holds:
        term = hold.term
        if isinstance(term, Margin) and term.holds and isinstance(term.predicate, Inside | Touches):
            yield hold.agent, term.predicate.region


def _told(
    outline: Outline, appointments: tuple[Appointment, ...], options: list[Option], late: float, steps: int
) -> Schedule:
    """Holds and decisions counted from step 0, and all choices by term, agent and step."""
    holds = [*outline.holds, *(hold for option in options for hold in option.holds)]
    decisions = [decision for option in options for decision in option.decisions]
    choices: dict[tuple[Term, int, int], int] = {}
    for appointment in appointments:
        event, at = appointment.visit.event, appointment.step
        holds.extend(
            Hold(hold.agent, hold.term, hold.low + at, min(hold.high + at, steps), hold.timeless)
            for hold in event.holds
        )
        base = 0 if appointment.visit.after is None else appointments[appointment.visit.after].step
        holds.extend(
            Hold(hold.agent, hold.term, base + hold.low, at - 1, hold.timeless)
            for hold in event.before
            if at > base + hold.low
        )
        decisions.extend(
            Decision(each.term, each.agent, each.part, each.low + at, min(each.high + at, steps))
            for each in event.decisions
        )
        choices[event.chooser, event.agent, event.asked + base] = at
    for each in decisions:
        for step in range(each.low, each.high + 1):
            choices[each.term, each.agent, step] = each.part
    return Schedule(appointments, tuple(holds), tuple(decisions), choices, late)
