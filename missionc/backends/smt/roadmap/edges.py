"""Roadmap edges: motions of several steps between nodes, and their collision check against static obstacles.

Source:
    [strel] Algorithm 1, lines 6 and 7.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from missionc.backends.smt.roadmap.sample_nodes import Ground
from missionc.base.late_dataclass import Record
from missionc.base.trace import Array, Flags, Indices
from missionc.geometry.clearance import clear_motions, clear_of
from missionc.geometry.dynamics import Motions, States, motions_between, path_between
from missionc.ir import Dynamics


class Edges(Record, eq=False):
    """Directed edges of a roadmap: motions of several steps between nodes.

    Args:
        source: node at the start of each edge, (edges,); ``target``: node at its end.
        count: number of steps, (edges,), at least 1.
        bend: left turn between steps, (edges,), rad; 0 for straight edges.
    """

    source: Indices
    target: Indices
    count: Indices
    bend: Array

    def take(self, which: Indices | Flags) -> Edges:
        """Edges selected by indices, (taken,), or by flags, (edges,)."""
        return Edges(self.source[which], self.target[which], self.count[which], self.bend[which])

    def __len__(self) -> int:
        return len(self.source)


NONE = Edges(np.zeros(0, np.int64), np.zeros(0, np.int64), np.zeros(0, np.int64), np.zeros(0))


def joined(parts: list[Edges]) -> Edges:
    """All edges of several parts, one after the other."""
    return Edges(
        np.concatenate([part.source for part in parts]),
        np.concatenate([part.target for part in parts]),
        np.concatenate([part.count for part in parts]),
        np.concatenate([part.bend for part in parts]),
    )


def paths(dynamics: Dynamics, nodes: States, edges: Edges, step: float) -> Iterator[tuple[Indices, Array, Array]]:
    """Yield the edges with equal numbers of steps: their indices, and positions and velocities at their steps, (edges,
    count + 1, dim).

    Positions are in metres, velocities in m/s.
    """
    for count in np.unique(edges.count):
        which = np.flatnonzero(edges.count == count)
        start, end = nodes.take(edges.source[which]), nodes.take(edges.target[which])
        yield which, *path_between(dynamics, start, end, step, int(count), edges.bend[which])


def are_clear(ground: Ground, nodes: States, edges: Edges) -> Flags:
    """Return true for each edge, (edges,), that stays in the world and clear of static obstacles."""
    dynamics, step, world = ground.agents[0].dynamics, ground.mission.step, ground.mission.world
    clear = np.zeros(len(edges), dtype=bool)
    straight = np.zeros(len(edges), dtype=bool) if dynamics.has_momentum else edges.bend == 0
    start, end = nodes.position[edges.source[straight]], nodes.position[edges.target[straight]]
    clear[straight] = clear_of(ground.obstacles, start, end, np.full(len(start), ground.margin))
    others = np.flatnonzero(~straight)
    for which, position, velocity in paths(dynamics, nodes, edges.take(others), step):
        before, after = (
            States(position[:, some].reshape(-1, world.dimension), velocity[:, some].reshape(-1, world.dimension))
            for some in (slice(None, -1), slice(1, None))
        )
        motions = motions_between(dynamics, before, after, step)
        least, most = _extent(motions, step)
        free = np.all((least >= world.low) & (most <= world.high), axis=1)
        free &= clear_motions(ground.obstacles, motions, step, ground.margin)
        clear[others[which]] = free.reshape(len(which), -1).all(axis=1)
    return clear


def _extent(motions: Motions, step: float) -> tuple[Array, Array]:
    """Bounding box of each motion of one step: least and largest coordinates, (motions, dim) each, metres."""
    bend = np.where(motions.acceleration == 0, 1.0, motions.acceleration)
    turning = np.clip(np.where(motions.acceleration == 0, 0.0, -motions.velocity / bend), 0.0, step)
    extreme = motions.position + motions.velocity * turning + motions.acceleration * (turning * turning / 2)
    ends = np.stack([motions.position, motions.at(step), extreme])
    return ends.min(axis=0), ends.max(axis=0)
