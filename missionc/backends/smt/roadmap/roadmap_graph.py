"""Roadmaps as values for inspection, and the first roadmap of a mission, without solving."""

from __future__ import annotations

import numpy as np

from missionc.backends.roadmap_graph import RoadmapEdge, RoadmapGraph
from missionc.backends.smt.roadmap.edges import paths
from missionc.backends.smt.roadmap.roadmap import NoRoadmap, Roadmap
from missionc.backends.smt.roadmap.sequence import roadmaps_to_try
from missionc.base.trace import Flags
from missionc.geometry.dynamics import States
from missionc.ir import Mission
from missionc.ir.distances.signed_distance import signed_distance
from missionc.ir.kernel.nodes import Kernel


def first_graphs(mission: Mission, kernel: Kernel, seed: int) -> tuple[RoadmapGraph, ...] | NoRoadmap:
    """First roadmaps that can be built, one graph for each kind of agent; or the reason why there is none."""
    missing = NoRoadmap("there is no agent")
    for attempt in roadmaps_to_try(mission, kernel, seed):
        built = attempt.build()
        if not isinstance(built, NoRoadmap):
            return graphs_of(mission, built)
        missing = built
    return missing


def graphs_of(mission: Mission, roadmaps: tuple[Roadmap, ...]) -> tuple[RoadmapGraph, ...]:
    """Graph of each roadmap, with its nodes and edges before unrolling over time."""
    return tuple(_graph(mission, roadmap) for roadmap in roadmaps)


def _graph(mission: Mission, roadmap: Roadmap) -> RoadmapGraph:
    nodes, edges = roadmap.nodes, roadmap.edges
    regions = [
        (region.name, np.asarray(signed_distance(np, region.shape, nodes.position)) <= 0) for region in mission.regions
    ]
    starts: list[list[str]] = [[] for _ in range(len(nodes))]
    for index, places in zip(roadmap.agents, roadmap.starts, strict=True):
        there = (nodes.position[:, None] == roadmap.position[places]).all(axis=-1).any(axis=1)
        for node in np.flatnonzero(there & ~nodes.velocity.any(axis=1)).tolist():
            starts[node].append(mission.agents[index].name)
    return RoadmapGraph(
        agents=tuple(mission.agents[index].name for index in roadmap.agents),
        names=roadmap.names or tuple(map(str, range(len(nodes)))),
        position=nodes.position,
        velocity=nodes.velocity,
        labels=tuple(tuple(name for name, inside in regions if inside[node]) for node in range(len(nodes))),
        starts=tuple(map(tuple, starts)),
        edges=_edges(mission, roadmap, nodes, edges.bend == 0),
    )


def _edges(mission: Mission, roadmap: Roadmap, nodes: States, even: Flags) -> tuple[RoadmapEdge, ...]:
    dynamics, edges = mission.agents[roadmap.agents[0]].dynamics, roadmap.edges
    straight = even & (not dynamics.has_momentum)
    found: dict[tuple[int, int, int, int], RoadmapEdge] = {}
    for which, position, _ in paths(dynamics, nodes, edges, mission.step):
        lengths = np.linalg.norm(np.diff(position, axis=1), axis=-1).sum(axis=-1)
        for edge, path, length in zip(which.tolist(), position, lengths.tolist(), strict=True):
            source, target, steps = int(edges.source[edge]), int(edges.target[edge]), int(edges.count[edge])
            kept = path[[0, -1]] if straight[edge] else path
            found[source, target, steps, edge] = RoadmapEdge(source, target, steps, length, kept)
    return tuple(found[key] for key in sorted(found))
