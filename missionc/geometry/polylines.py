"""Polylines: paths of straight pieces, (corners, dim) in metres, by their lengths."""

from __future__ import annotations

import numpy as np

from missionc.base.trace import Array
from missionc.geometry.vectors import norm


def length(path: Array) -> float:
    """Length of a path, metres."""
    return float(norm(np.diff(path, axis=0)).sum())


def lengths_to(path: Array) -> Array:
    """Lengths of a path up to each corner, (corners,), metres."""
    return np.asarray(np.r_[0.0, np.cumsum(norm(np.diff(path, axis=0)))])


def at_lengths(path: Array, reached: Array, metres: Array) -> Array:
    """Points of a path at lengths of it, (points,) -> (points, dim).

    Args:
        reached: of each corner, as ``lengths_to`` gives it, or in another unit with ``metres`` in that unit too.
    """
    return np.stack([np.interp(metres, reached, axis) for axis in path.T], axis=1)


def at_shares(path: Array, share: Array) -> Array:
    """Points at shares of the length of a path, (points,) -> (points, dim)."""
    total = length(path)
    if total == 0:
        return np.repeat(path[:1], len(share), axis=0)
    return at_lengths(path, lengths_to(path) / total, share)


def at_length(path: Array, metres: float) -> Array:
    """The point at a length of a path, (dim,); beyond its end, straight on."""
    total = length(path)
    if metres <= total and total > 0:
        return np.asarray(at_shares(path, np.array([metres / total]))[0])
    last = (path[-1] - path[-2]) / max(float(np.linalg.norm(path[-1] - path[-2])), 1e-9)
    return np.asarray(path[-1] + last * (metres - total))


def part(path: Array, begin: float, end: float) -> Array:
    """The part of a path between two lengths of it, metres."""
    reached = lengths_to(path)
    ends = at_lengths(path, reached, np.array([begin, end]))
    return np.concatenate([ends[:1], path[(reached > begin) & (reached < end)], ends[1:]])


def split(path: Array, share: float) -> tuple[Array, Array]:
    """A path up to a share of its length, and from there on."""
    whole = float(lengths_to(path)[-1])
    return part(path, 0.0, share * whole), part(path, share * whole, whole)
