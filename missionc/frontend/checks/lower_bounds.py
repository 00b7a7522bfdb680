"""Lower bounds on the metres and steps of every plan of a mission, for any engine, roadmap or seed.

An agent that must visit several regions moves at least along the shortest tour of them from its start, around the
obstacles that are always there. Other agents and times in between only make the tour longer, so each bound is proved,
but may be far from the optimum.

The minimum tour is computed over sets of stops, from the time at which each stop is due and the distances between
stops. It gives, for each set, the minimum metres and the fewest steps after which the agent need not move.

Source:
    Held and Karp, "A dynamic programming approach to sequencing problems", 1962, here with windows of time.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import field

from missionc.base.late_dataclass import Record, dataclass
from missionc.base.trace import Proven, Trace
from missionc.frontend.checks.check_goals import journeys
from missionc.frontend.checks.free_space import FreeSpace
from missionc.frontend.checks.literals import Unbounded
from missionc.frontend.checks.necessary_conditions import Fact, NecessaryConditions
from missionc.geometry.configuration_space import Area, empty
from missionc.ir import Agent, Mission, Objective
from missionc.ir.kernel.nodes import Kernel


class Due(Record):
    """Time window of a stop: the agent must be there at some step from ``low`` to ``high``."""

    low: int
    high: int


class Legs(Record):
    """Minimum length of each leg of a tour, in metres or steps: from the start to each stop, and between stops."""

    first: Sequence[float]
    between: Sequence[Sequence[float]]


def least_metres(due: Sequence[Due], legs: Legs) -> list[float]:
    """Length in metres of the shortest path through each set of stops (index: bit mask); infinite if no order works."""
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
    """Fewest steps in which each set of stops (index: bit mask) can be visited in time; infinite if impossible.

    The agent is at stops at whole steps only, and leaves a stop at the earliest when the stop is due.
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
    """Bit mask of the stops that are due before each stop."""
    return [
        sum(
            1 << other
            for other, earlier in enumerate(due)
            if earlier.high <= stop.low and not (stop.high <= earlier.low and number <= other)
        )
        for number, stop in enumerate(due)
    ]


def _misplaced(rest: int, last: int, before: Sequence[int]) -> bool:
    """Return whether a stop of the set ``rest`` has to come after the stop ``last``."""
    return any(before[stop] >> last & 1 for stop in _members(rest, len(before)))


def _members(mask: int, count: int) -> list[int]:
    return [stop for stop in range(count) if mask >> stop & 1]


SLACK, BENT, FASTER = 2e-5, 1e-3, 1e-5
"""Reductions for sound bounds: of a straight leg and of a leg around obstacles in metres, and of speed as a ratio.

They exceed the tolerances of verification.
"""

ROUNDING = 1e-6
"""Number of steps subtracted from a leg before rounding up."""

STOPS, TOGETHER = 7, 5
"""Maximum number of stops in a tour, and of stops shared by several agents; run time doubles with each stop."""

TOURS = 300_000
"""Approximate maximum number of legs in all tours; with many agents, each has fewer stops."""

DECIMALS = 9
"""Number of decimals of a bound, in seconds or metres."""

UNITS = {Objective.DURATION: "s", Objective.DISTANCE: "m"}
"""Unit of the bounds, by objective."""

ROUND = 150
"""Number of legs that are computed around obstacles; further legs are straight."""


class LowerBounds(Record):
    """Lower bounds for every plan: ``metres`` of all agents together, and ``steps`` until no agent moves any more."""

    metres: float
    steps: int


class _Task(Record):
    """Requirement that ``number`` of the agents visit an area, each at a step within ``due``."""

    number: int
    agents: tuple[int, ...]
    area: Area
    due: Due


class _Tour(Record):
    """Minimum metres and steps of an agent's tour, by the set of ``tasks`` that it does.

    The tasks in ``own`` (bit mask) are always included.
    """

    tasks: tuple[_Task, ...]
    own: int
    metres: Sequence[float]
    steps: Sequence[float]

    def doing(self, tasks: Sequence[_Task]) -> tuple[float, float]:
        """Metres and steps of the tour with further tasks; tasks of other agents are ignored."""
        mask = self.own | sum(1 << number for number, task in enumerate(self.tasks) if task in tasks)
        return self.metres[mask], self.steps[mask]


def lower_bounds(mission: Mission, kernel: Kernel, *, bent: bool = False) -> LowerBounds:
    """Lower bounds on the metres and steps of every plan of a mission, whose world must not be flat.

    Each agent makes the tour of its required areas in the best order. A task for one of several agents goes to the best
    agent. For a task that needs several agents, the nearest go and the most expensive one counts.

    Args:
        bent: if true, compute paths around obstacles as well.
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
    """Lower bound on the objective of every plan of a mission, in seconds or metres.

    None if the objective has no such bound, or the world is flat.
    """
    if mission.objective not in UNITS or mission.world.flat:
        return None
    bounds = lower_bounds(mission, kernel, bent=True)
    return bounds.steps * mission.step if mission.objective is Objective.DURATION else bounds.metres


def beside(mission: Mission, trace: Trace, least: float, by: str) -> Proven:
    """A lower bound, in seconds or metres, together with the value of a plan, which caps it.

    Args:
        by: method of the bound, as in ``Proven``.
    """
    lasts = mission.objective is Objective.DURATION
    value = round(trace.lasts * mission.step, DECIMALS) if lasts else trace.metres
    return Proven(value, min(value, round(least, DECIMALS)), UNITS[mission.objective], by)


def _shared_out(tours: dict[int, _Tour], few: list[_Task]) -> tuple[float, float]:
    """Minimum metres and steps over all assignments of the few shared tasks to one agent each."""
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
    """Tour of an agent through its furthest own tasks, and the few shared tasks that it can do.

    Args:
        most: maximum number of tasks.
    """
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
    """Lower bounds on the legs between areas in metres, cached, a limited number of them around static obstacles."""

    ground: FreeSpace
    left: int
    starts: dict[Area, dict[int, float]] = field(default_factory=dict)
    found: dict[tuple[float, Area, Area], float] = field(default_factory=dict)

    def known(self, task: _Task) -> bool:
        """Return whether all agents of the task can move, and have a path to its area."""
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
        """Lower bound on the leg from an agent's start to an area, metres."""
        mover = self.ground.mission.agents[agent]
        return self._leg(mover, self.ground.ways.start(mover), area, self.starts[area][agent])

    def between(self, agent: int, one: Area, other: Area) -> float:
        """Lower bound on the leg between two areas, metres."""
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
    """Yield the visits that the requirements and the finishes demand of agents."""
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
    """Yield the time windows of a fact at its first and at its last repetition."""
    when = fact.when
    yield Due(when.low, when.high)
    if when.repeats:
        yield Due(when.low + when.repeats, when.high + when.repeats)
