"""Tours: initial joint trajectory of uncoupled agents, each from one of its goals to the next.

    in   Schedule
    out  positions of all agents at every step, and joint waypoints from them

Paths avoid static obstacles, with constant speed between two goals. Agents with momentum move from rest to rest if time
allows, and speed limits are satisfied. Agents with the same goal at the same time are placed beside each other. An
agent without goals that must always stay near another agent accompanies it.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from missionc.backends.clot.schedule.geodesics import Geodesics, eased
from missionc.backends.clot.schedule.goal_sets import GoalSet, GoalSets
from missionc.backends.clot.schedule.timed_paths import Closure, TimedPaths
from missionc.backends.clot.schedule.visits import Escort, KeyFrame, Schedule
from missionc.backends.clot.settings import clot_settings
from missionc.base.late_dataclass import Record
from missionc.base.trace import Array
from missionc.geometry.polylines import length
from missionc.geometry.required_separation import SpacingTable
from missionc.ir import Agent, InitialSet, Inside, Mission
from missionc.ir.distances.signed_distance import signed_distance
from missionc.ir.kernel.nodes import Atom


class Stop(Record, eq=False):
    """Stay of an agent at a point, (dim,), metres, from one step to another, both included."""

    begin: int
    end: int
    point: Array


class Along(Record, eq=False):
    """Path of an agent beside another agent's path, (steps, dim), metres, from step ``begin`` on."""

    begin: int
    points: Array

    @property
    def first(self) -> Stop:
        return Stop(self.begin, self.begin, self.points[0])

    @property
    def last(self) -> Stop:
        end = self.begin + len(self.points) - 1
        return Stop(end, end, self.points[-1])


def tours(
    mission: Mission, schedule: Schedule, timed: TimedPaths, geodesics: Geodesics, generator: np.random.Generator
) -> tuple[tuple[KeyFrame, ...], Array]:
    """Joint waypoints of the tours, and positions of all agents, (agents, steps + 1, dim), metres."""
    stops, near = _stops(mission, schedule, timed.goals), clot_settings(mission).schedule.meeting
    position = np.zeros((len(mission.agents), mission.steps + 1, mission.dimension))
    closures = [timed.closures(each.index, schedule.holds) for each in mission.agents]
    for each in mission.agents:
        position[each.index] = _tour(mission, each.index, stops[each.index], timed, closures[each.index], geodesics)
    everybody = [Escort(meeting, 0, mission.steps) for meeting in schedule.company.meetings]
    along: dict[int, list[Along]] = {}
    for escort in sorted((*everybody, *schedule.escorts), key=lambda each: each.low):
        for agent, leader in _followers(position, escort, stops, near):
            here = position[agent, escort.low] - position[leader, escort.low]
            ways = along.setdefault(agent, [])
            ways.append(Along(escort.low, position[leader, escort.low : escort.high + 1] + here))
            beside = [stop for way in ways for stop in (way.first, way.last)]
            position[agent] = _tour(mission, agent, [*stops[agent], *beside], timed, closures[agent], geodesics)
            for way in ways:
                position[agent, way.begin : way.last.end + 1] = way.points
    _shaken(mission, position, generator)
    at = sorted({0, *(each.step for each in schedule.appointments), mission.steps})
    return tuple(KeyFrame(step, position[:, step], 0.0, "") for step in at), position


def _stops(mission: Mission, schedule: Schedule, goals: GoalSets) -> list[list[Stop]]:
    """Stays of each agent sorted by time, from its start to its last goal."""
    wanted: list[list[tuple[Stop, GoalSet | None]]] = []
    for each in mission.agents:
        if each.start.point is not None:
            wanted.append([(Stop(0, 0, np.array(each.start.point)), None)])
        else:
            goal = _goal(goals, each, each.start)
            wanted.append([(Stop(0, 0, goal.points.mean(axis=0)), goal)])
    for appointment in sorted(schedule.appointments, key=lambda each: each.step):
        begin, end = appointment.step, min(appointment.step + appointment.visit.lasts, mission.steps)
        for place in appointment.places:
            if place.leaves is not None:
                wanted[place.agent] += [(Stop(begin, begin, place.point), None), (Stop(end, end, place.leaves), None)]
                continue
            there = Stop(begin, end, place.point), place.goal
            if begin == 0 and mission.agents[place.agent].start.point is not None:
                there = replace(wanted[place.agent][0][0], end=end), None  # it is already there
            wanted[place.agent].append(there)
    last = mission.steps
    for each in mission.agents:
        own = wanted[each.index]
        if each.finish is None:
            own[-1] = replace(own[-1][0], end=last), own[-1][1]
        elif each.finish.point is not None:
            own.append((Stop(last, last, np.array(each.finish.point)), None))
        else:
            goal = _goal(goals, each, each.finish)
            own.append((Stop(last, last, goals.way(goal, each.index, own[-1][0].point)[0]), goal))
    stops: list[list[Stop]] = [[] for _ in mission.agents]
    everyone = np.arange(len(mission.agents))
    apart = SpacingTable.of(mission).between(everyone[:, None], everyone)
    for first, second, least in schedule.company.apart:
        apart[first, second] = apart[second, first] = max(least, apart[first, second])
    apart += clot_settings(mission).schedule.tour_clearance
    order = [(stop.begin, agent, stop, goal) for agent, own in enumerate(wanted) for stop, goal in own]
    for _, agent, stop, wish in sorted(order, key=lambda each: each[:2]):
        stops[agent].append(stop if wish is None else _beside(agent, stop, wish, stops, apart))
    return stops


