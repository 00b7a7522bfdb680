"""Path-velocity decomposition: dynamic programming of the progress along a fixed path, with rests.

    in   nodes of a path, with the allowed steps and speeds of each
    out  the node at each time, in order; None if impossible

Several agents move along one path together: a node has the progress, and the position of each agent at that progress.
Path lengths are in steps at top speed of the slowest agent.

Each step in motion costs 1 plus the square of its speed divided by ``PACE``, so that a path is cheapest at that speed,
and rest is free. Dynamic programming over (time, node, last step) finds the minimum. Unlike ``space_time_search``, it
has one space dimension, and the last step in its state for the acceleration.

Source:
    Kant and Zucker, "Toward Efficient Trajectory Planning: The Path-Velocity Decomposition", 1986.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping

import numpy as np

from missionc.base.late_dataclass import Record
from missionc.base.trace import Array, Flags, Indices


class Nodes(Record, eq=False):
    """Nodes of a path that several agents follow together.

    Args:
        along: progress at each node, (nodes,).
        place: positions of the agents at each node, (agents, nodes, dim), metres.
    """

    along: Array
    place: Array

    def corner(self, here: int, there: int) -> int | None:
        """Index of the node between two others that is furthest from the straight connection; None if the path is
        nearly straight."""
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
    """Length of each segment of a path, (points - 1,), in steps at top speed (dimensionless).

    Args:
        path: (agents, points, dim), metres.
        unit: length of a step at top speed, (agents,), metres.
    """
    steps: Array = (np.linalg.norm(np.diff(path, axis=1), axis=2) / unit[:, None]).max(axis=0)
    return steps


def path_nodes(path: Array, unit: Array, fine: int, exactly: Flags) -> Nodes:
    """Nodes of a path with a spacing of 1 / ``fine`` steps at top speed.

    Args:
        path: (agents, points, dim), metres.
        unit: length of a step at top speed, (agents,), metres.
        exactly: (points,), True for points that must be nodes.
    """
    fine_spacing, usual_spacing = 0.1, 0.5  # least number of cells between two nodes
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


PACE = 0.4
"""Fraction of the top speed at which a path costs least."""

SETTING_OUT = 2.0
"""Cost of starting to move, in steps, so that a path is traversed without stops."""

CHANGE = 4.0
"""Cost of changing to or from the cheapest speed, if the velocity may jump; otherwise of the squared change."""

SPEEDS = tuple(number / 16 for number in range(17))
"""Fractions of the top speed at which predicates of speed are evaluated."""

ROUNDING = 1e-9

SOON = 1e-6
"""Cost of each step while a step's length remains to travel, so that of equal motions the earliest is selected."""


class Bounds(Record, eq=False):
    """Constraints of a motion along a path.

    Args:
        allowed: allowed nodes at each speed of ``SPEEDS``, (speeds, steps + 1, nodes).
        unit: length of a step at top speed, (agents,), metres.
        top: maximum length of a step.
        gain: greatest difference of consecutive steps, as a fraction of a step at top speed; infinite if the velocity
            may jump.
        begin: number of initial times at the first node.
        last: time after which nothing moves.
        finish: True if the motion ends at the last node; with finite ``gain``, at rest.
        forbidden: pairs of nodes that may not be one step apart.
        stops: nodes that no step may skip, with the number of steps for turning there.
    """

    allowed: Flags
    unit: Array
    top: float
    gain: float
    begin: int
    last: int
    finish: bool
    forbidden: Collection[tuple[int, int]]
    stops: Mapping[int, int]


def restlessness(lengths: Array) -> float:
    """Cost of the steps of a motion, (steps,), each in steps at top speed (dimensionless)."""
    moving = lengths > 0
    sets_out = moving & ~np.concatenate([[False], moving[:-1]])
    return float((moving + (lengths / PACE) ** 2 + SETTING_OUT * sets_out).sum())


def path_velocity(nodes: Nodes, bounds: Bounds) -> Indices | None:
    """Index of the node at each time: at each step, or with finite ``gain``, with steps halfway between two times.

    Returns:
        (steps + 1,), or one more; None if no motion satisfies the bounds.
    """
    tuning = _Tuning(nodes, bounds)
    choices: list[Indices] = []
    value = np.full(tuning.cost.shape, np.inf)
    value[0, 0] = 0.0
    for moment in range(1, tuning.moments):
        choice, value = tuning.step(moment, value)
        choices.append(choice)
    value = np.where(tuning.ends(), value, np.inf)
    node, step = (int(each) for each in np.unravel_index(int(value.argmin()), value.shape))
    if not np.isfinite(value[node, step]):
        return None
    found = np.zeros(tuning.moments, dtype=np.int64)
    for moment in range(tuning.moments - 1, 0, -1):
        found[moment] = node
        node -= step
        step = int(choices[moment - 1][node, step])
    return tuning.places[found]


