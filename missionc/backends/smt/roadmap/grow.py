"""Roadmap growth: nodes joined by edges, nodes in motion for agents with momentum, intermediate nodes for isolated
nodes.

    in   Ground, points
    out  nodes, node i at point i, and their Edges, each a whole number of steps and clear of static obstacles

Each node is joined to its nearest steerable neighbours, in both directions, and components to each other. With speeds
of 1..2 m/s, the nearest nodes are too near to be reached in a step. The neighbours are therefore the nearest
*steerable* nodes.

Source:
    [strel] Algorithm 1, lines 3-9.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from missionc.backends.smt.roadmap.edges import NONE, Edges, are_clear, joined
from missionc.backends.smt.roadmap.sample_nodes import Ground
from missionc.backends.smt.settings import smt_settings
from missionc.base.memory import reserve
from missionc.base.trace import Array, Flags, Indices
from missionc.geometry.clearance import clear_of
from missionc.geometry.dynamics import States, can_wait, speeds, steer, turn_in_step
from missionc.geometry.sampling import far_apart
from missionc.geometry.vectors import distinct

MOST_LOOKED = 256
"""Maximum number of neighbours examined for a node."""

FOREVER = np.iinfo(np.int64).max
"""Number of steps that stands for no path."""


def connect(ground: Ground, nodes: States, mirror: Indices, neighbours: int) -> Edges:
    """Edges of a roadmap, sorted by source and target; each with its reverse.

    Args:
        nodes: nodes, with velocity 0 for first-order dynamics.
        mirror: index of the node with the same position and the opposite velocity, (nodes,).
        neighbours: number of neighbours of each node; half of them about a stride away, if possible.
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
    """Steering modes between nodes: straight (0), and arcs (1, -1) if straight paths are too few.

    Straight paths are too few if an agent cannot wait and turns little per step. They are also too few for an agent of
    one speed, since few distances are whole numbers of steps.
    """
    flexible = 1.05  # ratio of top to least speed, above which nearly every distance takes a whole number of steps
    dynamics = ground.agents[0].dynamics
    slowest, fastest = speeds(dynamics)
    agile = turn_in_step(dynamics, ground.mission.step) >= math.pi / 2 and fastest > flexible * slowest
    return (0,) if can_wait(dynamics) or agile else (0, 1, -1)


def _stride(ground: Ground) -> float:
    """Preferred length of an edge, metres: half a step at top speed, and enough to accelerate and stop."""
    dynamics, world = ground.agents[0].dynamics, ground.mission.world
    stride = speeds(dynamics)[1] * ground.mission.step / 2
    extent = float(np.min(np.subtract(world.high, world.low)[:2]))
    return max(stride, min(dynamics.top_speed**2 / dynamics.top_acceleration, extent / 4))


def _search(ground: Ground, nodes: States, neighbours: int, side: int) -> list[Edges]:
    """Edges from each node to its nearest steerable neighbours."""
    first_look = 4  # initial candidates per neighbour; doubled while they are too few
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
    """Edges from some nodes to some of their ``look`` nearest nodes, and flags of the nodes, (rows,), that have enough
    edges."""
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
    """Pairs of nodes as edges, clear or not; 0 steps without a path."""
    dynamics, most = ground.agents[0].dynamics, max(ground.mission.steps, 1)
    return Edges(
        source, target, *steer(dynamics, nodes.take(source), nodes.take(target), ground.mission.step, most, side)
    )


def both_ways(forward: list[Edges], mirror: Indices) -> Edges:
    """All edges and their reverses, each once; a reverse takes the same steps and bends to the other side."""
    back = [Edges(mirror[edges.target], mirror[edges.source], edges.count, -edges.bend) for edges in forward]
    both = joined([*forward, *back])
    names = np.stack([both.source, both.target, np.sign(both.bend).astype(np.int64)], axis=1)
    first, _ = distinct(names)
    return both.take(first)


