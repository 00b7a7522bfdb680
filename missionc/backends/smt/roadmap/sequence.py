"""Sequence of roadmaps to try: shortest ways between what the mission names, then finer and finer samples.

in   Mission, its kernel
out  an iterator of Attempts, each built when its turn comes
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial

import numpy as np

from missionc.backends.smt.roadmap.roadmap import (
    NoRoadmap,
    Roadmap,
    build_geodesic_roadmaps,
    build_lane_roadmaps,
    build_roadmaps,
)
from missionc.backends.smt.settings import smt_settings
from missionc.geometry.dynamics import can_wait
from missionc.ir import Mission
from missionc.ir.kernel.nodes import Atom, Kernel, NeighbourNode, PathLength, ReachNode, RouteNode
from missionc.ir.kernel.walk import postorder


@dataclass(frozen=True, slots=True, eq=False)
class Attempt:
    """One of the roadmaps to try.

    Args:
        number: from 1.
        nodes: how many nodes it is sampled with; 0 of one of shortest ways.
        build: makes it, one for each kind of agent.
    """

    number: int
    nodes: int
    build: Callable[[], tuple[Roadmap, ...] | NoRoadmap]

    @property
    def sampled(self) -> bool:
        return self.nodes > 0


def roadmaps_to_try(mission: Mission, kernel: Kernel, seed: int, sampled: int | None = None) -> Iterator[Attempt]:
    """The roadmaps of a mission, in the order in which they are tried.

    A mission that brings its own has that one alone, and one that says ``nodes``
    gets samples alone, so many and no others. Else the shortest ways come first,
    or second where agents are linked to each other, which asks for places all
    over; and samples are denser in passages.

    Args:
        seed: the same one gives the same arrays.
        sampled: how many sampled roadmaps there are at most; as many as the setting says if left out.
    """
    lanes = mission.solve.roadmap
    if lanes is not None:
        yield Attempt(1, len(lanes.nodes), partial(build_lane_roadmaps, mission, lanes))
        return
    settings = smt_settings(mission).roadmap
    order: list[int | None] = [*range(settings.attempts if sampled is None else sampled)]
    if settings.adaptive and _has_geodesics(mission):
        order.insert(1 if _is_linked(kernel) else 0, None)
    for number, finer in enumerate(order, 1):
        if finer is None:
            generator = np.random.default_rng(seed)
            yield Attempt(number, 0, partial(build_geodesic_roadmaps, mission, kernel, generator))
        else:
            nodes = round(settings.nodes * settings.growth**finer)
            generator = np.random.default_rng([seed, finer])
            sample = partial(build_roadmaps, mission, nodes, settings.neighbors, generator)
            yield Attempt(number, nodes, partial(sample, passages=settings.adaptive, kernel=kernel))


def _has_geodesics(mission: Mission) -> bool:
    """Whether straight ways with stops at their ends suit every agent: none has inertia, and each can stand still."""
    return all(can_wait(agent.dynamics) and not agent.dynamics.has_momentum for agent in mission.agents)


def _is_linked(kernel: Kernel) -> bool:
    """Whether it asks for links between agents, or for formations, which want places all over."""
    nodes = postorder(kernel.formulas)
    atoms = (node.predicate for node in nodes if isinstance(node, Atom))
    return any(isinstance(node, NeighbourNode | ReachNode | RouteNode | PathLength) for node in nodes) or any(
        each.graph or each.formation for each in atoms
    )