def _shaken(mission: Mission, position: Array, generator: np.random.Generator) -> None:
    """Shift each agent's tour in ``position``, (agents, steps + 1, dim), metres, at random, in place.

    Coinciding tours would have no direction in which to avoid each other.
    """
    shaken = 0.1  # share of a body and of the separation by which a tour is moved
    for agent in mission.agents:
        aside = generator.uniform(-1, 1, mission.dimension) * shaken * (agent.radius + mission.separation)
        begin = int(agent.start.point is not None)
        end = int(agent.finish is not None and agent.finish.point is not None)
        position[agent.index, begin : mission.steps + 1 - end] += aside


def _goal(goals: GoalSets, agent: Agent, end: InitialSet) -> GoalSet:
    """Goal set of an agent that starts, or finishes, in a region."""
    assert end.region is not None
    goal = goals.of(agent.index, (Atom(Inside(end.region, False)),))
    assert goal is not None
    return goal


def _beside(agent: int, stop: Stop, goal: GoalSet, stops: list[list[Stop]], apart: Array) -> Stop:
    """Stay moved to the nearest position in its goal that is free of other agents.

    Args:
        apart: required distances of agents, (agents, agents), metres.
    """
    others, gaps = [], []
    for other, taken in enumerate(stops):
        for each in taken:
            if other != agent and each.begin <= stop.end and stop.begin <= each.end:
                others.append(each.point)
                gaps.append(apart[agent, other])
    if not others:
        return stop
    points = np.concatenate([stop.point[None], goal.points])
    lacking = np.zeros(len(points))
    for point, gap in zip(others, gaps, strict=True):
        lacking += np.maximum(gap - np.linalg.norm(points - point, axis=1), 0.0)
    away = np.linalg.norm(points - stop.point, axis=1)
    best = int(np.lexsort((away, lacking))[0])
    return Stop(stop.begin, stop.end, points[best])


def _tour(
    mission: Mission,
    agent: int,
    stops: list[Stop],
    timed: TimedPaths,
    closures: Sequence[Closure],
    geodesics: Geodesics,
) -> Array:
    """Positions of one agent at every step, (steps + 1, dim), metres."""
    radius = mission.agents[agent].radius + mission.clearance
    position = np.zeros((mission.steps + 1, mission.dimension))
    position[:] = stops[0].point
    slowness = timed.goals.roaming(agent).slowness
    seconds = np.arange(mission.steps + 1, dtype=np.float64) * float(mission.step)
    for here, there in pairwise(sorted(stops, key=lambda each: (each.begin, each.end))):
        begin, end = min(here.end, there.begin), there.begin
        wide = radius + clot_settings(mission).schedule.tour_clearance
        way = geodesics.way(here.point, there.point, wide, radius, slowness=slowness)
        if way is None:
            way = np.stack([here.point, there.point])
        begin, end = _at_the_refill(mission, agent, here, there, (begin, end), way)
        share = np.arange(end - begin + 1) / max(1, end - begin)
        share = eased(share, way, (end - begin) * mission.step, mission.agents[agent].dynamics)
        position[begin : end + 1] = geodesics.paced(way, share, slowness)
        position[end:] = there.point
        span = slice(here.end, end + 1)
        if closures and here.end < end and timed.meets(agent, closures, position[span], seconds[span]):
            path = timed.between(agent, here.point, there.point, (seconds[here.end], seconds[end]), closures)
            if path is not None:
                position[span] = path.at(seconds[span])
                position[end] = there.point
    return position


def _at_the_refill(
    mission: Mission, agent: int, here: Stop, there: Stop, when: tuple[int, int], way: Array
) -> tuple[int, int]:
    """First and last step of an agent's path between two stays.

    An agent that consumes a resource while waiting waits at the refill region.

    Args:
        when: earliest departure step, and latest arrival step.
        way: points of the path, (points, dim), metres.
    """
    shapes = [
        refill.region.shape
        for each in mission.resources
        if each.per_second > 0 and agent in each.agents
        for refill in each.refills
    ]
    fills = [any(float(signed_distance(np, shape, stop.point)) <= 0 for shape in shapes) for stop in (here, there)]
    dynamics = mission.agents[agent].dynamics
    seconds = (
        length(way) / (clot_settings(mission).schedule.late_speed * dynamics.top_speed)
        + dynamics.top_speed / dynamics.top_acceleration
    )
    begin, end = when
    takes = min(math.ceil(seconds / mission.step), end - begin)
    return (end - takes, end) if fills[0] else (begin, begin + takes) if fills[1] else when


def _followers(position: Array, escort: Escort, stops: list[list[Stop]], near: float) -> Iterator[tuple[int, int]]:
    """Yield pairs of follower and leader of an escort; followers are idle agents that would otherwise be too far from
    the leader.

    Args:
        position: (agents, steps, dim), metres.
        near: fraction of the allowed distance at which an agent counts as too far away.
    """

    def meanwhile(agent: int) -> int:
        return sum(escort.low < stop.begin <= escort.high for stop in stops[agent])

    leader = max(escort.meeting.agents, key=lambda agent: (meanwhile(agent), -agent))
    span = slice(escort.low, escort.high + 1)
    for agent in escort.meeting.agents:
        away = np.linalg.norm(position[agent, span] - position[leader, span], axis=-1).max()
        if agent != leader and not meanwhile(agent) and away > near * escort.meeting.reach:
            yield agent, leader
