"""Polylines: paths of straight segments, (corners, dim) in metres, parametrised by arc length."""

from __future__ import annotations

import numpy as np

from missionc.base.trace import Array
from missionc.geometry.vectors import norm


def length(path: Array) -> float:
    """Length of a polyline, (corners, dim), metres."""
    return float(norm(np.diff(path, axis=0)).sum())


def lengths_to(path: Array) -> Array:
    """Arc length of a polyline, (corners, dim), metres, at each of its corners: (corners,), metres."""
    return np.asarray(np.r_[0.0, np.cumsum(norm(np.diff(path, axis=0)))])


def at_lengths(path: Array, reached: Array, metres: Array) -> Array:
    """Points of a polyline at given arc lengths: (points,) -> (points, dim), metres.

    Args:
        reached: arc length at each corner, (corners,), from ``lengths_to``, or another increasing parameter.
        metres: arc lengths of the points, in the unit of ``reached``.
    """
    return np.stack([np.interp(metres, reached, axis) for axis in path.T], axis=1)


def at_shares(path: Array, share: Array) -> Array:
    """Points of a polyline at fractions of its length: (points,), dimensionless -> (points, dim), metres."""
    total = length(path)
    if total == 0:
        return np.repeat(path[:1], len(share), axis=0)
    return at_lengths(path, lengths_to(path) / total, share)


def at_length(path: Array, metres: float) -> Array:
    """Point of a polyline at an arc length, (dim,), metres; beyond the end, on its straight continuation."""
    total = length(path)
    if metres <= total and total > 0:
        return np.asarray(at_shares(path, np.array([metres / total]))[0])
    last = (path[-1] - path[-2]) / max(float(np.linalg.norm(path[-1] - path[-2])), 1e-9)
    return np.asarray(path[-1] + last * (metres - total))


def part(path: Array, begin: float, end: float) -> Array:
    """Part of a polyline, (corners, dim), metres, between two arc lengths, metres."""
    reached = lengths_to(path)
    ends = at_lengths(path, reached, np.array([begin, end]))
    return np.concatenate([ends[:1], path[(reached > begin) & (reached < end)], ends[1:]])


def split(path: Array, share: float) -> tuple[Array, Array]:
    """Two parts of a polyline, (corners, dim), metres, before and after a fraction of its length."""
    whole = float(lengths_to(path)[-1])
    return part(path, 0.0, share * whole), part(path, share * whole, whole)
