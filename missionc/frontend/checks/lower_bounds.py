"""Lower bounds: metres and steps that every plan of a mission takes, whatever the engine, roadmap or seed.

An agent that has to be at several places moves at least along the shortest tour of them from its start, around the
obstacles that are always there. Other agents and times in between only make the tour longer, so a bound is proved,
and may be far from what is possible.

The least tour is computed over sets of stops, from the time at which each stop is due and the distances between
stops. It gives, for each set, the least metres and the fewest steps after which the agent need not move.

Source:
    Held and Karp, "A dynamic programming approach to sequencing problems", 1962, here with windows of time.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import field

from missionc.base.late_dataclass import Record, dataclass
from missionc.base.proven import Proven
from missionc.base.trace import Trace
from missionc.frontend.checks.check_goals import journeys
from missionc.frontend.checks.free_space import FreeSpace
from missionc.frontend.checks.literals import Unbounded
from missionc.frontend.checks.necessary_conditions import Fact, NecessaryConditions
from missionc.geometry.configuration_space import Area, empty
from missionc.ir import Agent, Mission, Objective
from missionc.ir.kernel.nodes import Kernel


class Due(Record):
    """The steps of which one is that of a stop."""

    low: int
    high: int


class Legs(Record):
    """The least of a kind, metres or whole steps: from the start to each stop, and from each stop to each other."""

    first: Sequence[float]
    between: Sequence[Sequence[float]]


def least_metres(due: Sequence[Due], legs: Legs) -> list[float]:
    """Metres of the shortest way by each set of stops, as a bit mask of them; infinite where none is in order."""
    count, before = len(due), _before(due)
    best = [[math.inf] * count for _ in range(1 << count)]
    for mask in range(1, 1 << count):
        for last in _members(mask, count):
            rest = mask & ~(1 << last)
            if _misplaced(rest, last, before):
                continue
            arrivals = (best[rest][stop] + legs.between[stop][last] for stop in _members(rest, count))
            best[mask][last] = min(arrivals) if rest else legs.first[last]
    return [0.0, *(min(row) for row in best[1:])]


def fewest_steps(due: Sequence[Due], legs: Legs) -> list[float]:
    """Steps after which an agent that was at each set of stops in time need not move any more; infinite where late.

    It is somewhere at whole steps only, and leaves a stop when that is due at the earliest.
    """
    count, before = len(due), _before(due)
    visit = [[math.inf] * count for _ in range(1 << count)]
    rests = [[math.inf] * count for _ in range(1 << count)]
    for mask in range(1, 1 << count):
        for last in _members(mask, count):
            rest = mask & ~(1 << last)
            if _misplaced(rest, last, before):
                continue
            come = [(0.0, 0.0, legs.first[last])] if not rest else []
            come += [(visit[rest][stop], rests[rest][stop], legs.between[stop][last]) for stop in _members(rest, count)]
            there = max(due[last].low, min(leaves + way for leaves, _, way in come))
            if there <= due[last].high:
                visit[mask][last] = there
                rests[mask][last] = min(leaves + way if way else still for leaves, still, way in come)
    return [0.0, *(min(row) for row in rests[1:])]


def _before(due: Sequence[Due]) -> list[int]:
    """For each stop those, as a bit mask, that are due before it."""
    return [
        sum(
            1 << other
            for other, earlier in enumerate(due)
            if earlier.high <= stop.low and not (stop.high <= earlier.low and number <= other)
        )
        for number, stop in enumerate(due)
    ]


def _misplaced(rest: int, last: int, before: Sequence[int]) -> bool:
    """Whether a stop of the rest comes after the last one."""
    return any(before[stop] >> last & 1 for stop in _members(rest, len(before)))


def _members(mask: int, count: int) -> list[int]:
    return [stop for stop in range(count) if mask >> stop & 1]


SLACK, BENT, FASTER = 2e-5, 1e-3, 1e-5
"""Metres by which a leg is taken shorter, more where it is bent, and the share by which agents are taken faster: more
than verification lets pass."""

ROUNDING = 1e-6
"""Steps by which a leg is taken shorter before they are rounded up."""

STOPS, TOGETHER = 7, 5
"""Stops of a tour at most, and those of them that one agent of several makes: time doubles with each."""

TOURS = 300_000
"""Legs of all tours that are looked at, about: many agents have fewer stops each."""

DECIMALS = 9
"""Decimals of a bound, seconds or metres."""

UNITS = {Objective.DURATION: "s", Objective.DISTANCE: "m"}
"""What bounds are in, by what is minimized."""

ROUND = 150
"""Legs that are looked for round obstacles; the others are straight."""


class LowerBounds(Record):
    """What every plan takes at least: ``metres``, all agents together, and ``steps`` until nobody moves any more."""

    metres: float
    steps: int


class _Task(Record):
    """So many of these agents have to be in an area, each at one of the steps at which that is ``due``."""

    number: int
    agents: tuple[int, ...]
    area: Area
    due: Due


class _Tour(Record):
    """An agent's least metres and steps, by the set of ``tasks`` that it does; those of ``own`` it does in any case."""

    tasks: tuple[_Task, ...]
    own: int
    metres: Sequence[float]
    steps: Sequence[float]

    def doing(self, tasks: Sequence[_Task]) -> tuple[float, float]:
        """Metres and steps with these tasks beside its own; of those it has no part in nothing is known."""
        mask = self.own | sum(1 << number for number, task in enumerate(self.tasks) if task in tasks)
        return self.metres[mask], self.steps[mask]


