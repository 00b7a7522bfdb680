"""Parts of a mission that all other methods need: target positions, required links, and a trace."""

from __future__ import annotations

import numpy as np
from scipy.sparse.csgraph import minimum_spanning_tree
from scipy.spatial.distance import cdist

from missionc.backends.clot.cost_graph.cost_graph import build
from missionc.base.trace import Array, Trace
from missionc.ir import Box, InitialSet, Inside, Mission
from missionc.ir.kernel.nodes import Atom, Kernel
from missionc.ir.kernel.walk import postorder


class Unsupported(Exception):
    """Error for a mission that this rival's formulation cannot express."""


def box(place: InitialSet | None) -> Box:
    """Region of a start or finish."""
    if place is not None and place.region is not None and isinstance(place.region.shape, Box):
        return place.region.shape
    raise Unsupported("starts and finishes have to be boxes")


def legs(mission: Mission, kernel: Kernel) -> list[Box]:
    """Dock, regions of the requirements in order, and pad."""
    named = [
        term.predicate.region.shape
        for term in postorder(build(kernel).formulas)
        if isinstance(term, Atom) and isinstance(term.predicate, Inside)
    ]
    boxes = [shape for number, shape in enumerate(named) if isinstance(shape, Box) and shape not in named[:number]]
    return [box(mission.agents[0].start), *boxes, box(mission.agents[0].finish)]


def speed(mission: Mission) -> float:
    """Common speed limit of a first-order team, m/s."""
    limits = {agent.dynamics.top_speed for agent in mission.agents}
    if len(limits) != 1 or any(agent.dynamics.word != "single_integrator" for agent in mission.agents):
        raise Unsupported("all agents have to be single integrators of one speed")
    return limits.pop()


def lattice(area: Box, pitch: float) -> Array:
    """Points with spacing ``pitch`` in a box, centred in it: (points, 2), metres."""
    axes = []
    for low, high in zip(area.low, area.high, strict=True):
        count = int((high - low) / pitch + 1e-9) + 1
        axes.append((low + high) / 2 + (np.arange(count) - (count - 1) / 2) * pitch)
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)


def together(points: Array, count: int, generator: np.random.Generator) -> Array:
    """Select ``count`` neighbouring points around a random one: (points, 2) -> (count, 2), metres."""
    anchor = points[generator.integers(len(points))]
    return points[np.argsort(np.linalg.norm(points - anchor, axis=1), kind="stable")[:count]]


def stand(mission: Mission, area: Box, generator: np.random.Generator) -> Array:
    """Random positions of all agents in a box, separate and, if possible, linked: (agents, 2), metres."""
    count, radius = len(mission.agents), max(agent.radius for agent in mission.agents)
    pitch = min((graph.radius for graph in mission.graphs), default=1.0) / 2.5
    while len(lattice(area, pitch)) < count:
        pitch *= 0.95
    least = 2 * radius + mission.separation
    if pitch <= least:
        raise Unsupported(f"{count} agents do not fit a lattice in {area}")
    room = min(0.05, (pitch - least) / 4)
    low, high = np.array(area.low), np.array(area.high)
    places = together(lattice(area, pitch), count, generator) + generator.uniform(-room, room, (count, 2))
    return np.clip(places, low + 1e-3, high - 1e-3)


def tree(position: Array) -> list[tuple[int, int]]:
    """Edges of a shortest spanning tree of positions (agents, 2), metres."""
    edges = minimum_spanning_tree(cdist(position, position)).tocoo()
    return list(zip(edges.row.tolist(), edges.col.tolist(), strict=True))


def trace(mission: Mission, position: Array) -> Trace:
    """First-order motion through positions, (agents, steps + 1, 2), metres."""
    moved = np.diff(position, axis=1) / mission.step
    velocity = np.concatenate([moved, moved[:, -1:]], axis=1)
    return Trace(mission.step, position, velocity, np.arctan2(velocity[..., 1], velocity[..., 0]))
