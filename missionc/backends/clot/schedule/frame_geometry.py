"""Geometry of configurations: points turned about their middle, who hangs together, and places along a way."""

from __future__ import annotations

import numpy as np
from scipy.sparse.csgraph import connected_components, dijkstra

from missionc.backends.clot.schedule.geodesics import along
from missionc.base.trace import Array, Flags


def turned_by(points: Array, angle: float) -> Array:
    """Points, (points, dim), turned by so many degrees round the origin, from the first axis to the second."""
    cosine, sine = np.cos(np.deg2rad(angle)), np.sin(np.deg2rad(angle))
    turned = points.copy()
    turned[:, 0] = cosine * points[:, 0] - sine * points[:, 1]
    turned[:, 1] = sine * points[:, 0] + cosine * points[:, 1]
    return turned


def teams_of(ties: Flags) -> list[list[int]]:
    """Who is tied together, by ties, (agents, agents), between any two of them."""
    number, label = connected_components(ties, directed=False)
    return [np.flatnonzero(label == team).tolist() for team in range(number)]


def depths_of(ties: Flags, first: int) -> Array:
    """By how many ties each agent is away from the first, (agents,); -1 where nothing ties it there."""
    depth = dijkstra(ties, indices=np.array([first]), unweighted=True)[0]
    return np.where(np.isfinite(depth), depth, -1.0)


def place_on(way: Array, distance: float) -> Array:
    """The point so many metres along a way; straight on where it ends."""
    lengths = np.linalg.norm(np.diff(way, axis=0), axis=1)
    total = float(lengths.sum())
    if distance <= total and total > 0:
        point: Array = along(way, np.array([distance / total]))[0]
        return point
    last = (way[-1] - way[-2]) / max(float(np.linalg.norm(way[-1] - way[-2])), 1e-9)
    beyond: Array = way[-1] + last * (distance - total)
    return beyond
