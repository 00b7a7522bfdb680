"""Roadmap of the user: exactly the user's nodes and lanes, and paths to starts and finishes beside them.

in   Ground, Lanes
out  nodes and their Edges, the names of the nodes, and for vehicles their flown paths
"""

from __future__ import annotations

import math
from typing import TypeAlias

import numpy as np

from missionc.backends.smt.roadmap.edges import Edges, are_clear
from missionc.backends.smt.roadmap.sample_nodes import Ground, NoRoadmap
from missionc.base.trace import Array
from missionc.geometry.dynamics import SLACK, States, can_wait, steer, turn_in_step
from missionc.geometry.lane_room import SAME, joined_to, positions, straight_runs
from missionc.ir import Lanes
from missionc.ir.lower.flyable_steps import BETWEEN_RESTS, flown_way, step_limits

ROUNDING = 1e-9
"""Fraction of a step by which a lane may exceed a whole number of steps without another step."""


Way: TypeAlias = tuple[int, int, Array]
"""Path along lanes: its first and last node, and positions at its steps, (steps + 1, dim), metres."""


def lane_roadmap(
    ground: Ground, lanes: Lanes
) -> tuple[States, Edges, tuple[str, ...], tuple[Way, ...] | None] | NoRoadmap:
    """Nodes, edges and node names for one kind of agent, and flown paths; or the reason why there is no roadmap.

    Lanes too short for the minimum speed are omitted. An exact start or finish that is not a node becomes an additional
    node, joined in both directions to the nearest node with a clear straight path. If the agents' vehicle cannot start
    at full speed, paths with acceleration and braking replace edges, within a lane or several lanes in a straight line.
    """
    mission = ground.mission
    places = [tuple(place) for place in positions(lanes).tolist()]
    names = [node.name for node in lanes.nodes]
    ways = [(lane.source, lane.target, _slowest(lanes.length(lane), lane.speed, lane.duration)) for lane in lanes.lanes]
    for agent in ground.agents:
        for place in agent.ends:
            if place.point is None or place.point in places:
                continue
            node = joined_to(mission, agent, lanes, place.point)
            if node is None:
                return NoRoadmap(f"no lane near the position of `{agent.name}`")
            if math.dist(place.point, places[node]) <= SAME:
                places[node] = place.point
                continue
            names.append(f"({', '.join(f'{value:g}' for value in place.point)})")
            ways += [(len(places), node, 0.0), (node, len(places), 0.0)]
            places.append(place.point)
    nodes = States(np.array(places), np.zeros((len(places), mission.dimension)))
    edges = _edges(ground, nodes, sorted(ways))
    return nodes, edges, tuple(names), _flown(ground, lanes, nodes, edges, ways)


def _flown(
    ground: Ground, lanes: Lanes, nodes: States, edges: Edges, ways: list[tuple[int, int, float]]
) -> tuple[Way, ...] | None:
    """Paths on the edges that the vehicles can fly; None if they can start at full speed, or never reach it."""
    agent, step, most = ground.agents[0], float(ground.mission.step), ground.mission.steps
    limits = step_limits(agent, step)
    if limits is None or not BETWEEN_RESTS * limits.rest < agent.dynamics.top_speed <= limits.speed * (1 + SLACK):
        return None
    if math.isfinite(turn_in_step(agent.dynamics, step)) or not can_wait(agent.dynamics):
        return None
    able = set(zip(edges.source.tolist(), edges.target.tolist(), strict=True))
    speed = {(lane.source, lane.target): lane.speed for lane in lanes.lanes}
    alone = [(source, target, speed.get((source, target), math.inf), least) for source, target, least in ways]
    runs = [
        (lanes.lanes[run[0]].source, lanes.lanes[run[-1]].target, lanes.lanes[run[0]].speed, 0.0)
        for run in straight_runs(lanes)
        if able.issuperset((lanes.lanes[each].source, lanes.lanes[each].target) for each in run)
    ]
    found = []
    for source, target, top, least in sorted([*(each for each in alone if each[:2] in able), *runs]):
        start, way = nodes.position[source], nodes.position[target] - nodes.position[source]
        length, fewest = float(np.linalg.norm(way)), math.ceil(least / step - ROUNDING)
        along = flown_way(length, limits, step, min(top, agent.dynamics.top_speed), fewest, most)
        if along is not None and length > 0:
            path = start + np.array(along)[:, None] / length * way
            path[-1] = nodes.position[target]
            found.append((source, target, path))
    return tuple(found)


def _slowest(length: float, speed: float, duration: float) -> float:
    """Minimum duration of a lane at a constant speed within the lane's limits, seconds."""
    return max(length / speed, float(duration))


def _edges(ground: Ground, nodes: States, ways: list[tuple[int, int, float]]) -> Edges:
    peak = 1.5  # ratio of the greatest to the mean speed of the least-effort motion from rest to rest
    dynamics, step, most = ground.agents[0].dynamics, ground.mission.step, max(ground.mission.steps, 1)
    source, target = (np.array([way[end] for way in ways], dtype=np.int64) for end in (0, 1))
    seconds = np.array([way[2] for way in ways]) * (peak if dynamics.has_momentum else 1.0)
    count, bend = steer(dynamics, nodes.take(source), nodes.take(target), step, most)
    slower = np.maximum(count, np.ceil(seconds / step - ROUNDING).astype(np.int64))
    length = np.linalg.norm(nodes.position[target] - nodes.position[source], axis=1)
    able = (count > 0) & (slower <= most) & (slower * dynamics.lowest_speed * step * (1 - SLACK) <= length)
    edges = Edges(source, target, slower, bend).take(able)
    return edges.take(are_clear(ground, nodes, edges))
