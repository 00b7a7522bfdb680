"""Time-expanded roadmap: edges of several steps as one-step moves, with a state at every intermediate step.

    in   nodes and Edges
    out  Unrolled: states, headings and moves; state i is node i for every node

If turning is bounded, a state also has a heading, that of the motion which ended in it. Every edge has its own arrival
state, with continuations that turn little enough. Node i then stands for an agent with an arbitrary heading, which is
possible only at the mission's start. If waiting is allowed, a ring of headings at each node lets an agent turn at the
node, within its limit per step. If a mission uses headings, the ring includes them, also for agents with unbounded
turning.

Source:
    [strel] Algorithm 1, lines 7-9.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from missionc.backends.smt.roadmap.edges import Edges, paths
from missionc.base.late_dataclass import Record
from missionc.base.trace import Array, Flags, Indices
from missionc.geometry.dynamics import States, can_wait, headings_along, turn_in_step
from missionc.geometry.vectors import distinct
from missionc.ir import Beacon, Dynamics


class Unrolled(Record, eq=False):
    """All possible states of an agent at a step, and its one-step moves.

    Args:
        states: nodes, then states within and at the ends of edges.
        heading: (states,), rad; NaN if arbitrary.
        moves: states from and to, (moves, 2), sorted, distinct.
    """

    states: States
    heading: Array
    moves: Indices


def unroll(
    dynamics: Dynamics,
    nodes: States,
    edges: Edges,
    step: float,
    slow: Sequence[tuple[int, Array]] = (),
    *,
    fast_too: bool = True,
    one_way: bool = False,
    asked: Sequence[float | Beacon] = (),
    ways: Sequence[tuple[int, int, Array]] = (),
) -> Unrolled:
    """States and one-step moves of a roadmap.

    Args:
        slow: edges and their positions at the steps, (count + 1, dim), metres, at a lower speed; for first-order
            dynamics with unbounded turning.
        fast_too: True if these edges also exist at full speed.
        one_way: True if an edge is not the reverse of another, so that each is unrolled separately.
        asked: directions, rad, and beacons of the requirements: a waiting agent may turn to them.
        ways: one-way paths between nodes with positions at the steps, (count + 1, dim), metres; for first-order
            dynamics with unbounded turning that wait only at nodes.
    """
    limit = turn_in_step(dynamics, step)
    if math.isfinite(limit):
        return _unroll_headings(dynamics, nodes, edges, step, limit, asked)
    if asked and dynamics.faces_ahead and can_wait(dynamics) and not slow:
        return _unroll_headings(dynamics, nodes, edges, step, math.pi, asked)
    symmetric = not dynamics.has_momentum and not one_way
    parts, moves = [nodes], [np.zeros((0, 2), dtype=np.int64)]
    size = len(nodes)
    for edge, path in slow:
        if edges.source[edge] < edges.target[edge]:
            along = size + np.arange(len(path) - 2)
            moves.append(_links(np.concatenate([[edges.source[edge]], along, [edges.target[edge]]])[None]))
            parts.append(States(path[1:-1], np.zeros_like(path[1:-1])))
            size += along.size
    for source, target, path in ways:
        moves.append(_links(np.concatenate([[source], size + np.arange(len(path) - 2), [target]])[None]))
        parts.append(States(path[1:-1], np.zeros_like(path[1:-1])))
        size += len(path) - 2
    under_way = range(len(nodes), size) if ways else range(0)
    kept = np.ones(len(edges), dtype=np.bool_)
    kept[[edge for edge, _ in slow if not fast_too]] = False
    if symmetric:
        edges = edges.take(kept & (edges.source < edges.target))
    for which, position, velocity in paths(dynamics, nodes, edges, step):
        inner = size + np.arange(len(which) * (position.shape[1] - 2)).reshape(len(which), -1)
        chain = np.concatenate([edges.source[which, None], inner, edges.target[which, None]], axis=1)
        moves.append(_links(chain))
        parts.append(_listed(position[:, 1:-1], velocity[:, 1:-1]))
        size += inner.size
    states = _joined(parts)
    if symmetric:
        moves += [move[:, ::-1] for move in moves]
    waits = _waits(dynamics, states)
    moves.append(waits[~np.isin(waits[:, 0], under_way)])
    return Unrolled(states, np.full(size, np.nan), _sorted(moves))


def _unroll_headings(
    dynamics: Dynamics, nodes: States, edges: Edges, step: float, limit: float, asked: Sequence[float | Beacon]
) -> Unrolled:
    parts, headings, moves = [nodes], [np.full(len(nodes), np.nan)], [np.zeros((0, 2), dtype=np.int64)]
    size = len(nodes)
    first, last = np.zeros(len(edges), dtype=np.int64), np.zeros(len(edges), dtype=np.int64)
    leaving, arriving = np.zeros(len(edges)), np.zeros(len(edges))
    for which, position, velocity in paths(dynamics, nodes, edges, step):
        count = position.shape[1] - 1
        chain = size + np.arange(len(which) * count).reshape(len(which), count)
        start, end = nodes.take(edges.source[which]), nodes.take(edges.target[which])
        heading = headings_along(start, end, count, edges.bend[which])
        parts.append(_listed(position[:, 1:], velocity[:, 1:]))
        headings.append(heading.ravel())
        moves.append(_links(chain))
        first[which], last[which] = chain[:, 0], chain[:, -1]
        leaving[which], arriving[which] = heading[:, 0], heading[:, -1]
        size += chain.size
    moves.append(np.stack([edges.source, first], axis=1))
    into, out = _pairs(edges.target, edges.source, len(nodes))
    moves.append(np.stack([last[into], first[out]], axis=1)[_turns(arriving[into], leaving[out]) <= limit])
    if can_wait(dynamics):
        spoke = _spokes(nodes, limit, asked)
        slots = spoke.shape[1]
        ring = size + np.arange(len(nodes) * slots).reshape(len(nodes), slots)
        parts.append(nodes.take(np.repeat(np.arange(len(nodes)), slots)))
        headings.append(spoke.ravel())
        around = np.stack([ring.ravel(), np.roll(ring, 1, axis=1).ravel()], axis=1)
        moves += [around, around[:, ::-1]]
        if asked:
            node, slot, other = np.nonzero(_turns(spoke[:, :, None], spoke[:, None, :]) <= limit)
            moves.append(np.stack([ring[node, slot], ring[node, other]], axis=1))
            moves.append(np.stack([np.repeat(np.arange(len(nodes)), slots), ring.ravel()], axis=1))
        edge, slot = np.nonzero(_turns(arriving[:, None], spoke[edges.target]) <= limit)
        moves.append(np.stack([last[edge], ring[edges.target[edge], slot]], axis=1))
        edge, slot = np.nonzero(_turns(leaving[:, None], spoke[edges.source]) <= limit)
        moves.append(np.stack([ring[edges.source[edge], slot], first[edge]], axis=1))
    states = _joined(parts)
    return Unrolled(states, np.concatenate(headings), _sorted([*moves, _waits(dynamics, states)]))


def _spokes(nodes: States, limit: float, asked: Sequence[float | Beacon]) -> Array:
    """Headings of the states at each node, (nodes, slots), rad, in circular order, no further apart than ``limit``."""
    spoke = np.linspace(0.0, 2 * math.pi, math.ceil(2 * math.pi / limit), endpoint=False, dtype=np.float64)
    parts: list[Array] = [np.tile(spoke, (len(nodes), 1))]
    for towards in asked:
        if isinstance(towards, Beacon):
            way = np.array(towards.position[:2]) - nodes.position[:, :2]
            parts.append(np.arctan2(way[:, 1], way[:, 0])[:, None])
        else:
            parts.append(np.full((len(nodes), 1), towards))
    return np.asarray(np.sort(np.concatenate(parts, axis=1) % (2 * math.pi), axis=1))


def _links(chain: Indices) -> Indices:
    """Moves along chains of states, (chains, states): (moves, 2)."""
    return np.stack([chain[:, :-1].ravel(), chain[:, 1:].ravel()], axis=1)


def _listed(position: Array, velocity: Array) -> States:
    """States of paths, (paths, states, dim), metres and m/s, as one list, path by path."""
    dimension = position.shape[-1]
    return States(position.reshape(-1, dimension), velocity.reshape(-1, dimension))


def _pairs(into: Indices, out: Indices, nodes: int) -> tuple[Indices, Indices]:
    """Pairs of edges such that the first ends and the second starts at the same node; ``out`` is sorted."""
    begin = np.searchsorted(out, np.arange(nodes + 1))
    many = np.diff(begin)[into]
    before = np.cumsum(many) - many
    first = np.repeat(np.arange(len(into)), many)
    return first, np.repeat(begin[into], many) + np.arange(many.sum()) - np.repeat(before, many)


def _turns(before: Array, after: Array) -> Array:
    """Angles between headings, (...), rad, in [0, pi]."""
    turns: Array = np.abs((after - before + math.pi) % (2 * math.pi) - math.pi)
    return turns


def _waits(dynamics: Dynamics, states: States) -> Indices:
    """Moves from each state at rest to itself, (moves, 2), if the dynamics allow waiting."""
    resting: Flags = np.all(states.velocity == 0, axis=1) & can_wait(dynamics)
    return np.repeat(np.flatnonzero(resting)[:, None], 2, axis=1)


def _joined(parts: list[States]) -> States:
    return States(np.concatenate([part.position for part in parts]), np.concatenate([part.velocity for part in parts]))


def _sorted(moves: list[Indices]) -> Indices:
    every = np.concatenate(moves)
    return every[distinct(every)[0]]