def lower_bounds(mission: Mission, kernel: Kernel, *, bent: bool = False) -> LowerBounds:
    """The bounds of a mission whose world is not flat.

    Each agent goes the tour of where it has to be, in the best order. Where one of some agents has to be somewhere, the
    tasks are shared out in the best way; where several of them have to, the nearest go, and the dearest counts.

    Args:
        bent: whether ways round obstacles are looked for, too.
    """
    legs = _LegsOf(FreeSpace.of(mission), ROUND if bent else 0)
    tasks = [task for task in dict.fromkeys(_tasks(legs.ground, kernel)) if legs.known(task)]
    own = [task for task in tasks if task.number == len(task.agents)]
    few = [task for task in tasks if 1 == task.number < len(task.agents)]
    few = sorted(few, key=lambda task: -min(legs.first(agent, task.area) for agent in task.agents))[:TOGETHER]
    many = [task for task in tasks if 1 < task.number < len(task.agents)]
    members = sorted({agent for task in tasks for agent in task.agents})
    most = STOPS
    while most > 1 and len(members) * 2**most * most**2 > TOURS:
        most -= 1
    tours = {agent: _tour(legs, agent, own, few, most) for agent in members}
    metres, steps = _shared_out(tours, few)
    base = sum(tour.doing(())[0] for tour in tours.values())
    for task in many:
        more, needed = [], []
        for agent in task.agents:
            alone = _tour(legs, agent, own, [task], most)
            more.append(alone.doing([task])[0] - tours[agent].doing(())[0])
            needed.append(alone.doing([task])[1])
        metres = max(metres, base + sum(max(0.0, each) for each in sorted(more)[: task.number]))
        steps = max(steps, sorted(needed)[task.number - 1])
    return LowerBounds(metres if math.isfinite(metres) else 0.0, math.ceil(steps) if math.isfinite(steps) else 0)


def least_by_tours(mission: Mission, kernel: Kernel) -> float | None:
    """What every plan comes to at least, seconds or metres, as the mission minimizes.

    None where it minimizes neither, or its world is flat.
    """
    if mission.objective not in UNITS or mission.world.flat:
        return None
    bounds = lower_bounds(mission, kernel, bent=True)
    return bounds.steps * mission.step if mission.objective is Objective.DURATION else bounds.metres


def beside(mission: Mission, trace: Trace, least: float, by: str) -> Proven:
    """A bound, seconds or metres, beside what a plan comes to; it is never more than that.

    Args:
        by: as of ``Proven``.
    """
    lasts = mission.objective is Objective.DURATION
    value = round(trace.lasts * mission.step, DECIMALS) if lasts else trace.metres
    return Proven(value, min(value, round(least, DECIMALS)), UNITS[mission.objective], by)


def _shared_out(tours: dict[int, _Tour], few: list[_Task]) -> tuple[float, float]:
    """Metres and steps where each of a few tasks is done by one agent that may: the least of all ways to share them."""
    whole = (1 << len(few)) - 1
    metres, steps = [0.0] + [math.inf] * whole, [0.0] + [math.inf] * whole
    for agent, tour in tours.items():
        able = sum(1 << number for number, task in enumerate(few) if agent in task.agents)
        taken = {
            mask: tour.doing([task for number, task in enumerate(few) if mask >> number & 1])
            for mask in range(whole + 1)
            if mask & ~able == 0
        }
        metres = [min(metres[mask & ~own] + taken[own][0] for own in taken if own & ~mask == 0) for mask in _all(whole)]
        steps = [
            min(max(steps[mask & ~own], taken[own][1]) for own in taken if own & ~mask == 0) for mask in _all(whole)
        ]
    return metres[whole], steps[whole]


