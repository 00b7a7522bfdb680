"""Roadmaps as values for inspection, and the first roadmap of a mission, without solving.

Sequence of roadmaps to try: a geodesic roadmap, then increasingly fine samples.

in   Mission, its kernel
out  an iterator of Attempts, each built in its turn
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial

import numpy as np

from missionc.backends.roadmap_graph import RoadmapEdge, RoadmapGraph
from missionc.backends.smt.roadmap.edges import paths
from missionc.backends.smt.roadmap.roadmap import (
    NoRoadmap,
    Roadmap,
    build_geodesic_roadmaps,
    build_lane_roadmaps,
    build_relay_roadmaps,
    build_roadmaps,
)
from missionc.backends.smt.settings import smt_settings
from missionc.base.late_dataclass import Record
from missionc.base.trace import Flags
from missionc.geometry.dynamics import States, can_wait
from missionc.ir import Mission
from missionc.ir.distances.signed_distance import signed_distance
from missionc.ir.kernel.nodes import Atom, Kernel, NeighbourNode, PathLength, ReachNode, RouteNode
from missionc.ir.kernel.walk import postorder


class Attempt(Record, eq=False):
    """Attempt with one roadmap.

    Args:
        number: index from 1.
        nodes: number of sampled nodes; 0 for a geodesic roadmap.
        build: function that builds the roadmap for each kind of agent.
    """

    number: int
    nodes: int
    build: Callable[[], tuple[Roadmap, ...] | NoRoadmap]

    @property
    def sampled(self) -> bool:
        return self.nodes > 0


def roadmaps_to_try(mission: Mission, kernel: Kernel, seed: int, sampled: int | None = None) -> Iterator[Attempt]:
    """Yield the roadmaps of a mission, in the order of attempts.

    A mission with its own roadmap has only that roadmap, and a mission with ``nodes`` only one sampled roadmap of this
    size. Otherwise the geodesic roadmap comes first, or second if agents must be linked, which needs nodes everywhere.
    Samples are denser in passages.

    Args:
        seed: equal seeds give equal arrays.
        sampled: maximum number of sampled roadmaps; None for the number in the settings.
    """
    lanes = mission.solve.roadmap
    if lanes is not None:
        yield Attempt(1, len(lanes.nodes), partial(build_lane_roadmaps, mission, lanes))
        return
    settings = smt_settings(mission).roadmap
    order: list[int | None] = [*range(settings.attempts if sampled is None else sampled)]
    if settings.adaptive and _has_geodesics(mission):
        order.insert(1 if is_linked(kernel) else 0, None)
    for number, finer in enumerate(order, 1):
        if finer is None:
            generator = np.random.default_rng(seed)
            yield Attempt(number, 0, partial(build_geodesic_roadmaps, mission, kernel, generator))
        else:
            nodes = round(settings.nodes * settings.growth**finer)
            generator = np.random.default_rng([seed, finer])
            sample = partial(build_roadmaps, mission, nodes, settings.neighbors, generator)
            yield Attempt(number, nodes, partial(sample, passages=settings.adaptive, kernel=kernel))


def roadmaps_between_samples(
    mission: Mission, kernel: Kernel, seed: int, roadmaps: tuple[Roadmap, ...]
) -> Iterator[Attempt]:
    """Roadmaps for requirements that fail between the samples of a plan on ``roadmaps``.

    For linked agents, rows of relays come first.
    """
    nodes = sum(len(roadmap.nodes) for roadmap in roadmaps)
    if mission.solve.roadmap is None and is_linked(kernel):
        generator = np.random.default_rng(seed)
        neighbours = smt_settings(mission).roadmap.neighbors
        yield Attempt(1, nodes, partial(build_relay_roadmaps, mission, kernel, neighbours, generator))
    yield Attempt(2, nodes, lambda: roadmaps)


def _has_geodesics(mission: Mission) -> bool:
    """Return true if straight paths with stops suit every agent: no momentum, and each can wait."""
    return all(can_wait(agent.dynamics) and not agent.dynamics.has_momentum for agent in mission.agents)


def is_linked(kernel: Kernel) -> bool:
    """Return true if links or formations are required, which need nodes everywhere."""
    nodes = postorder(kernel.formulas)
    atoms = (node.predicate for node in nodes if isinstance(node, Atom))
    return any(isinstance(node, NeighbourNode | ReachNode | RouteNode | PathLength) for node in nodes) or any(
        each.graph or each.formation for each in atoms
    )


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
