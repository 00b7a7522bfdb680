"""Algorithm 1 of [strel] as printed: independent samples, nearest neighbours, clear segments, one transition per step.

    in   Mission, one agent
    out  its Roadmap, or NoRoadmap

Source:
    [strel] Algorithm 1 and "Multi-agent PRM".
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from missionc.backends.roadmap_graph import RoadmapGraph
from missionc.backends.smt.roadmap.edges import Edges, are_clear
from missionc.backends.smt.roadmap.roadmap import Roadmap
from missionc.backends.smt.roadmap.roadmap_graph import graphs_of
from missionc.backends.smt.roadmap.sample_nodes import Ground, NoRoadmap, free_ground
from missionc.backends.smt.roadmap.unroll import unroll
from missionc.backends.smt.settings import smt_settings
from missionc.base.trace import Array
from missionc.geometry.dynamics import States, steer
from missionc.geometry.sampling import bounds
from missionc.ir import Agent, Mission
from missionc.ir.distances.signed_distance import signed_distance


def published_graphs(mission: Mission, seed: int) -> tuple[RoadmapGraph, ...] | NoRoadmap:
    """Roadmap graphs of the published method with this seed, one for each agent."""
    prms = build_prms(mission, np.random.default_rng(seed))
    return prms if isinstance(prms, NoRoadmap) else graphs_of(mission, prms)


def build_prms(mission: Mission, generator: np.random.Generator) -> tuple[Roadmap, ...] | NoRoadmap:
    """Roadmap of each agent, in mission order, with the mission's numbers of states and neighbours."""
    settings = smt_settings(mission)
    prms: list[Roadmap] = []
    for agent in mission.agents:
        prm = build_prm(mission, agent, settings.roadmap.nodes, settings.paper.neighbors, generator)
        if isinstance(prm, NoRoadmap):
            return prm
        prms.append(prm)
    return tuple(prms)


def build_prm(
    mission: Mission, agent: Agent, count: int, neighbours: int, generator: np.random.Generator
) -> Roadmap | NoRoadmap:
    """Roadmap of one agent by Algorithm 1 of [strel].

    Obstacles are grown by the agent's radius and the clearance, so that in configuration space the agent is the paper's
    point. STEER moves straight, in the fewest steps within the speeds, and arrives exactly, so that ε is 0. The
    intermediate states, which Algorithm 1 omits from S, are states here. An agent that can wait may do so in each
    state, since STEER leads from a state to itself.

    Args:
        count: P, number of random states, besides samples of the start.
        neighbours: k, nearest states in metres, reachable by STEER or not.
    """
    ground = free_ground(mission, (agent,))
    low, high = np.array(mission.world.low), np.array(mission.world.high)
    free = _draw(ground, low, high, count, generator)
    start = _start_set(ground, agent, generator)
    if len(free) < count or len(start) == 0:
        where = f"the start of `{agent.name}`" if len(start) == 0 else "free space"
        return NoRoadmap(f"no samples were found in {where}")
    position = np.concatenate([start, free])
    nodes = States(position, np.zeros_like(position))
    edges = _edges(ground, nodes, neighbours)
    whole = unroll(agent.dynamics, nodes, edges, mission.step, one_way=True)
    states, moves = len(whole.states), len(whole.moves)
    begins = np.arange(len(start))
    if agent.start.region is not None:
        begins = np.flatnonzero(np.asarray(signed_distance(np, agent.start.shape, position)) <= 0)
    return Roadmap(
        agents=(agent.index,),
        position=whole.states.position,
        velocity=whole.states.velocity,
        heading=whole.heading,
        moves=whole.moves,
        standing=np.ones((mission.steps + 1, states), dtype=np.bool_),
        allowed=np.ones((mission.steps, moves), dtype=np.bool_),
        starts=(begins,),
        finishes=(np.arange(states),),
        nodes=nodes,
        edges=edges,
    )


def _start_set(ground: Ground, agent: Agent, generator: np.random.Generator) -> Array:
    """Samples of the agent's start set: (samples, dim), metres."""
    settings = smt_settings(ground.mission).paper
    if agent.start.point is not None:
        point = np.array([agent.start.point])
        return point[ground.is_free(point)]
    shape = agent.start.shape
    low, high = bounds(shape, ground.mission.world)
    points = _draw(ground, np.array(low), np.array(high), settings.start_samples * settings.draws, generator)
    return points[np.asarray(signed_distance(np, shape, points)) <= 0][: settings.start_samples]


def _draw(ground: Ground, low: Array, high: Array, count: int, generator: np.random.Generator) -> Array:
    """Independent uniform free points of a box: (count, dim), metres, or fewer if most of the box is blocked.

    Args:
        low: lowest corner of the box, (dim,), metres; ``high``: highest corner.
    """
    points = np.zeros((0, len(low)))
    for _ in range(smt_settings(ground.mission).paper.draws):
        if len(points) >= count:
            break
        drawn = generator.uniform(low, high, (count, len(low)))
        points = np.concatenate([points, drawn[ground.is_free(drawn)]])
    return points[:count]


def _edges(ground: Ground, nodes: States, neighbours: int) -> Edges:
    """Edges from each node to its nearest neighbours that STEER reaches along a clear segment."""
    mission, count = ground.mission, len(nodes)
    nearest = cKDTree(nodes.position).query(nodes.position, min(neighbours + 1, count))[1].reshape(count, -1)
    source, target = np.repeat(np.arange(count), nearest.shape[1]), nearest.ravel()
    other = source != target
    source, target = source[other], target[other]
    steps, bend = steer(ground.agents[0].dynamics, nodes.take(source), nodes.take(target), mission.step, mission.steps)
    edges = Edges(source, target, steps, bend).take(steps > 0)
    return edges.take(are_clear(ground, nodes, edges))