def _join(ground: Ground, nodes: States, edges: Edges) -> Edges:
    """For every component except the largest, the few fastest edges to the largest component."""
    pair_bytes = 200  # approximate memory of one pair of nodes
    links = coo_array((np.ones(len(edges)), (edges.source, edges.target)), shape=(len(nodes), len(nodes)))
    parts, part = connected_components(links, directed=False)
    if parts == 1:
        return NONE
    largest = np.argmax(np.bincount(part))
    inside, outside = np.flatnonzero(part == largest), np.flatnonzero(part != largest)
    look = min(len(inside), MOST_LOOKED)
    reserve(len(outside) * look * pair_bytes, f"{len(outside)} isolated nodes, with {look} candidate neighbours each,")
    distance, near = _nearest(cKDTree(nodes.position[inside]), nodes.position[outside], look)
    pairs = _steered(ground, nodes, np.repeat(outside, look), inside[near.ravel()], 0)
    order = np.lexsort((distance.ravel(), pairs.count, part[pairs.source]))
    pairs = pairs.take(order[pairs.count[order] > 0])
    pairs = pairs.take(are_clear(ground, nodes, pairs))
    _, first, many = np.unique(part[pairs.source], return_index=True, return_counts=True)
    return pairs.take(np.arange(len(pairs)) - np.repeat(first, many) < smt_settings(ground.mission).roadmap.joins)


def _nearest(tree: cKDTree, points: Array, count: int) -> tuple[Array, Indices]:
    """Distances, metres, and indices of the ``count`` nearest nodes to points (points, dim): (points, count) each,
    nearest first."""
    distance, which = tree.query(points, k=np.arange(1, count + 1))
    return np.asarray(distance, dtype=np.float64), np.asarray(which, dtype=np.int64)


def grow(ground: Ground, points: Array, neighbours: int, generator: np.random.Generator) -> tuple[States, Edges]:
    """Nodes and edges of a roadmap on these points, (points, dim), metres."""
    settings = smt_settings(ground.mission).roadmap
    fewest = 2
    for _ in range(settings.growths):
        nodes, mirror = _with_momentum(ground, points, generator)
        edges = connect(ground, nodes, mirror, neighbours)
        between = int(np.sum(edges.count - 1))
        if between > (budget := max(settings.states, settings.states_per_node * len(points))):
            neighbours = max(fewest, neighbours * budget // between)
            edges = connect(ground, nodes, mirror, neighbours)
        lonely = np.setdiff1d(np.arange(len(points)), edges.source)
        stones = [_stepping_stones(ground, points[node], generator) for node in lonely]
        if sum(map(len, stones)) == 0:
            break
        points = np.concatenate([points, *stones])
    return nodes, edges


def _with_momentum(ground: Ground, points: Array, generator: np.random.Generator) -> tuple[States, Indices]:
    """Nodes at rest and in motion at points, (points, dim), metres, and for each node its mirror with opposite
    velocity, (nodes,)."""
    # If reaching the top speed takes more steps, edges are long and have enough states within them.
    steps_to_speed = 4
    moving = 2  # one point in this many also carries nodes in motion, in both directions
    settings = smt_settings(ground.mission).roadmap
    dynamics, itself = ground.agents[0].dynamics, np.arange(len(points))
    rest = States(points, np.zeros_like(points))
    if not dynamics.has_momentum:
        return rest, itself
    if dynamics.top_speed > steps_to_speed * dynamics.top_acceleration * ground.mission.step:
        return rest, itself
    places = points[::moving]
    angle = generator.integers(settings.headings, size=len(places)) * (2 * np.pi / settings.headings)
    velocity = np.zeros_like(places)
    velocity[:, 0], velocity[:, 1] = np.cos(angle), np.sin(angle)
    velocity *= settings.cruise * dynamics.top_speed
    nodes = States(np.concatenate([points, places, places]), np.concatenate([rest.velocity, velocity, -velocity]))
    forth = len(points) + np.arange(len(places))
    return nodes, np.concatenate([itself, forth + len(places), forth])


def _stepping_stones(ground: Ground, point: Array, generator: np.random.Generator) -> Array:
    """Points one step from an isolated point, spread around it: (at most STONES, dim), metres."""
    stones_tried = 64
    dynamics, step = ground.agents[0].dynamics, ground.mission.step
    shortest, longest = (speed * step for speed in speeds(dynamics))
    longest = min(longest, dynamics.top_acceleration * step * step)
    direction = generator.standard_normal((stones_tried, len(point)))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    places = point + direction * generator.uniform(shortest, longest, size=(stones_tried, 1))
    places = places[ground.is_free(places) & ground.keeps_within(places)]
    start = np.broadcast_to(point, places.shape)
    places = places[clear_of(ground.obstacles, start, places, np.full(len(places), ground.margin))]
    return places[far_apart(places, smt_settings(ground.mission).roadmap.stones, point[None])]