def _all(whole: int) -> range:
    return range(whole + 1)


def _tour(legs: _LegsOf, agent: int, own: Sequence[_Task], few: Sequence[_Task], most: int) -> _Tour:
    """The tour of an agent by those of its own tasks that are furthest, and by those of a few that it may do."""
    mine = [task for task in own if agent in task.agents]
    shared = [task for task in few if agent in task.agents][:most]
    mine = sorted(mine, key=lambda task: (-legs.first(agent, task.area), -task.due.low))[: most - len(shared)]
    tasks = (*mine, *shared)
    due = [task.due for task in tasks]
    first = [legs.first(agent, task.area) for task in tasks]
    between = [[legs.between(agent, one.area, other.area) for other in tasks] for one in tasks]
    metres = least_metres(due, Legs(first, between))
    fastest = legs.ground.mission.agents[agent].dynamics.top_speed * (1 + FASTER) * legs.ground.mission.step

    def steps(metres_: float) -> float:
        return float(max(0, math.ceil(metres_ / fastest - ROUNDING)))

    moving = Legs([*map(steps, first)], [[*map(steps, row)] for row in between])
    return _Tour(tasks, (1 << len(mine)) - 1, metres, fewest_steps(due, moving))


@dataclass(slots=True, eq=False)
class _LegsOf:
    """Legs between areas, metres, each looked for once, so many of them round what stands."""

    ground: FreeSpace
    left: int
    starts: dict[Area, dict[int, float]] = field(default_factory=dict)
    found: dict[tuple[float, Area, Area], float] = field(default_factory=dict)

    def known(self, task: _Task) -> bool:
        """Whether all of its agents move and have a way there."""
        agents = [self.ground.mission.agents[agent] for agent in task.agents]
        if empty(task.area) or any(agent.dynamics.top_speed <= 0 for agent in agents):
            return False
        if task.area not in self.starts:
            self.starts[task.area] = {}
        at = self.starts[task.area]
        wanted = [agent for agent in agents if agent.index not in at]
        at.update({each.agent.index: each.distance for each in journeys(self.ground, wanted, task.area)})
        return at.keys() >= set(task.agents)

    def first(self, agent: int, area: Area) -> float:
        """From where an agent starts."""
        mover = self.ground.mission.agents[agent]
        return self._leg(mover, self.ground.ways.start(mover), area, self.starts[area][agent])

    def between(self, agent: int, one: Area, other: Area) -> float:
        """From one area to another."""
        if one is other:
            return 0.0
        return self._leg(self.ground.mission.agents[agent], one, other, None)

    def _leg(self, agent: Agent, start: Area, goal: Area, straight: float | None) -> float:
        asked = agent.radius, start, goal
        if asked not in self.found:
            self.found[asked] = self._length(agent, start, goal, straight)
            self.found[agent.radius, goal, start] = self.found[asked]
        return self.found[asked]

    def _length(self, agent: Agent, start: Area, goal: Area, straight: float | None) -> float:
        length = self.ground.atlas.distance(start, goal) if straight is None else straight
        length = length if math.isfinite(length) else 0.0
        round_ = 0.0
        if self.left > 0 and length > 0:
            self.left -= 1
            way = self.ground.ways.bent(agent, start, goal, length + BENT)
            round_ = way.length if way is not None and math.isfinite(way.length) else 0.0
        return max(0.0, length - SLACK, round_ - BENT)


def _tasks(ground: FreeSpace, kernel: Kernel) -> Iterator[_Task]:
    """Who has to be somewhere at some step, by the requirements and at the end."""
    mission = ground.mission
    places, necessary = ground.places(mission.agents), NecessaryConditions.of(mission, kernel)
    facts = [fact for goal in kernel.requirements for fact in necessary.of_requirement(goal.formula).facts]
    for fact in facts:
        area = places.rule(fact.literal).within
        if not isinstance(area, Unbounded) and fact.who.number:
            yield from (_Task(fact.who.number, fact.who.agents, area, due) for due in _dues(fact))
    last = Due(mission.steps, mission.steps)
    for agent, finish in mission.finishes:
        yield _Task(1, (agent.index,), ground.atlas.initial(finish), last)


def _dues(fact: Fact) -> Iterator[Due]:
    """When a fact holds the first time, and the last."""
    when = fact.when
    yield Due(when.low, when.high)
    if when.repeats:
        yield Due(when.low + when.repeats, when.high + when.repeats)
