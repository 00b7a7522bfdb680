"""Node sampling of a roadmap: starts and finishes, positions in regions, uniform filling of the remaining free space.

    in   Mission, the agents of one kind
    out  points in free space, or the start, finish or region without any

Source:
    [strel] Algorithm 1, line 1, and "Multi-agent PRM" (initial states are sampled in).
"""

from __future__ import annotations

import math

import numpy as np
from scipy.spatial import cKDTree
from scipy.spatial.distance import pdist

from missionc.backends.smt.settings import smt_settings
from missionc.base.late_dataclass import Record
from missionc.base.trace import Array, Flags
from missionc.geometry.clearance import ROUNDING, Solid, clear_of, clear_places, standing_solids
from missionc.geometry.sampling import far_apart, packed, points_in, scatter
from missionc.geometry.vectors import distinct
from missionc.ir import Agent, Mission, Region, Vector
from missionc.ir.distances.signed_distance import signed_distance


class NoRoadmap(Record):
    """Reason why there is no roadmap, in the mission's terms."""

    statement: str


class Ground(Record, eq=False):
    """Free space of one kind of agent: the mission, the agents, and the static obstacles."""

    mission: Mission
    agents: tuple[Agent, ...]
    obstacles: tuple[Solid, ...]

    @property
    def margin(self) -> float:
        """Required distance of an agent's centre from every obstacle, metres."""
        return self.agents[0].radius + self.mission.clearance - ROUNDING

    @property
    def passing(self) -> float:
        """Required distance of two agents of this kind that pass each other side by side, metres."""
        one = self.agents[0].index
        return float(self.mission.spacing(one, one).sideways)

    def is_free(self, points: Array) -> Flags:
        """Return true for each point, (points, dim), metres, in the world and clear of static obstacles: (points,)."""
        world, margin = self.mission.world, np.full(len(points), self.margin)
        within: Flags = np.all((points >= world.low) & (points <= world.high), axis=1)
        return within & clear_of(self.obstacles, points, points, margin)

    def is_free_at(self, step: int, points: Array) -> Flags:
        """Return true for each point, (points, dim), metres, in the world and clear of all obstacles at a step:
        (points,)."""
        free: Flags = self.is_free(points) & clear_places(self.mission, points, self.margin, (step,))[0]
        return free

    def keeps_within(self, points: Array) -> Flags:
        """Return true for each point, (points, dim), metres, at which the body is inside the world: (points,)."""
        world, radius = self.mission.world, self.agents[0].radius
        low, high = np.add(world.low, radius), np.subtract(world.high, radius)
        within: Flags = np.all((points >= low) & (points <= high), axis=1)
        return within


class Crowd(Record, eq=False):
    """Agents that are all in one region at one step."""

    step: int
    region: Region
    agents: list[Agent]


def free_ground(mission: Mission, agents: tuple[Agent, ...]) -> Ground:
    return Ground(mission, agents, standing_solids(mission))


def sample_nodes(ground: Ground, count: int, generator: np.random.Generator) -> Array | NoRoadmap:
    """Nodes of one roadmap: (nodes, dim), metres, distinct; or the reason why there are none.

    Every exact start and finish is a node. Every region has several nodes, spread out, one of them deep. A start or
    finish region has at least twice as many nodes as agents, and at least four more than agents, as far apart as
    possible.

    Args:
        count: total number of nodes, if starts, finishes and regions need no more.
    """
    nodes = exact_places(ground, generator)
    if isinstance(nodes, NoRoadmap):
        return nodes
    for region in ground.mission.regions:
        nodes = np.concatenate([nodes, _cover(ground, region, nodes, generator)])
    nodes = np.concatenate([nodes, _fill(ground, count, nodes, generator)])
    first, _ = distinct(nodes)
    return nodes[np.sort(first)]


def exact_places(ground: Ground, generator: np.random.Generator) -> Array | NoRoadmap:
    """Start and finish positions, (places, dim), metres: exact positions, and a position in the region for every other
    agent."""
    nodes = _named_places(ground)
    if isinstance(nodes, NoRoadmap):
        return nodes
    for crowd in _crowds(ground):
        places = _crowd(ground, crowd, nodes, generator)
        if len(places) == 0:
            return NoRoadmap(f"no free position for `{crowd.agents[0].name}` in `{crowd.region.name}`")
        nodes = np.concatenate([nodes, places])
    return nodes


def spacing(ground: Ground, count: int) -> float:
    """Spacing of ``count`` nodes that fill the world uniformly, metres."""
    world, body = ground.mission.world, 2 * ground.agents[0].radius
    sides = np.maximum(np.subtract(world.high, world.low) - body, 0.0)
    return math.pow(float(np.prod(sides)) / count, 1 / world.dimension)


