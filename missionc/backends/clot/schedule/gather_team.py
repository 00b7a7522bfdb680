"""Least-squares placement of a team in formation, or within communication range, with its centre fixed (stress
majorization).

A formation with all pairwise distances is first laid flat over the team, rotated or mirrored for the smallest motion.
Then each pair of coupled agents has a target length or offset. All agents move together to the least-squares solution
of these targets, repeatedly.

Source:
    de Leeuw, "Applications of convex analysis to multidimensional scaling", 1977: majorization of stress; here with
    offsets, and with pairs that have only a maximum length. Torgerson, classical scaling, 1952; Schönemann, "A
    generalized solution of the orthogonal Procrustes problem", 1966.
"""

from __future__ import annotations

from collections.abc import Iterable
from itertools import combinations

import numpy as np
from scipy.sparse.csgraph import connected_components, dijkstra

from missionc.base.trace import Array, Flags, Indices
from missionc.ir import Formation, Graph, Predicate
from missionc.ir.couplings import directed, range_of
from missionc.ir.language.margins.connected import spanning_tree
from missionc.ir.language.margins.predicate_margins import link_margin

NEAR = 0.02
"""Accepted deviation from a target length or offset, metres."""


def can_be_gathered(predicate: Predicate) -> bool:
    """Return true if ``gather_team`` supports this predicate: a formation, or a graph with links by distance."""
    return predicate.formation is not None or (predicate.graph is not None and predicate.graph.by_distance)


def gather_team(shapes: Iterable[Predicate], position: Array) -> Array:
    """Positions, (agents, dim), metres, that satisfy all formations and graphs as well as possible; unchanged if
    satisfied.

    Bodies and obstacles are ignored.

    Args:
        position: positions of all the mission's agents, (agents, dim), metres.
    """
    shaken = 0.01  # metres of noise: two agents in one place have no direction between them
    rounds = 100  # maximum number of moves; each lowers the total error
    shapes = tuple(shapes)
    first, second, least, most, offset = _ties(shapes, position)
    if not len(first):
        return position
    count, dim = position.shape
    row = np.arange(len(first))
    differences = np.zeros((len(first), count))
    differences[row, second], differences[row, first] = 1.0, -1.0
    spread = np.linalg.pinv(differences.T @ differences) @ differences.T  # (agents, ties)
    wishes = least, most, offset
    if _furthest(differences @ position, *wishes) <= NEAR:
        return position
    tied = np.unique(np.concatenate([first, second]))
    moved = _laid(shapes, position)
    moved[tied] += shaken * np.random.default_rng(0).uniform(-1, 1, (len(tied), dim))
    for _ in range(rounds):
        apart = differences @ moved
        if _furthest(apart, *wishes) <= NEAR:
            break
        moved += spread @ (_wished(apart, *wishes) - apart)
    return moved


def tree_of(graph: Graph, position: Array) -> Indices:
    """Links of a graph's maximum spanning tree, (links, 2), from agent to agent; for directed links, the links of both
    trees.

    Args:
        position: positions of all the mission's agents, (agents, dim), metres.
    """
    agents = np.array(graph.agents, dtype=np.int64)
    members = position[agents]
    links = np.asarray(link_margin(graph, agents[:, None], agents, members[:, None], members[None]))
    one, other, _ = spanning_tree(links[None])
    tree: Indices = agents[np.stack([one[0], other[0]], axis=1)]
    if directed(graph):
        one, other, _ = spanning_tree(links.T[None])
        tree = np.unique(np.concatenate([tree, agents[np.stack([other[0], one[0]], axis=1)]]), axis=0)
    return tree


def _laid(shapes: Iterable[Predicate], position: Array) -> Array:
    """Positions, (agents, dim), metres, with each rigid formation laid over its agents."""
    laid = position.copy()
    done: set[int] = set()
    for shape in shapes:
        figure = None if shape.formation is None else _figure(shape.formation)
        if shape.formation is None or figure is None or not done.isdisjoint(shape.formation.agents):
            continue
        agents = list(shape.formation.agents)
        done.update(agents)
        middle = position[agents].mean(axis=0)
        left, _, right = np.linalg.svd(figure.T @ (position[agents, :2] - middle[:2]))
        laid[agents] = middle
        laid[agents, :2] += figure @ left @ right
    return laid


