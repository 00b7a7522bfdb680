"""Nodes of a path that agents go along together: how far along each is, and where.

A path is counted in steps at top speed, those of the agent that takes longest.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from missionc.base.trace import Array, Flags


@dataclass(frozen=True, slots=True, eq=False)
class Nodes:
    """Nodes of a path.

    Args:
        along: (nodes,), how far along each is.
        place: (agents, nodes, dim), metres.
    """

    along: Array
    place: Array

    def corner(self, here: int, there: int) -> int | None:
        """The node between two that is furthest from the straight way; None where the path is straight there."""
        bend = 0.03  # distance of a corner from the straight path, as a share of its length
        if there <= here + 1:
            return None
        ends, between = self.place[:, [here, there]], self.place[:, here + 1 : there]
        way = ends[:, 1:] - ends[:, :1]
        square = np.maximum((way**2).sum(axis=2, keepdims=True), 1e-18)
        share = np.clip(((between - ends[:, :1]) * way).sum(axis=2, keepdims=True) / square, 0.0, 1.0)
        aside = np.linalg.norm(between - ends[:, :1] - share * way, axis=2).max(axis=0)
        return here + 1 + int(aside.argmax()) if aside.max() > bend * np.sqrt(square.max()) else None


def lengths(path: Array, unit: Array) -> Array:
    """How long each step of a path is, (points - 1,).

    Args:
        path: (agents, points, dim), metres.
        unit: a step at top speed, (agents,), metres.
    """
    steps: Array = (np.linalg.norm(np.diff(path, axis=1), axis=2) / unit[:, None]).max(axis=0)
    return steps


def path_nodes(path: Array, unit: Array, fine: int, exactly: Flags) -> Nodes:
    """Nodes of a path, a cell of which is 1 / ``fine`` long.

    Args:
        path: (agents, points, dim), metres.
        unit: a step at top speed, (agents,), metres.
        exactly: the points at which it matters where somebody is, (points,).
    """
    fine_spacing, usual_spacing = 0.1, 0.5  # cells between two nodes at least
    steps = lengths(path, unit)
    reached = np.concatenate([[0.0], np.cumsum(steps)])
    parts = np.ceil(steps * fine).astype(np.int64)
    point = np.repeat(np.arange(len(steps)), parts)
    number = np.arange(len(point)) - np.repeat(np.cumsum(parts) - parts, parts) + 1
    time = np.concatenate([[0.0], point + number / parts[point]])
    along = np.interp(time, np.arange(len(reached)), reached)
    whole = time == np.floor(time)
    matters = whole & exactly[time.astype(np.int64)]
    kept = np.zeros(len(time), dtype=np.bool_)
    kept[[0, -1]] = True
    for some, spacing in ((matters, fine_spacing), (whole & ~matters, usual_spacing), (~whole, usual_spacing)):
        for each in np.flatnonzero(some & ~kept):
            taken = along[kept]
            place = int(np.searchsorted(taken, along[each]))
            kept[each] = np.abs(taken[max(place - 1, 0) : place + 1] - along[each]).min() > spacing / fine
    here = np.minimum(time[kept].astype(np.int64), path.shape[1] - 2)
    share = (time[kept] - here)[:, None]
    return Nodes(along[kept], path[:, here] * (1 - share) + path[:, here + 1] * share)
