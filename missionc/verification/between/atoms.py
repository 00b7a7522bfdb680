"""Sign of predicate and link margins along a trajectory, proved between samples.

Each predicate and each communication link gets the time intervals in which it surely holds and surely fails. If a
margin in the middle of an interval exceeds the margin's rate bound times half the length, its sign is constant in that
interval. Otherwise the interval is halved, down to ``RESOLUTION``; the remaining intervals are undecided.

Source:
    Mirtich, "Impulse-based Dynamic Simulation of Rigid Body Systems" (1996), section 2.3.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias, assert_never

import numpy as np

from missionc.base.trace import Array, Flags, Indices
from missionc.ir import BeaconCover, Flagged, Graph, Predicate, Proximity, Resource, Sight
from missionc.ir.language.margins.predicate_margins import holds, link_margin, margin
from missionc.ir.language.margins.resources import flag_truths
from missionc.ir.language.margins.view import View
from missionc.verification.between.interval_sets import STEP, Motion, Signal

RESOLUTION = 1e-4
"""Length of the shortest interval that the search still halves, seconds."""

CHUNK = 1 << 17
"""Number of time intervals that are evaluated together; it bounds the memory."""

EVALUATIONS = 10_000_000
"""Maximum number of margin evaluations for one predicate; later intervals stay undecided, which is sound but coarser.
"""

Margin: TypeAlias = Callable[[Indices, Indices, Array], Array]
"""Function that computes margins, (count,), from indices of items, indices of pieces, and seconds since the piece's
start.
"""


def atom_signals(predicate: Predicate, agents: Indices, motion: Motion) -> list[Signal]:
    """Time intervals in which a predicate surely holds and surely fails, for each agent.

    A predicate about the team gets a single signal.

    Args:
        agents: mission indices, (agents,).

    Raises:
        ValueError: the predicate is ``connected``; a kernel has routes instead.
    """
    if predicate.about_team:
        agents = np.zeros(1, dtype=np.int64)
    if isinstance(predicate, Flagged):
        return _of_steps(flag_truths(predicate.flag, motion.at_steps)[agents])
    if predicate.reads_heading and predicate.unit == "rad":
        return _of_steps(holds(predicate, margin(predicate, motion.mission, motion.at_steps))[agents])
    rate = np.broadcast_to(predicate.rate(_Speeds(motion, agents)), (agents.size, motion.joints.size - 1))
    border = 1 if bool(holds(predicate, np.zeros(1))[0]) else -1
    rest = np.ones(rate.shape, dtype=np.bool_)
    if predicate.reads_oneself(motion.mission.dimension):
        rest &= motion.speed[agents] == 0
    for other in predicate.others:
        rest &= motion.speed[other] == 0
    fixed = not (predicate.others or predicate.reads_oneself(motion.mission.dimension))

    def measured(item: Indices, piece: Indices, local: Array) -> Array:
        return np.asarray(predicate.margin(_Moments(motion, agents[item], piece, local)))

    return _signals(
        measured, rate, motion, border, rest, 0.0 if fixed else motion.slack, by_step=predicate.reads_heading
    )


def _of_steps(truth: Flags) -> list[Signal]:
    """Signals of a truth value that changes only at the steps.

    Args:
        truth: (agents, steps + 1), boolean.
    """
    items, steps = truth.shape
    item, step = np.divmod(np.arange(items * steps), steps)
    high = np.minimum((step + 1) * STEP, (steps - 1) * STEP)
    return _joined(items, item, step * STEP, high, np.where(truth.ravel(), 1, -1))


def link_signals(graph: Graph, first: Indices, second: Indices, motion: Motion) -> list[Signal]:
    """Time intervals in which the links of agent pairs surely exist and surely do not, one signal for each pair.

    Args:
        first, second: agent indices at both ends of the links, (pairs,).
    """

    def measured(pair: Indices, piece: Indices, local: Array) -> Array:
        here, there = (motion.position(agent[pair], piece, local) for agent in (first, second))
        return np.asarray(link_margin(graph, first[pair], second[pair], here, there))

    faster = np.maximum(motion.speed[first], motion.speed[second])
    match graph:
        case Proximity():
            rate = motion.relative_speed(first, second)
        case BeaconCover():
            rate = faster
        case Sight():
            rate = np.maximum(motion.relative_speed(first, second), faster)
        case _:
            assert_never(graph)
    rest = (motion.speed[first] == 0) & (motion.speed[second] == 0)
    return _signals(measured, rate, motion, -1, rest, motion.slack)


# --------------------------------------------------------------------- views


class _Moments(View):
    """View of agents along their trajectories, each at its own time.

    Items, pieces and seconds since the start of the piece have shape (count,) each.
    """

    def __init__(self, motion: Motion, agent: Indices, piece: Indices, local: Array) -> None:
        super().__init__(np, motion.mission.dimension)
        self.motion, self.agent, self.piece, self.local = motion, agent, piece, local
        self._own: Array | None = None

    def own(self) -> Array:
        if self._own is None:
            self._own = self.motion.position(self.agent, self.piece, self.local)
        return self._own

    def place(self, agent: int) -> Array:
        return self.motion.position(np.full_like(self.agent, agent), self.piece, self.local)

    def velocity(self) -> Array:
        return self.motion.velocity(self.agent, self.piece, self.local)

    def level(self, resource: Resource) -> Array:
        return self.motion.level(resource, self.agent, self.piece, self.local)

    def heading(self) -> Array:
        return self.motion.heading(self.agent, self.piece, self.local)

    def radius(self) -> Array:
        return np.array([agent.radius for agent in self.motion.mission.agents])[self.agent]

    def plane(self) -> Array:
        return np.array([agent.altitude for agent in self.motion.mission.agents])[self.agent]


class _Speeds:
    """View that replaces each measured quantity by a bound on its rate of change in each piece of a trajectory.

    Its arrays have shape (agents, pieces); for two named agents (1, pieces).
    """

    larger = staticmethod(np.maximum)

    def __init__(self, motion: Motion, agents: Indices) -> None:
        self.bounds, self.agents, self.dimension = motion, agents, motion.mission.dimension

    def motion(self) -> Array:
        return self.bounds.speed[self.agents]

    def relative(self, first: int | None, second: int) -> Array:
        those = self.agents if first is None else np.array([first])
        return self.bounds.relative_speed(those, np.full_like(those, second))

    def acceleration(self) -> Array:
        return self.bounds.acceleration[self.agents]

    def use(self, resource: Resource) -> Array:
        return self.bounds.use(resource)[self.agents][:, None]

    def along(self, direction: tuple[float, ...]) -> Array:
        return self.bounds.speed_along(self.agents, np.array(direction))


# --------------------------------------------------------------------- signs


def _signals(
    margin: Margin, rate: Array, motion: Motion, border: int, rest: Flags, slack: float, *, by_step: bool = False
) -> list[Signal]:
    """Time intervals in which each item's margin is surely positive and surely negative.

    Args:
        rate: bound on the margin's rate of change, (items, pieces), metres per second.
        border: 1 or -1, the sign assigned to a margin of exactly 0 while ``rest``, as at the steps.
        rest: (items, pieces): True if every agent that the margin reads is at rest.
        slack: bound on the rounding error of a margin.
        by_step: True if the margin may jump at steps as well as at joints.
    """
    items, _ = rate.shape
    shortest = max(1, int(RESOLUTION / motion.mission.step * STEP))
    pieces, lows, highs = motion.stretches(by_step=by_step)
    everything = np.arange(items * pieces.size)
    waiting = [
        (item, pieces[stretch], lows[stretch], highs[stretch])
        for item, stretch in (
            np.divmod(everything[begin : begin + CHUNK], pieces.size) for begin in range(0, everything.size, CHUNK)
        )
    ]
    intervals: list[tuple[Indices, Indices, Indices, Indices]] = []
    spent = 0
    while waiting:
        item, piece, low, high = waiting.pop()
        middle = (low + high) // 2
        value = margin(item, piece, motion.local(piece, middle))
        spent += item.size
        change = rate[item, piece] * motion.reach(low, high)
        sign = np.where(value > change + slack, 1, np.where(value < -change - slack, -1, 0))
        sign = np.where((value == 0) & (change == 0) & rest[item, piece], border, sign)
        done = (sign != 0) | (high - low <= shortest) | (change <= slack) | (spent > EVALUATIONS)
        intervals.append((item[done], low[done], high[done], sign[done]))
        item, piece, low, middle, high = (column[~done] for column in (item, piece, low, middle, high))
        halves = ((item, item), (piece, piece), (low, middle), (middle, high))
        item, piece, low, high = map(np.concatenate, halves)
        for begin in range(0, item.size, CHUNK):
            part = slice(begin, begin + CHUNK)
            waiting.append((item[part], piece[part], low[part], high[part]))
    return _joined(items, *(np.concatenate(columns) for columns in zip(*intervals, strict=True)))


def _joined(items: int, item: Indices, low: Indices, high: Indices, sign: Indices) -> list[Signal]:
    """Signals of all items, after joining adjacent intervals of one sign.

    At a jump of the margin, the time of the jump belongs to the later interval.
    """
    order = np.lexsort((high, low, item))
    item, low, high, sign = item[order], low[order], high[order], sign[order]
    first = np.flatnonzero(np.r_[True, (np.diff(item) != 0) | (np.diff(sign) != 0)])
    last = np.r_[first[1:] - 1, item.size - 1]
    sure: list[list[tuple[int, int]]] = [[] for _ in range(items)]
    never: list[list[tuple[int, int]]] = [[] for _ in range(items)]
    rows = list(zip(item[first].tolist(), low[first].tolist(), high[last].tolist(), sign[first].tolist(), strict=True))
    for (who, start, stop, what), after in zip(rows, [*rows[1:], (-1, 0, 0, 0)], strict=True):
        jumps = after[0] == who and what * after[3] < 0
        if what and stop - jumps >= start:
            (sure if what > 0 else never)[who].append((start, stop - jumps))
    return [Signal(tuple(sure[who]), tuple(never[who])) for who in range(items)]
