"""Path-velocity decomposition: dynamic programming of the progress along a fixed path, with rests.

    in   nodes of a path, and at which step, at which speed, each of them is allowed
    out  the node at each moment, in their order; None where there are none

Several agents go along one path together: a node is how far along it is, and where each agent is then. A path is
counted in steps at top speed, those of the agent that takes longest.

Each step in which something moves costs 1 and the square of its speed over ``PACE``, so that a path costs least at that
pace, and rest costs nothing. Dynamic programming over (moment, node, last step) finds the least. Unlike
``space_time_search`` it has one dimension of space, and the last step in its state, for the acceleration.

Source:
    Kant and Zucker, "Toward Efficient Trajectory Planning: The Path-Velocity Decomposition", 1986.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass

import numpy as np

from missionc.base.trace import Array, Flags, Indices


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


PACE = 0.4
"""The share of the top speed at which a way costs least."""

SETTING_OUT = 2.0
"""What it costs to set out, in steps: so that a way is gone in one piece."""

CHANGE = 4.0
"""What it costs to change to or from that pace within a step, where the velocity may jump; else the square of it."""

SPEEDS = tuple(number / 16 for number in range(17))
"""The shares of the top speed at which it is asked whether what reads a speed holds."""

ROUNDING = 1e-9

SOON = 1e-6
"""What each step costs in which a step at top speed is still to go: of two ways that cost the same the sooner one."""


@dataclass(frozen=True, slots=True, eq=False)
class Bounds:
    """What a motion along a path has to keep.

    Args:
        allowed: at each speed of ``SPEEDS``, (speeds, steps + 1, nodes).
        unit: a step at top speed, (agents,), metres.
        top: how long a step may be.
        gain: by how much a step may differ from the one before it, as a share of such a step; infinite where the
            velocity may jump.
        begin: moments at the beginning that are at the first node.
        last: the moment after which nothing moves.
        finish: whether it ends at the last node; where ``gain`` is finite, at rest.
        forbidden: two nodes that are not one step apart.
        stops: nodes that no step leads over, and for how many steps whoever passes has to turn there.
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
    """What the steps of a motion cost, (steps,), each in steps at top speed."""
    moving = lengths > 0
    sets_out = moving & ~np.concatenate([[False], moving[:-1]])
    return float((moving + (lengths / PACE) ** 2 + SETTING_OUT * sets_out).sum())


def path_velocity(nodes: Nodes, bounds: Bounds) -> Indices | None:
    """The node at each moment: at each step; where ``gain`` is finite steps are halfway between two moments.

    Returns:
        (steps + 1,), or one more.
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
    """The costs of steps, (nodes, most + 1): of those that leave a node for the one so many ahead. A node at which an
    agent turns for some steps is there as often again, and each step of turning leads from one to the next."""

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
        """What one step after another costs beside the two, (nodes, most + 1, most + 1): of a node by how far back the
        one begins and how far ahead the other leads."""
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
        """For each step that leaves a node the one it came by; and what it costs to be at each node after a step."""
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
        """With which steps to which nodes a motion may end, (nodes, most + 1)."""
        ends = np.ones_like(self.cost, dtype=np.bool_)
        if not self.smooth:
            ends &= self.allowed[0, -1][:, None]
        if self.bounds.finish:
            ends[:-1] = False
            ends[:, 1:] &= not self.smooth
        return ends
