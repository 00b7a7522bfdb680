"""Geodesic roadmap: terminals of the mission and the shortest paths between them around static obstacles.

    in   Ground, Kernel
    out  nodes and their Edges

Terminals are the starts and finishes, and positions in the required regions. Further nodes are the corners of the
shortest paths between terminals, and waypoints on long paths for waiting. The corners come from a visibility graph of
the obstacles, grown by the body and some additional clearance. Nodes on no such path are omitted.

Visibility graph of a geodesic roadmap: straight clear paths between nodes.

    in   Ground, nodes, of which the first are terminals
    out  lengths of the paths, longer without additional clearance

Results for pairs of nodes are cached. Unlike ``geodesic_bounds``, whose lengths are lower bounds, these paths must be
clear: they become moves of agents.

Source:
    de Berg et al., "Computational Geometry" (2008), 15.1.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
import shapely
from scipy.sparse import coo_array, csr_array
from scipy.spatial import cKDTree

from missionc.backends.smt.roadmap.edges import Edges, are_clear
from missionc.backends.smt.roadmap.grow import both_ways
from missionc.backends.smt.roadmap.sample_nodes import Ground, NoRoadmap, exact_places
from missionc.backends.smt.settings import ShortestPathSettings, smt_settings
from missionc.base.late_dataclass import Record
from missionc.base.trace import Array, Flags, Indices
from missionc.geometry.clearance import clear_of, solids
from missionc.geometry.dynamics import States, steer
from missionc.geometry.sampling import points_in, scatter
from missionc.geometry.vectors import distinct
from missionc.ir import Ball, Inside, Predicate, Still
from missionc.ir.kernel.analysis import agents_asked, linked_by
from missionc.ir.kernel.nodes import Atom, Kernel, Not
from missionc.ir.language.margins.predicate_margins import of_states
from missionc.planning.shortest_paths import greedy_spanner, left_at, on_shortest_ways


@dataclass(slots=True, eq=False)
class Visibility:
    """Cache of the visibility of pairs of nodes, by node identifier.

    ``spare``: preferred additional clearance, metres.
    """

    ground: Ground
    spare: float
    pairs: Indices = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    clear: Flags = field(default_factory=lambda: np.zeros(0, dtype=np.bool_))
    roomy: Flags = field(default_factory=lambda: np.zeros(0, dtype=np.bool_))

    def graph(self, nodes: Array, names: Indices, places: int) -> csr_array:
        """Graph of clear straight paths between nodes, (nodes, dim), metres, of which the first ``places`` are
        terminals.

        Args:
            names: fixed identifier of each node, (nodes,).
        """
        most_nodes = 1 << 31  # more than can occur
        settings = smt_settings(self.ground.mission).shortest_paths
        one, other = _pairs(nodes, places, settings)
        length = np.linalg.norm(nodes[one] - nodes[other], axis=1)
        apart = length > 0
        one, other, length = one[apart], other[apart], length[apart]
        pair = np.minimum(names[one], names[other]) * most_nodes + np.maximum(names[one], names[other])
        self._look(pair, nodes[one], nodes[other])
        at = np.searchsorted(self.pairs, pair)
        clear = self.clear[at]
        weight = np.where(self.roomy[at], length, settings.penalty * length)[clear]
        return csr_array(coo_array((weight, (one[clear], other[clear])), shape=(len(nodes), len(nodes))))

    def _look(self, pair: Indices, start: Array, end: Array) -> None:
        """Test the pairs that are not cached; ``start`` and ``end`` are (pairs, dim), metres."""
        new = np.flatnonzero(~np.isin(pair, self.pairs))
        margin = np.full(len(new), self.ground.margin)
        clear = clear_of(self.ground.obstacles, start[new], end[new], margin)
        roomy, seen = np.zeros(len(new), dtype=np.bool_), new[clear]
        roomy[clear] = clear_of(self.ground.obstacles, start[seen], end[seen], margin[clear] + self.spare)
        pairs = np.concatenate([self.pairs, pair[new]])
        order = np.argsort(pairs, kind="stable")
        self.pairs = pairs[order]
        self.clear = np.concatenate([self.clear, clear])[order]
        self.roomy = np.concatenate([self.roomy, roomy])[order]


def _pairs(nodes: Array, places: int, settings: ShortestPathSettings) -> tuple[Indices, Indices]:
    """Pairs of nodes, (pairs,) twice, to test for a straight path; ``nodes`` is (nodes, dim), metres."""
    count = len(nodes)
    if count <= settings.all_pairs:
        one, other = np.triu_indices(count, 1)
        return one, other
    tree, looks = cKDTree(nodes), min(count, max(settings.nearest, settings.pairs // places))
    near = np.asarray(tree.query(nodes, k=settings.nearest + 1)[1])[:, 1:]
    further = np.asarray(tree.query(nodes[:places], k=looks)[1])
    one = np.r_[np.repeat(np.arange(count), settings.nearest), np.repeat(np.arange(places), looks)]
    other = np.r_[near.ravel(), further.ravel()]
    one, other = np.divmod(np.unique(np.minimum(one, other) * count + np.maximum(one, other)), count)
    return one, other


TOUCHING = 1e-6
"""Fraction by which corners are further from obstacles than bodies have to be."""


SPHERE = np.array([[x, y, z] for x in (-1, 0, 1) for y in (-1, 0, 1) for z in (-1, 0, 1) if x or y or z], dtype=float)
"""Directions in which paths around a ball may bend."""


class Goal(Record, eq=False):
    """Predicate that one agent's position decides, and free points at which it is true, (points, dim), metres, deepest
    first."""

    predicate: Predicate
    points: Array
    depth: float
    """Margin of the first point, metres."""
    agents: int
    """Number of agents that must satisfy the predicate."""
    relays: int
    """Number of agents that may rest in the region as relays: all agents if links are required."""


def geodesic_roadmap(
    ground: Ground, kernel: Kernel, generator: np.random.Generator
) -> tuple[States, Edges] | NoRoadmap:
    """Nodes and edges of a geodesic roadmap, for dynamics that can wait; or the reason why there is none.

    Args:
        kernel: requirements, which determine the terminals.
        generator: random generator; equal seeds give equal arrays.
    """
    places = exact_places(ground, generator)
    if isinstance(places, NoRoadmap):
        return places
    goals = _goals(ground, kernel, generator)
    for goal in goals:
        places = np.concatenate([places, _resting_places(ground, goal)])
    places = places[np.sort(distinct(places)[0])]
    corners = _corners(ground, kernel)
    if ground.mission.dimension == 3:
        world = ground.mission.world
        corners = np.concatenate(
            [
                corners,
                scatter(world.low, world.high, smt_settings(ground.mission).shortest_paths.volume_samples, generator),
            ]
        )
    corners = corners[ground.is_free(corners) & ground.keeps_within(corners)]
    seen = Visibility(ground, _spare(ground))
    entries = _entries(ground, places, corners, goals, seen)
    names = np.arange(len(places) + len(corners) + len(entries))
    first, last = len(places), len(places) + len(corners)
    names = np.concatenate([names[:first], names[last:], names[first:last]])
    return _roadmap(ground, np.concatenate([places, entries]), corners, names, seen)


def _goals(ground: Ground, kernel: Kernel, generator: np.random.Generator) -> list[Goal]:
    """Required predicates that an agent's position decides and that are true in a part of the world."""
    settings = smt_settings(ground.mission).shortest_paths
    world, goals = ground.mission.world, []
    here = {agent.index for agent in ground.agents}
    linked = bool(linked_by(kernel.formulas))
    for predicate, agents in _asked(kernel, holds=True).items():
        region = predicate.region
        if region is None:
            points = scatter(world.low, world.high, settings.goal_samples, generator)
        else:
            points = points_in(region.shape, world, settings.goal_samples // 4, generator)[0]
        points = points[ground.is_free(points) & ground.keeps_within(points)]
        margin = _margin(ground, predicate, points)
        order = np.argsort(-margin, kind="stable")
        order = order[margin[order] > 0]
        if len(order):
            depth, relays = float(margin[order[0]]), len(here) if linked else 0
            goals.append(Goal(predicate, points[order], depth, len(here & agents), relays))
    return goals


def _asked(kernel: Kernel, *, holds: bool) -> dict[Predicate, set[int]]:
    """Predicates that one agent's position decides, required (or with ``holds`` False, negated), with their agents."""
    asked: dict[Predicate, set[int]] = {}
    for formula in kernel.formulas:
        for node, agents in agents_asked(formula).items():
            match node:
                case Atom(predicate) | Not(Atom(predicate)) if predicate.reads_past:
                    for region in predicate.regions if holds else ():
                        asked.setdefault(Inside(region, body=False), set()).update(agents)
                case Not(Atom(predicate)) if not holds:
                    asked.setdefault(predicate, set()).update(agents)
                case Atom(predicate) if holds:
                    asked.setdefault(predicate, set()).update(agents)
    decided = (each for each in asked if not (each.others or each.reads_speed or each.about_team))
    return {each: asked[each] for each in decided if each.parts == (each,)}


def _margin(ground: Ground, predicate: Predicate, points: Array) -> Array:
    """Margins of a predicate at points: (points, dim), metres -> (points,), metres."""
    agent = ground.agents[0].index
    margin = np.asarray(of_states(predicate, ground.mission, agent, points, np.zeros_like(points)))
    return np.broadcast_to(margin, len(points))


def _stride(ground: Ground) -> float:
    """Greatest distance in a step, metres."""
    return ground.agents[0].dynamics.top_speed * ground.mission.step


def _thinned(points: Array, taken: Array, gap: float, most: int) -> Indices:
    """Indices of points at least ``gap`` metres from each other and from ``taken``: (at most ``most``,), ascending."""
    away = np.full(len(points), np.inf) if len(taken) == 0 else np.asarray(cKDTree(taken).query(points)[0])
    chosen: list[int] = []
    while len(points) and len(chosen) < most and away.max() > gap:
        chosen.append(int(away.argmax()))
        away = np.minimum(away, np.linalg.norm(points - points[chosen[-1]], axis=1))
    return np.sort(np.array(chosen, dtype=np.int64))


def _resting_places(ground: Ground, goal: Goal) -> Array:
    """Resting positions in the goal, (places, dim), metres: one per required agent, and deep positions for relays."""
    settings = smt_settings(ground.mission).shortest_paths
    margin = _margin(ground, goal.predicate, goal.points)
    pitch = ground.passing
    chosen = goal.points[:1]
    for share, agents in ((settings.depth, max(goal.agents, goal.relays)), (settings.edge, goal.agents)):
        roomy = goal.points[margin >= goal.depth * share]
        chosen = np.concatenate(
            [chosen, roomy[_thinned(roomy, chosen, pitch, min(settings.rest_places, agents) - len(chosen))]]
        )
    return chosen


def _spare(ground: Ground) -> float:
    """Preferred additional clearance of paths, metres."""
    settings = smt_settings(ground.mission).shortest_paths
    world = ground.mission.world
    longest = float(np.max(np.subtract(world.high, world.low)))
    return max(settings.clearance * longest, settings.clearance_radii * ground.agents[0].radius)


def _corners(ground: Ground, kernel: Kernel) -> Array:
    """Possible bends of paths around obstacles, and around avoided regions: (corners, dim), metres."""
    round = 3  # corners of a quarter of a disc
    dimension = ground.mission.dimension
    denied = [each.region for each in _asked(kernel, holds=False) if each.region is not None]
    shapes = [(solid, ground.margin) for solid in ground.obstacles]
    horizon = float(ground.mission.horizon)
    shapes += [
        (solid, ground.margin + obstacle.grown(time))
        for obstacle in ground.mission.obstacles
        if obstacle.growth and isinstance(obstacle.motion, Still)
        for time in (horizon / 2, horizon)
        for solid in solids(obstacle.shape)
    ]
    shapes += [(solid, ground.agents[0].radius) for region in denied for solid in solids(region.shape)]
    made = [np.zeros((0, dimension))]
    for spare in (0.0, _spare(ground), _spare(ground) + ground.passing):
        for solid, margin in shapes:
            room = margin * (1 + TOUCHING) + TOUCHING + spare
            if isinstance(solid, Ball):
                made.append(np.array(solid.centre) + (solid.radius + room) * SPHERE)
                continue
            if solid.radius:
                radius = (solid.radius + room) / math.cos(math.pi / (4 * round))
                grown = shapely.buffer(solid.base, radius, quad_segs=round)
            else:
                grown = shapely.buffer(solid.base, room, join_style="mitre", mitre_limit=2.0)
            level = shapely.get_coordinates(grown)[:-1]
            if dimension == 2:
                made.append(level)
            else:
                low, high = (
                    max(solid.low - room, ground.mission.world.low[2]),
                    min(solid.high + room, ground.mission.world.high[2]),
                )
                heights = (low, (low + high) / 2, high)
                made.extend(np.column_stack([level, np.full(len(level), height)]) for height in heights)
    return np.concatenate(made)


def _entries(ground: Ground, places: Array, corners: Array, goals: list[Goal], seen: Visibility) -> Array:
    """Points at which the shortest paths from the terminals enter each goal: (entries, dim), metres."""
    settings = smt_settings(ground.mission).shortest_paths
    nodes = np.concatenate([places, corners])
    tree, looks, nears, lasts, made = cKDTree(nodes), min(len(nodes), settings.entry_candidates), [], [], [places[:0]]
    for goal in goals:
        near = np.sort(np.asarray(tree.query(goal.points[0], k=looks)[1]))
        entry = _toward(ground, goal, nodes[near])
        clear = clear_of(ground.obstacles, nodes[near], entry, np.full(looks, ground.margin))
        nears.append(near[clear])
        lasts.append(np.linalg.norm(entry - nodes[near], axis=1)[clear])
        made.append(entry[clear])
    graph = seen.graph(nodes, np.arange(len(nodes)), len(places))
    for number, left in enumerate(left_at(graph, nears, lasts)):
        made[number + 1] = made[number + 1][np.isin(nears[number], left[: len(places)])]
    entries = np.concatenate(made)
    entries = entries[ground.is_free(entries)]
    return entries[_thinned(entries, places, _stride(ground) * settings.entry_spacing, settings.entries)]


def _toward(ground: Ground, goal: Goal, nodes: Array) -> Array:
    """First point well inside the goal on the line from each node to the nearest goal point: (nodes, dim), metres."""
    halvings = 20
    enough = goal.depth * smt_settings(ground.mission).shortest_paths.edge
    inner = goal.points[_margin(ground, goal.predicate, goal.points) >= enough]
    target = inner[cKDTree(inner).query(nodes)[1]]
    low, high = np.zeros(len(nodes)), np.ones(len(nodes))
    for _ in range(halvings):
        middle = (low + high) / 2
        held = _margin(ground, goal.predicate, nodes + (target - nodes) * middle[:, None]) >= enough
        low, high = np.where(held, low, middle), np.where(held, middle, high)
    return nodes + (target - nodes) * high[:, None]


def _roadmap(ground: Ground, places: Array, corners: Array, names: Indices, seen: Visibility) -> tuple[States, Edges]:
    """Nodes and edges of the shortest and second shortest paths between all terminals, with waypoints.

    Args:
        names: identifiers of the terminals and corners in ``seen``, (nodes,).
    """
    settings = smt_settings(ground.mission).shortest_paths
    nodes = np.concatenate([places, corners])
    graph = seen.graph(nodes, names, len(places))
    used = np.zeros((0, 2), dtype=np.int64)
    for _ in range(settings.paths):
        used = np.unique(np.concatenate([used, on_shortest_ways(graph, nodes, len(places))]), axis=0)
        again = coo_array((np.full(len(used), 1.0), (used[:, 0], used[:, 1])), shape=graph.shape).tocsr()
        graph = csr_array(graph + graph.multiply(again) * (settings.detour - 1))
    used = greedy_spanner(nodes, used, settings.stretch)
    nodes, used = _with_waypoints(ground, nodes, used)
    if len(ground.mission.agents) > 1:
        nodes, used = _with_sidings(ground, nodes, used)
    kept = np.unique(np.concatenate([np.arange(len(places)), used.ravel()]))
    number = np.zeros(len(nodes), dtype=np.int64)
    number[kept] = np.arange(len(kept))
    states = States(nodes[kept], np.zeros((len(kept), nodes.shape[1])))
    source, target = number[used].T
    dynamics, mission = ground.agents[0].dynamics, ground.mission
    edges = Edges(
        source, target, *steer(dynamics, states.take(source), states.take(target), mission.step, max(mission.steps, 1))
    )
    edges = edges.take(edges.count > 0)
    edges = edges.take(are_clear(ground, states, edges))
    return states, both_ways([edges], np.arange(len(states)))


def _with_sidings(ground: Ground, nodes: Array, used: Indices) -> tuple[Array, Indices]:
    """Nodes, (nodes, dim), metres, and edges with a siding beside each waypoint, if there is room, so that another body
    can pass.

    The siding is joined to the waypoint, and to the previous and next nodes if the path is clear.
    """
    degree = np.bincount(used.ravel(), minlength=len(nodes))
    passing = ground.passing * (1 + smt_settings(ground.mission).shortest_paths.entry_spacing / 10)
    neighbours: dict[int, list[int]] = {}
    for one, other in used.tolist():
        neighbours.setdefault(one, []).append(other)
        neighbours.setdefault(other, []).append(one)
    inner = np.flatnonzero(degree == 2)
    ends = np.array([neighbours[node] for node in inner.tolist()], dtype=np.int64).reshape(-1, 2)
    along = nodes[ends[:, 1]] - nodes[ends[:, 0]]
    aside = np.zeros_like(along)
    aside[:, 0], aside[:, 1] = -along[:, 1], along[:, 0]
    far = np.linalg.norm(aside, axis=1)
    inner, ends, aside = inner[far > 0], ends[far > 0], (aside / np.where(far > 0, far, 1)[:, None])[far > 0] * passing
    both = np.concatenate([nodes[inner] + aside, nodes[inner] - aside])
    owner = np.tile(np.arange(len(inner)), 2)
    clear = ground.is_free(both) & ground.keeps_within(both) & (cKDTree(nodes).query(both)[0] > passing / 2)
    clear &= clear_of(ground.obstacles, nodes[inner[owner]], both, np.full(len(both), ground.margin))
    one_each = np.flatnonzero(clear)[np.unique(owner[clear], return_index=True)[1]]
    size, beside = len(nodes) + np.arange(len(one_each)), both[one_each]
    links = [np.stack([inner[owner[one_each]], size], axis=1)]
    for end in ends[owner[one_each]].T:
        clear = clear_of(ground.obstacles, nodes[end], beside, np.full(len(beside), ground.margin))
        links.append(np.stack([end, size], axis=1)[clear])
    return np.concatenate([nodes, beside]), np.concatenate([used, *links])


def _with_waypoints(ground: Ground, nodes: Array, used: Indices) -> tuple[Array, Indices]:
    """Nodes, (nodes, dim), metres, and edges with additional nodes on long edges, at whole numbers of steps at full
    speed."""
    settings = smt_settings(ground.mission).shortest_paths
    dynamics = ground.agents[0].dynamics
    if dynamics.has_momentum or len(used) == 0:
        return nodes, used
    length = np.linalg.norm(nodes[used[:, 1]] - nodes[used[:, 0]], axis=1)
    stride = dynamics.top_speed * ground.mission.step
    pitch = stride * max(settings.waypoint_steps, math.ceil(float(length.sum()) / (settings.waypoints * stride)))
    parts, points, size = [], [nodes], len(nodes)
    for (one, other), whole in zip(used.tolist(), length.tolist(), strict=True):
        count = math.ceil(whole / pitch - 1e-9) - 1
        if count < 1:
            parts.append(np.array([[one, other]]))
            continue
        share = (np.arange(1, count + 1) * pitch / whole)[:, None]
        points.append(nodes[one] * (1 - share) + nodes[other] * share)
        chain = np.r_[one, size + np.arange(count), other]
        parts.append(np.stack([chain[:-1], chain[1:]], axis=1))
        size += count
    return np.concatenate(points), np.concatenate(parts)