class _Tuning:
    """Tables of the dynamic program: costs of steps, (nodes, most + 1), by node and number of nodes ahead.

    A node with turning steps is repeated accordingly, and each turning step leads from one copy to the next.
    """

    def __init__(self, nodes: Nodes, bounds: Bounds) -> None:
        self.bounds = bounds
        stops = bounds.stops
        self.smooth = bool(np.isfinite(bounds.gain))
        self.places = places = np.repeat(
            np.arange(len(nodes.along)), [1 + stops.get(node, 0) for node in range(len(nodes.along))]
        )
        self.along, self.allowed = nodes.along[places], bounds.allowed[:, :, places]
        count, number = len(places), np.arange(len(places))
        self.moments = self.allowed.shape[1] + self.smooth
        again = np.diff(places, prepend=-1) == 0
        ahead = np.searchsorted(self.along, self.along + bounds.top + ROUNDING, side="right") - 1 - number
        for each in np.flatnonzero(again | np.isin(places, list(stops))):
            ahead[:each] = np.minimum(ahead[:each], each - number[:each])
        self.width = width = np.arange(int(ahead.max(initial=0)) + 1)
        to = np.minimum(number[:, None] + width, count - 1)
        length = self.along[to] - self.along[:, None]
        self.cost = np.where(width > ahead[:, None], np.inf, (width > 0) + (length / PACE) ** 2)
        for here, there in bounds.forbidden:
            leaves, arrives = np.searchsorted(places, here, side="right") - 1, np.searchsorted(places, there)
            if arrives - leaves < len(width):
                self.cost[leaves, arrives - leaves] = np.inf
        self.speed = np.minimum(np.searchsorted(SPEEDS, length), len(SPEEDS) - 1)
        self.where = np.minimum(number[:, None] + width // 2, count - 1) if self.smooth else number[:, None]
        self.links = self._links(nodes.place[:, places], to, number, length)

    def _links(self, place: Array, to: Indices, number: Indices, length: Array) -> Array:
        """Additional cost of one step after another, (nodes, most + 1, most + 1), dimensionless: by node, start of the
        first step, and end of the second."""
        width, before = self.width, np.maximum(number[:, None] - self.width, 0)
        charge = np.where((width[:, None] == 0) & (width > 0), SETTING_OUT, 0.0)
        if not self.smooth:
            came = self.along[:, None] - self.along[before]
            return np.asarray(charge + CHANGE * ((length[:, None] - came[:, :, None]) / PACE) ** 2)
        change = np.zeros((len(number), len(width), len(width)))
        for own, unit in zip(place, self.bounds.unit, strict=True):
            leaves, came = own[to] - own[:, None], own[:, None] - own[before]
            change = np.maximum(change, np.linalg.norm(leaves[:, None] - came[:, :, None], axis=-1) / unit)
        return np.where(change <= self.bounds.gain, charge, np.inf)

    def step(self, moment: int, value: Array) -> tuple[Indices, Array]:
        """Predecessor of each step that leaves a node, and the costs at each node after a step.

        Shape: (nodes, most + 1) twice; indices, and dimensionless costs.
        """
        every = value[:, :, None] + self.links
        choice, leaving = every.argmin(axis=1), every.min(axis=1)
        leaving = np.where(self.allowed[self.speed, moment - 1, self.where], leaving + self.cost, np.inf)
        if moment < self.bounds.begin or moment > self.bounds.last:
            leaving[:, 1:] = np.inf
        arriving = np.full_like(leaving, np.inf)
        for ahead in range(min(len(self.width), len(leaving))):
            arriving[ahead:, ahead] = leaving[: len(leaving) - ahead, ahead]
        return choice, arriving + SOON * (self.along[-1] - self.along)[:, None]

    def ends(self) -> Flags:
        """Return true for each possible combination of last node and last step, (nodes, most + 1)."""
        ends = np.ones_like(self.cost, dtype=np.bool_)
        if not self.smooth:
            ends &= self.allowed[0, -1][:, None]
        if self.bounds.finish:
            ends[:-1] = False
            ends[:, 1:] &= not self.smooth
        return ends
