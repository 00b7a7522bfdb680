"""Lower bounds on the metres and steps of every plan of a mission, for any engine, roadmap or seed.

An agent that must visit several places moves at least along the shortest tour of them from its start, around the
obstacles that are always there. Other agents and times in between only make the tour longer, so each bound is proved,
but may be far from the optimum.

The least tour is computed over sets of stops, from the time at which each stop is due and the distances between stops.
It gives, for each set, the least metres and the fewest steps after which the agent need not move.

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
    """Steps at one of which a stop is due."""

    low: int
    high: int


class Legs(Record):
    """Minimum length of each leg, in metres or steps: from the start to each stop, and between stops."""

    first: Sequence[float]
    between: Sequence[Sequence[float]]


def least_metres(due: Sequence[Due], legs: Legs) -> list[float]:
    """Length in metres of the shortest path through each set of stops (bit mask).

    Infinite if no order works.
    """
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
    """Steps after which an agent that visited each set of stops in time can stay; infinite if too late.

    The agent is at places at whole steps only, and leaves a stop at the earliest when that is due.
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
    """Return whether a remaining stop comes after the last one."""
    return any(before[stop] >> last & 1 for stop in _members(rest, len(before)))


def _members(mask: int, count: int) -> list[int]:
    return [stop for stop in range(count) if mask >> stop & 1]


SLACK, BENT, FASTER = 2e-5, 1e-3, 1e-5
"""Reductions of a leg in metres, straight and bent, and of speed as a ratio: more than the tolerances of
verification."""

ROUNDING = 1e-6
"""Steps subtracted from a leg before rounding up."""

STOPS, TOGETHER = 7, 5
"""Maximum number of stops in a tour, and of stops shared by several agents: time doubles with each."""

TOURS = 300_000
"""Approximate maximum number of legs in all tours; with many agents, each has fewer stops."""

DECIMALS = 9
"""Decimals of a bound, in seconds or metres."""

UNITS = {Objective.DURATION: "s", Objective.DISTANCE: "m"}
"""Unit of the bounds, by objective."""

ROUND = 150
"""Number of legs computed around obstacles; the others are straight."""


class LowerBounds(Record):
    """Lower bounds for every plan: ``metres`` of all agents together, and ``steps`` until all agents stay."""

    metres: float
    steps: int


class _Task(Record):
    """Number of agents that must be in an area, each at one of the ``due`` steps."""

    number: int
    agents: tuple[int, ...]
    area: Area
    due: Due


class _Tour(Record):
    """Minimum metres and steps of an agent, by the set of ``tasks`` that it does.

    It always does those in ``own``.
    """

    tasks: tuple[_Task, ...]
    own: int
    metres: Sequence[float]
    steps: Sequence[float]

    def doing(self, tasks: Sequence[_Task]) -> tuple[float, float]:
        """Metres and steps with these tasks in addition to its own; tasks that it has no part in are ignored."""
        mask = self.own | sum(1 << number for number, task in enumerate(self.tasks) if task in tasks)
        return self.metres[mask], self.steps[mask]


def lower_bounds(mission: Mission, kernel: Kernel, *, bent: bool = False) -> LowerBounds:
    """Lower bounds of a mission whose world is not flat.

    Each agent makes the tour of its required places in the best order. A task for one of several agents goes to the
    best one. For a task that needs several agents, the nearest go and the most expensive one counts.

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
    """Lower bound of the objective of the mission, in seconds or metres.

    None if the objective is another one, or the world is flat.
    """
    if mission.objective not in UNITS or mission.world.flat:
        return None
    bounds = lower_bounds(mission, kernel, bent=True)
    return bounds.steps * mission.step if mission.objective is Objective.DURATION else bounds.metres


def beside(mission: Mission, trace: Trace, least: float, by: str) -> Proven:
    """Compare a lower bound, in seconds or metres, with the value of a plan, which caps it.

    Args:
        by: as in ``Proven``.
    """
    lasts = mission.objective is Objective.DURATION
    value = round(trace.lasts * mission.step, DECIMALS) if lasts else trace.metres
    return Proven(value, min(value, round(least, DECIMALS)), UNITS[mission.objective], by)


def _shared_out(tours: dict[int, _Tour], few: list[_Task]) -> tuple[float, float]:
    """Metres and steps if each of a few tasks is done by one agent: the minimum over all assignments."""
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
    """Tour of an agent through its furthest own tasks, and those of the few shared tasks that it can do."""
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
    """Legs between areas in metres, each computed once, up to a limit around static obstacles."""

    ground: FreeSpace
    left: int
    starts: dict[Area, dict[int, float]] = field(default_factory=dict)
    found: dict[tuple[float, Area, Area], float] = field(default_factory=dict)

    def known(self, task: _Task) -> bool:
        """Return whether all agents of the task move and have a path to it."""
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
        """Length of the leg from an agent's start."""
        mover = self.ground.mission.agents[agent]
        return self._leg(mover, self.ground.ways.start(mover), area, self.starts[area][agent])

    def between(self, agent: int, one: Area, other: Area) -> float:
        """Length of the leg between two areas."""
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
    """Tasks that the requirements and the finishes give to agents at some step."""
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
    """First and last due steps of a fact."""
    when = fact.when
    yield Due(when.low, when.high)
    if when.repeats:
        yield Due(when.low + when.repeats, when.high + when.repeats)
