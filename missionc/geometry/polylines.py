"""Polylines: paths of straight pieces, (corners, dim) in metres, parametrised by length."""

from __future__ import annotations

import numpy as np

from missionc.base.trace import Array
from missionc.geometry.vectors import norm


def length(path: Array) -> float:
    """Length of a path, (corners, dim), metres."""
    return float(norm(np.diff(path, axis=0)).sum())


def lengths_to(path: Array) -> Array:
    """Lengths of a path, (corners, dim), up to each corner: (corners,), metres."""
    return np.asarray(np.r_[0.0, np.cumsum(norm(np.diff(path, axis=0)))])


def at_lengths(path: Array, reached: Array, metres: Array) -> Array:
    """Points of a path at given lengths: (points,) -> (points, dim), metres.

    Args:
        reached: length at each corner, (corners,), from ``lengths_to``, or another unit shared with ``metres``.
    """
    return np.stack([np.interp(metres, reached, axis) for axis in path.T], axis=1)


def at_shares(path: Array, share: Array) -> Array:
    """Points at dimensionless shares of the length of a path: (points,) -> (points, dim), metres."""
    total = length(path)
    if total == 0:
        return np.repeat(path[:1], len(share), axis=0)
    return at_lengths(path, lengths_to(path) / total, share)


def at_length(path: Array, metres: float) -> Array:
    """Point at a length of a path, (dim,), metres; beyond its end, on the straight continuation."""
    total = length(path)
    if metres <= total and total > 0:
        return np.asarray(at_shares(path, np.array([metres / total]))[0])
    last = (path[-1] - path[-2]) / max(float(np.linalg.norm(path[-1] - path[-2])), 1e-9)
    return np.asarray(path[-1] + last * (metres - total))


def part(path: Array, begin: float, end: float) -> Array:
    """Part of a path, (corners, dim), between two lengths, metres."""
    reached = lengths_to(path)
    ends = at_lengths(path, reached, np.array([begin, end]))
    return np.concatenate([ends[:1], path[(reached > begin) & (reached < end)], ends[1:]])


def split(path: Array, share: float) -> tuple[Array, Array]:
    """Split a path, (corners, dim), metres, at a share of its length."""
    whole = float(lengths_to(path)[-1])
    return part(path, 0.0, share * whole), part(path, share * whole, whole)