def _figure(formation: Formation) -> Array | None:
    """Positions of a flat formation with all pairwise distances, relative to its centre: (agents, 2), metres; None for
    other formations."""
    flat = 1e-6  # squared thickness of a flat figure over its squared length
    count = len(formation.agents)
    distances = {
        frozenset((edge.first, edge.second)): edge.target
        for edge in formation.edges
        if not isinstance(edge.target, tuple)
    }
    if count < 2 or len(distances) != count * (count - 1) // 2:
        return None
    squares = np.zeros((count, count))
    for one, other in combinations(range(count), 2):
        length = distances[frozenset((formation.agents[one], formation.agents[other]))]
        squares[one, other] = squares[other, one] = length**2
    centred = squares - squares.mean(axis=0)
    sizes, axes = np.linalg.eigh((centred - centred.mean(axis=1, keepdims=True)) / -2)
    if count > 2 and sizes[-3] > flat * sizes[-1]:
        return None
    figure: Array = axes[:, -2:] * np.sqrt(np.maximum(sizes[-2:], 0.0))
    return figure


def _ties(shapes: Iterable[Predicate], position: Array) -> tuple[Indices, Indices, Array, Array, Array]:
    """Constraints on pairs of agents: both agents, (ties,) each, least and greatest distance, (ties,), metres, and
    offset, (ties, dim).

    The offset is NaN for a constraint on the distance only.
    """
    dim = position.shape[1]
    first: list[int] = []
    second: list[int] = []
    least: list[float] = []
    most: list[float] = []
    offset: list[tuple[float, ...]] = []
    none = (np.nan,) * dim
    for shape in shapes:
        graph = shape.restricted
        for edge in shape.formation.edges if shape.formation else ():
            first.append(edge.first)
            second.append(edge.second)
            if isinstance(edge.target, tuple):
                least.append(0.0)
                most.append(np.inf)
                offset.append(edge.target)
            else:
                least.append(edge.target)
                most.append(edge.target)
                offset.append(none)
        if graph is not None and graph.by_distance and len(graph.agents) > 1:
            for one, other in tree_of(graph, position).tolist():
                first.append(one)
                second.append(other)
                least.append(0.0)
                most.append(max(range_of(graph, one, other) - NEAR, 0.0))
                offset.append(none)
    ends = np.array(first, dtype=np.int64), np.array(second, dtype=np.int64)
    return *ends, np.array(least), np.array(most), np.array(offset).reshape(-1, dim)


def _wished(apart: Array, least: Array, most: Array, offset: Array) -> Array:
    """Allowed differences of positions nearest to the given differences ``apart``: (ties, dim), metres."""
    length = np.linalg.norm(apart, axis=1)
    scaled = apart * (np.clip(length, least, most) / np.maximum(length, 1e-9))[:, None]
    wished: Array = np.where(np.isnan(offset), scaled, offset)
    return wished


def _furthest(apart: Array, least: Array, most: Array, offset: Array) -> float:
    """Largest deviation of the differences of positions ``apart``, (ties, dim), from their targets, metres."""
    length = np.linalg.norm(apart, axis=1)
    off = np.where(np.isnan(offset[:, 0]), np.abs(np.clip(length, least, most) - length), 0.0)
    return float(np.maximum(off, np.linalg.norm(np.nan_to_num(offset - apart), axis=1)).max())


def turned_by(points: Array, angle: float) -> Array:
    """Points, (points, dim), metres, rotated around the origin by an angle in degrees, from the first axis to the
    second."""
    cosine, sine = np.cos(np.deg2rad(angle)), np.sin(np.deg2rad(angle))
    turned = points.copy()
    turned[:, 0] = cosine * points[:, 0] - sine * points[:, 1]
    turned[:, 1] = sine * points[:, 0] + cosine * points[:, 1]
    return turned


def teams_of(ties: Flags) -> list[list[int]]:
    """Connected groups of agents, from the flags of coupled pairs, (agents, agents)."""
    number, label = connected_components(ties, directed=False)
    return [np.flatnonzero(label == team).tolist() for team in range(number)]


def depths_of(ties: Flags, first: int) -> Array:
    """Number of couplings between each agent and agent ``first`` on the shortest chain, (agents,); -1 without a
    chain."""
    depth = dijkstra(ties, indices=np.array([first]), unweighted=True)[0]
    return np.where(np.isfinite(depth), depth, -1.0)
