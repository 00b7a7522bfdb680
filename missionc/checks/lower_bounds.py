"""Lower bounds: metres and steps that every plan of a mission takes, whatever the engine, roadmap or seed.

An agent that has to be somewhere goes at least the straight line from where it starts; obstacles, other agents and what
comes in between can only make that longer. So a bound is proven, and may be far from what is possible.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

from missionc.base.late_dataclass import dataclass
from missionc.checks.check_goals import journeys
from missionc.checks.free_space import FreeSpace
from missionc.checks.literals import Unbounded
from missionc.checks.necessary_conditions import NecessaryConditions
from missionc.ir import Anywhere, Exactly, Mission
from missionc.kernel.nodes import Kernel
from missionc.world.area import Area
from missionc.world.configuration_space import empty

ROUNDING = 1e-9
"""The share by which a bound is taken smaller than it was worked out."""


@dataclass(frozen=True, slots=True)
class LowerBounds:
    """What every plan takes at least: ``metres``, all agents together, and ``steps`` until nobody moves any more."""

    metres: float
    steps: int


@dataclass(frozen=True, slots=True)
class _Task:
    """So many of these agents have to go so far at least, metres by agent."""

    number: int
    distances: dict[int, float]


def lower_bounds(mission: Mission, kernel: Kernel) -> LowerBounds:
    """The bounds of a mission whose world is not flat.

    Whoever has to be at several places goes to the furthest of them. Where some of many will do, the nearest go, and
    of several such tasks the dearest counts: one agent may do them all.
    """
    speed = [agent.dynamics.top_speed for agent in mission.agents]
    own: dict[int, float] = {}
    shared: list[_Task] = []
    for task in _tasks(mission, kernel):
        if task.number < len(task.distances):
            shared.append(task)
            continue
        for agent, distance in task.distances.items():
            own[agent] = max(own.get(agent, 0.0), distance)
    metres, seconds = sum(own.values()), max((own[agent] / speed[agent] for agent in own), default=0.0)
    more = 0.0
    for task in shared:
        further = sorted(max(0.0, length - own.get(agent, 0.0)) for agent, length in task.distances.items())
        more = max(more, sum(further[: task.number]))
        seconds = max(
            seconds, sorted(length / speed[agent] for agent, length in task.distances.items())[task.number - 1]
        )
    share = 1 - ROUNDING
    return LowerBounds((metres + more) * share, math.ceil(seconds * share / mission.step - ROUNDING))


def _tasks(mission: Mission, kernel: Kernel) -> Iterator[_Task]:
    """Who has to be somewhere at some step, by the requirements and at the end."""
    ground = FreeSpace.of(mission)
    places, necessary = ground.places(mission.agents), NecessaryConditions.of(mission, kernel)
    facts = [fact for goal in kernel.requirements for fact in necessary.of_requirement(goal.formula).facts]
    for fact in facts:
        area = places.rule(fact.literal).within
        if not isinstance(area, Unbounded):
            yield from _task(ground, fact.who.number, fact.who.agents, area)
    for agent in mission.agents:
        match agent.finish:
            case Exactly(point):
                yield from _task(ground, 1, (agent.index,), ground.atlas.point(point))
            case Anywhere(region):
                yield from _task(ground, 1, (agent.index,), ground.atlas.outer(region.shape))
            case None:
                pass


def _task(ground: FreeSpace, number: int, agents: tuple[int, ...], area: Area) -> Iterator[_Task]:
    able = [ground.mission.agents[agent] for agent in agents if ground.mission.agents[agent].dynamics.top_speed > 0]
    if number <= len(able) == len(agents) and not empty(area):
        distances = {each.agent.index: each.distance for each in journeys(ground, able, area)}
        if len(distances) == len(agents):
            yield _Task(number, distances)
