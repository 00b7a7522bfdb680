"""A roadmap of the user's own: exactly its nodes and lanes, and ways to the exact places beside them.

in   Ground, Lanes
out  nodes and their Edges, and the names of the nodes
"""

from __future__ import annotations

import math

import numpy as np

from missionc.backends.smt.roadmap.edges import Edges, are_clear
from missionc.backends.smt.roadmap.sample_nodes import Ground, NoRoadmap
from missionc.ir import Exactly, Lanes
from missionc.world.dynamics import SLACK, States, steer
from missionc.world.lane_room import SAME, joined_to, positions

PEAK = 1.5
"""From rest to rest by the least effort, the fastest moment has so many times the mean speed."""

ROUNDING = 1e-9
"""A lane is not given a step more for this share of one."""


def lane_roadmap(ground: Ground, lanes: Lanes) -> tuple[States, Edges, tuple[str, ...]] | NoRoadmap:
    """Its nodes and edges for one kind of agent; a lane that such agents cannot go, as too short for their least speed,
    is left out.

    An exact place that is no node is one more, joined to the nearest node that a straight clear way leads to, there
    and back.
    """
    mission = ground.mission
    places = [tuple(place) for place in positions(lanes).tolist()]
    names = [node.name for node in lanes.nodes]
    ways = [(lane.source, lane.target, _slowest(lanes.length(lane), lane.speed, lane.duration)) for lane in lanes.lanes]
    for agent in ground.agents:
        for place in (agent.start, agent.finish):
            if not isinstance(place, Exactly) or place.point in places:
                continue
            node = joined_to(mission, agent, lanes, place.point)
            if node is None:
                return NoRoadmap(f"no lane is near the place of `{agent.name}`")
            if math.dist(place.point, places[node]) <= SAME:
                places[node] = place.point
                continue
            names.append(f"({', '.join(f'{value:g}' for value in place.point)})")
            ways += [(len(places), node, 0.0), (node, len(places), 0.0)]
            places.append(place.point)
    nodes = States(np.array(places), np.zeros((len(places), mission.dimension)))
    return nodes, _edges(ground, nodes, sorted(ways)), tuple(names)


def _slowest(length: float, speed: float, duration: float) -> float:
    """The seconds that a lane takes at least, by its own limits, at an even pace."""
    return max(length / speed, float(duration))


def _edges(ground: Ground, nodes: States, ways: list[tuple[int, int, float]]) -> Edges:
    dynamics, step, most = ground.agents[0].dynamics, ground.mission.step, max(ground.mission.steps, 1)
    source, target = (np.array([way[end] for way in ways], dtype=np.int64) for end in (0, 1))
    seconds = np.array([way[2] for way in ways]) * (PEAK if dynamics.has_momentum else 1.0)
    count, bend = steer(dynamics, nodes.take(source), nodes.take(target), step, most)
    slower = np.maximum(count, np.ceil(seconds / step - ROUNDING).astype(np.int64))
    length = np.linalg.norm(nodes.position[target] - nodes.position[source], axis=1)
    able = (count > 0) & (slower <= most) & (slower * dynamics.lowest_speed * step * (1 - SLACK) <= length)
    edges = Edges(source, target, slower, bend).take(able)
    return edges.take(are_clear(ground, nodes, edges))