def _named_places(ground: Ground) -> Array | NoRoadmap:
    """Distinct exact start and finish positions, (places, dim), metres; or the reason why one of them is not free."""
    points: dict[tuple[float, ...], None] = {}
    for agent in ground.agents:
        for place, step in ((agent.start, 0), (agent.finish, ground.mission.steps)):
            if place is not None and place.point is not None:
                points[place.point] = None
                if not ground.is_free_at(step, np.array([place.point]))[0]:
                    return NoRoadmap(_is_taken(agent, place.point, step, ground))
    return np.array(list(points), dtype=float).reshape(-1, ground.mission.dimension)


def _crowds(ground: Ground) -> list[Crowd]:
    """Groups of agents that start, or finish, in the same region."""
    crowds: dict[tuple[int, int], Crowd] = {}
    for agent in ground.agents:
        for place, step in ((agent.start, 0), (agent.finish, ground.mission.steps)):
            if place is not None and place.region is not None:
                crowd = crowds.setdefault((step, id(place.region)), Crowd(step, place.region, []))
                crowd.agents.append(agent)
    return list(crowds.values())


def _points_to_be_at(ground: Ground, step: int, region: Region, generator: np.random.Generator) -> Array:
    """Free points of a region at a step, (points, dim), metres; only points with the body inside the world, if there
    are any."""
    points, _ = points_in(
        region.shape, ground.mission.world, smt_settings(ground.mission).roadmap.region_samples, generator
    )
    points = points[ground.is_free_at(step, points)]
    roomy = ground.keeps_within(points)
    return points[roomy] if roomy.any() else points


def _crowd(ground: Ground, crowd: Crowd, taken: Array, generator: np.random.Generator) -> Array:
    """Positions for agents that start or finish in one region, as far apart as possible: (places, dim), metres."""
    aside = 1e-6  # metres: agents further apart than their separation by this much surely do not touch
    free = _points_to_be_at(ground, crowd.step, crowd.region, generator)
    agents = len(crowd.agents)
    chosen = free[far_apart(free, agents + max(4, agents), taken)]
    pitch = ground.passing + aside
    if len(chosen) and np.min(pdist(chosen[:agents]), initial=np.inf) < pitch:
        grid = packed(crowd.region.shape, ground.mission.world, pitch)
        grid = grid[ground.is_free_at(crowd.step, grid)]
        denser = grid[far_apart(grid, agents + max(4, agents), taken)]
        chosen = denser if len(denser) >= agents else np.concatenate([chosen, denser])
    return chosen


def _cover(ground: Ground, region: Region, taken: Array, generator: np.random.Generator) -> Array:
    """Nodes that a region still needs, (nodes, dim), metres: one as deep as the body or nearly the deepest, and
    others."""
    settings = smt_settings(ground.mission).roadmap
    nearly = 0.8  # share of the greatest sampled depth that is deep enough
    points, depth = points_in(region.shape, ground.mission.world, settings.region_samples, generator)
    free = ground.is_free(points) & ground.keeps_within(points)
    if not free.any():
        free = ground.is_free(points)
    points, depth = points[free], depth[free]
    if len(points) == 0:
        return points
    inside = -np.asarray(signed_distance(np, region.shape, taken))
    enough = min(ground.agents[0].radius, depth.max() * nearly)
    deepest = points[[int(np.argmax(depth))]] if np.max(inside, initial=-np.inf) < enough else points[:0]
    roomy = points[depth >= min(enough, depth.max() / 2)]
    missing = settings.region_nodes - int(np.sum(inside >= 0)) - len(deepest)
    return np.concatenate([deepest, roomy[far_apart(roomy, missing, np.concatenate([taken, deepest]))]])


def _fill(ground: Ground, count: int, taken: Array, generator: np.random.Generator) -> Array:
    """Points all over the free space, away from ``taken``: (points, dim), metres."""
    settings = smt_settings(ground.mission).roadmap
    world, radius = ground.mission.world, ground.agents[0].radius
    missing = max(count - len(taken), round(settings.filling * count))
    low, high = tuple(np.add(world.low, radius)), tuple(np.subtract(world.high, radius))
    if missing <= 0 or any(first >= last for first, last in zip(low, high, strict=True)):
        return taken[:0]
    gap = settings.spacing * spacing(ground, count)
    points = scatter(low, high, 4 * count, generator)
    points = points[ground.is_free(points)]
    if len(taken):
        away = cKDTree(taken).query(points)[0] >= gap
        points = np.concatenate([points[away], points[~away]])
    return points[:missing]


def _is_taken(agent: Agent, point: Vector, step: int, ground: Ground) -> str:
    where = ", ".join(f"{coordinate:g}" for coordinate in point)
    what = "starts" if step == 0 else "finishes"
    need = ground.agents[0].radius + ground.mission.clearance
    return f"`{agent.name}` {what} at ({where}), which is outside the world or less than {need:g} m from an obstacle"
