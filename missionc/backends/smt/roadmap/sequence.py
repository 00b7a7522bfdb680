"""Sequence of roadmaps to try: a geodesic roadmap, then increasingly fine samples.

in   Mission, its kernel
out  an iterator of Attempts, each built in its turn
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial

import numpy as np

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
from missionc.geometry.dynamics import can_wait
from missionc.ir import Mission
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
