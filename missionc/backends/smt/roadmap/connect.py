"""Roadmap connection: each node joined to its nearest steerable neighbours, both ways, and components to each other.

    in   Ground, nodes
    out  Edges, each a whole number of steps long and clear of all that stands still

With speeds of 1..2 m/s the nearest nodes of all are too near to be flown to in
a step, so that the neighbours asked for are the nearest *steerable* ones.

Source:
    [strel] Algorithm 1, lines 3-9.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from missionc.backends.smt.roadmap.edges import NONE, Edges, are_clear, joined
from missionc.backends.smt.roadmap.sample_nodes import Ground
from missionc.backends.smt.roadmap.unique_rows import distinct
from missionc.backends.smt.settings import smt_settings
from missionc.base.memory import reserve
from missionc.base.trace import Array, Flags
from missionc.geometry.dynamics import States, can_wait, speeds, steer, turn_in_step

Indices = NDArray[np.int64]

MOST_LOOKED = 256
"""No node looks at more neighbours than these."""

FOREVER = np.iinfo(np.int64).max
"""Steps to where there is no way."""


def connect(ground: Ground, nodes: States, mirror: Indices, neighbours: int) -> Edges:
    """The edges of a roadmap, sorted by source and target; with each also its way back.

    Args:
        nodes: the nodes; those of first-order dynamics have velocity 0.
        mirror: (nodes,), the node at the same place with the opposite velocity.
        neighbours: how many each node looks for; half of them a good stride
            off, where there are such.
    """
    if len(nodes) < 2:
        return NONE
    forward = [part for side in _sides(ground) for part in _search(ground, nodes, neighbours, side)]
    edges = both_ways(forward, mirror)
    for _ in range(smt_settings(ground.mission).roadmap.join_rounds):
        joints = _join(ground, nodes, edges)
        if len(joints) == 0:
            break
        edges = both_ways([edges, joints], mirror)
    return edges


def _sides(ground: Ground) -> tuple[int, ...]:
    """How nodes are steered to each other: straight, and along arcs where straight ways alone are too few.

    They are where an agent that has to keep going may turn little in a step, and
    where it has but one speed, so that few distances are a whole number of steps.
    """
    flexible = 1.05  # ratio of top to least speed, above which nearly every distance takes a whole number of steps
    dynamics = ground.agents[0].dynamics
    slowest, fastest = speeds(dynamics)
    agile = turn_in_step(dynamics, ground.mission.step) >= math.pi / 2 and fastest > flexible * slowest
    return (0,) if can_wait(dynamics) or agile else (0, 1, -1)


def _stride(ground: Ground) -> float:
    """A good way to go at a time, metres: half a step at top speed, and far enough to come to speed and to stop."""
    dynamics, world = ground.agents[0].dynamics, ground.mission.world
    stride = speeds(dynamics)[1] * ground.mission.step / 2
    extent = float(np.min(np.subtract(world.high, world.low)[:2]))
    return max(stride, min(dynamics.top_speed**2 / dynamics.top_acceleration, extent / 4))


def _search(ground: Ground, nodes: States, neighbours: int, side: int) -> list[Edges]:
    """Each node's edges to its nearest steerable neighbours."""
    first_look = 4  # candidates for each neighbour at first; doubled while they are too few
    block_size = 1 << 19  # pairs of nodes in one array
    tree, rows = cKDTree(nodes.position), np.arange(len(nodes))
    look = (
        first_look * neighbours * (3 if ground.agents[0].dynamics.has_momentum else 1)
    )  # up to three nodes share a place
    batches: list[Edges] = []
    while len(rows):
        look = min(look, len(nodes) - 1, MOST_LOOKED)
        left: list[Indices] = []
        for begin in range(0, len(rows), max(1, block_size // look)):
            block = rows[begin : begin + max(1, block_size // look)]
            picked, enough = _pick(ground, nodes, tree, block, look, neighbours, side)
            if look == min(len(nodes) - 1, MOST_LOOKED):
                enough[:] = True
            batches.append(picked.take(np.isin(picked.source, block[enough])))
            left.append(block[~enough])
        rows, look = np.concatenate(left), 2 * look
    return batches


def _pick(
    ground: Ground, nodes: States, tree: cKDTree, rows: Indices, look: int, neighbours: int, side: int
) -> tuple[Edges, Flags]:
    """The edges of some nodes among their ``look`` nearest, and which of the nodes, (rows,), have enough."""
    distance, target = _nearest(tree, nodes.position[rows], look + 1)
    pairs = _steered(ground, nodes, np.repeat(rows, look + 1), target.ravel(), side)
    able = np.flatnonzero((pairs.count > 0) & (pairs.source != pairs.target))
    able = able[are_clear(ground, nodes, pairs.take(able))]
    steps = np.full(target.size, FOREVER)
    steps[able] = pairs.count[able]
    order = np.argsort(steps.reshape(target.shape), axis=1, kind="stable")
    steps = np.take_along_axis(steps.reshape(target.shape), order, axis=1)
    distance = np.take_along_axis(distance, order, axis=1)

    usable = steps < FOREVER
    quick = usable.copy()
    if not ground.agents[0].dynamics.has_momentum:
        quick &= steps <= smt_settings(ground.mission).roadmap.detour_steps * steps[:, :1]
    striding = quick & (distance >= _stride(ground))
    half = (neighbours + 1) // 2
    chosen = striding & (np.cumsum(striding, axis=1) <= half)
    others = quick & ~chosen
    chosen |= others & (np.cumsum(others, axis=1) <= neighbours - chosen.sum(axis=1, keepdims=True))
    slower = usable & ~quick
    chosen |= slower & (np.cumsum(slower, axis=1) <= half - chosen.sum(axis=1, keepdims=True))
    row, column = np.nonzero(chosen)
    return pairs.take(row * (look + 1) + order[row, column]), chosen.sum(axis=1) >= half


def _steered(ground: Ground, nodes: States, source: Indices, target: Indices, side: int) -> Edges:
    """Pairs of nodes as edges, clear or not; of 0 steps where there is no way."""
    dynamics, most = ground.agents[0].dynamics, max(ground.mission.steps, 1)
    return Edges(
        source, target, *steer(dynamics, nodes.take(source), nodes.take(target), ground.mission.step, most, side)
    )


def both_ways(forward: list[Edges], mirror: Indices) -> Edges:
    """All edges found and the ways back, each once: a way back takes the same steps and bends to the other side."""
    back = [Edges(mirror[edges.target], mirror[edges.source], edges.count, -edges.bend) for edges in forward]
    both = joined([*forward, *back])
    names = np.stack([both.source, both.target, np.sign(both.bend).astype(np.int64)], axis=1)
    first, _ = distinct(names)
    return both.take(first)


def _join(ground: Ground, nodes: States, edges: Edges) -> Edges:
    """For every part but the largest, the quickest few edges to the largest."""
    pair_bytes = 200  # memory of one pair of nodes, about
    links = coo_array((np.ones(len(edges)), (edges.source, edges.target)), shape=(len(nodes), len(nodes)))
    parts, part = connected_components(links, directed=False)
    if parts == 1:
        return NONE
    largest = np.argmax(np.bincount(part))
    inside, outside = np.flatnonzero(part == largest), np.flatnonzero(part != largest)
    look = min(len(inside), MOST_LOOKED)
    reserve(len(outside) * look * pair_bytes, f"{len(outside)} nodes that nothing leads to, with {look} others each,")
    distance, near = _nearest(cKDTree(nodes.position[inside]), nodes.position[outside], look)
    pairs = _steered(ground, nodes, np.repeat(outside, look), inside[near.ravel()], 0)
    order = np.lexsort((distance.ravel(), pairs.count, part[pairs.source]))
    pairs = pairs.take(order[pairs.count[order] > 0])
    pairs = pairs.take(are_clear(ground, nodes, pairs))
    _, first, many = np.unique(part[pairs.source], return_index=True, return_counts=True)
    return pairs.take(np.arange(len(pairs)) - np.repeat(first, many) < smt_settings(ground.mission).roadmap.joins)


def _nearest(tree: cKDTree, points: Array, count: int) -> tuple[Array, Indices]:
    """The distances and numbers of the ``count`` nearest, (points, count), nearest first."""
    distance, which = tree.query(points, k=np.arange(1, count + 1))
    return np.asarray(distance, dtype=np.float64), np.asarray(which, dtype=np.int64)
