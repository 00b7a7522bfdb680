"""Roadmap growth: momentum added to nodes where the dynamics have it, stepping stones where a node stays alone.

in   Ground, points
out  nodes, point i being node i, and their Edges
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from missionc.backends.smt.roadmap.connect import connect
from missionc.backends.smt.roadmap.edges import Edges
from missionc.backends.smt.roadmap.sample_nodes import Ground
from missionc.backends.smt.settings import smt_settings
from missionc.base.trace import Array
from missionc.geometry.clearance import clear_of
from missionc.geometry.dynamics import States, speeds
from missionc.geometry.sampling import far_apart

Indices = NDArray[np.int64]


def grow(ground: Ground, points: Array, neighbours: int, generator: np.random.Generator) -> tuple[States, Edges]:
    """The nodes and edges of a roadmap on these points, (points, dim), metres."""
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
    """Nodes at rest, some also in motion, and for each the one at the same place that moves the other way."""
    # Where reaching the top speed takes more steps, edges are long, and the states within them many enough.
    steps_to_speed = 4
    moving = 2  # every so many points also carry a node in motion, and the same in the other direction.
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
    """Places one step from a lonely point, spread around it: (at most STONES, dim), metres."""
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
