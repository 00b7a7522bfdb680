"""Online evaluation of temporal operators that look ahead: final values are folded once, and bounds cover the rest.

The value of an operator at a step is pending until its window has passed. Each pending step has an accumulator. A final
value of the operand goes into the accumulators of all steps whose window contains it, and is then no longer needed.
Minimum and maximum values over ranges of columns give the bounds.

Robustness intervals in four rows: over all continuations, and over the continuations with one step of coasting.

Arrays of bounds are (4, rows, columns): minimum and maximum robustness of a formula over all motions within top speeds,
and both again if every agent keeps its present velocity for one more step. A row is an agent, or the single row is the
team; a column is a step, or a cell of future steps (``horizon_cells``).

Bounds of predicates and links now and in cells of future steps, from the agents' top speeds.

A cell is a range of steps. Even long missions have few cells; the next step and deadlines end a cell of their own.
Future positions are known only from the distance that agents can move until then, so bounds widen from step to step,
and the bounds at a cell's last step hold for the complete cell.

Source:
    Deshmukh, Donzé, Ghosh, Jin, Juniwal, Seshia, "Robust online monitoring of signal temporal logic" (2017), robust
    satisfaction intervals; there the future is completely unknown.

Robustness bounds of a formula by step: the past steps that are still read, and the future cells.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from missionc.base.late_dataclass import Record
from missionc.base.trace import Array, Indices
from missionc.ir import Flag, Flagged, Graph, Predicate
from missionc.ir.distances.signed_distance import signed_distance
from missionc.ir.kernel.nodes import UntilNode, WindowNode
from missionc.ir.language.margins.links import all_links
from missionc.ir.language.margins.resources import BORDER
from missionc.verification.monitoring.live.needed_steps import StepRange
from missionc.verification.monitoring.live.team_state import COASTED, NOW, Reach, TeamState, TeamView
from missionc.verification.monitoring.logic import decided_at_border

LEAST, MOST = 0, 1
LEASTS, MOSTS = [0, 2], [1, 3]
SWAPPED = [1, 0, 3, 2]
"""Order of the bounds' rows after negation: minimum and maximum values change places."""


def denied(bounds: Array) -> Array:
    """Robustness bounds of a formula's negation, metres: (4, …) -> (4, …), or (2, …) without coasting."""
    return -bounds[SWAPPED[: len(bounds)]]


def of_measure(value: float) -> float:
    """Robustness after removing the offset that ``decided_at_border`` adds to a margin of 0."""
    return 0.0 if abs(value) <= BORDER else value


MOST_DEADLINES = 8
"""Maximum number of upcoming deadlines that end a separate cell."""


class Cells(Record, eq=False):
    """Partition of the steps after ``now`` into cells, which are ranges of steps.

    Args:
        ends: the last step of each cell, (cells,), ascending; the first cell is one step, and the last ends with the
            mission. Empty if the mission is over.
    """

    now: int
    ends: Indices

    def __len__(self) -> int:
        return len(self.ends)

    @property
    def begins(self) -> Indices:
        """First step of each cell: (cells,)."""
        return np.concatenate(([self.now], self.ends[:-1])) + 1 if len(self.ends) else self.ends

    def of(self, steps: Indices) -> Indices:
        """Index of the cell that contains each step; for a step outside the future, the nearest cell."""
        return np.minimum(np.searchsorted(self.ends, steps), len(self.ends) - 1)


def cells_after(now: int, last: int, deadlines: Iterable[int], spans: Iterable[int]) -> Cells:
    """Cells of the steps after ``now``: their sizes double, and the nearest deadlines end a cell.

    Args:
        last: last step of the mission.
        deadlines: last steps of windows.
        spans: look-ahead, in steps, of windows that are evaluated at every step.
    """
    doubling, size = [], 1
    while now + size < last:
        doubling.append(now + size)
        size *= 2
    nearest = sorted({step for step in deadlines if now < step < last})[:MOST_DEADLINES]
    recurring = sorted({now + span for span in spans if 0 < span < last - now})[:MOST_DEADLINES]
    ends = sorted({*doubling, *nearest, *recurring, *([last] if last > now else [])})
    return Cells(now, np.array(ends, dtype=np.int64))


MOST_MEMBERS = 16
"""Number of members above which a graph's links are bounded in two cells only: the first and the last."""


class AtomBounds:
    """Cached bounds of predicates and links at the present step and in the cells after it."""

    def __init__(self, state: TeamState, cells: Cells) -> None:
        self.state = state
        seconds: Array = np.asarray((cells.ends - cells.now) * float(state.mission.step), dtype=np.float64)
        since_now: Array = np.zeros(1 + len(cells))
        since_now[1:] = seconds
        self.free = Reach(state, since_now, NOW)
        self.coasted = Reach(state, np.maximum(seconds - state.mission.step, 0.0), COASTED)
        self.view = TeamView(state)
        self.predicates: dict[Predicate, Array] = {}
        self.graphs: dict[Graph, Array] = {}

    def of_predicate(self, predicate: Predicate) -> Array:
        """Robustness bounds of a predicate at the present step and in the future cells: (4, rows, 1 + cells),
        metres.
        """
        if predicate not in self.predicates:
            bounds = self._of_flag(predicate.flag) if isinstance(predicate, Flagged) else self._of_margin(predicate)
            self.predicates[predicate] = decided_at_border(bounds, predicate.open_border)
        return self.predicates[predicate]

    def links(self, graph: Graph) -> Array:
        """Robustness bounds of a graph's links at the present step and in future cells: (4, 1 + cells, members,
        members), metres.

        Large graphs have only the first and last cell.
        """
        if graph not in self.graphs:
            members = list(graph.agents)
            margins = all_links(graph, self.state.position)
            pick = self.picked(graph)
            free = _between(self.free.radius[members][:, [0, *(1 + each for each in pick)]])
            coasted = _between(self.coasted.radius[members][:, pick])
            found = np.empty((4, 1 + len(pick), len(members), len(members)))
            found[0], found[1] = margins[NOW] - free, margins[NOW] + free
            found[2:, 0] = found[:2, 0]
            found[2, 1:], found[3, 1:] = margins[COASTED] - coasted, margins[COASTED] + coasted
            self.graphs[graph] = decided_at_border(found, is_open=True)
        return self.graphs[graph]

    def picked(self, graph: Graph) -> list[int]:
        """Indices of the cells in which a graph's links are bounded."""
        cells = self.free.seconds.size - 1
        return list(range(cells)) if len(graph.agents) <= MOST_MEMBERS or cells < 3 else [0, cells - 1]

    def _of_margin(self, predicate: Predicate) -> Array:
        margins = np.atleast_2d(predicate.margin(self.view))
        free, coasted = (np.atleast_2d(predicate.rate(each)) for each in (self.free, self.coasted))
        rows, cells = len(margins), self.free.seconds.size - 1
        free = np.broadcast_to(free, (rows, 1 + cells)).copy()
        coasted = np.broadcast_to(coasted, (rows, cells)).copy()
        if predicate.reads_heading:
            free[:, 0] = np.where(self.state.doubt > 0, np.inf, 0.0)
            free[:, 1:], coasted[:, 1:] = np.inf, np.inf
            coasted[:, :1] = free[:, :1]
        now, then = margins[:, :1], margins[:, 1:]
        return _stacked(now - free, now + free, then - coasted, then + coasted)

    def _of_flag(self, flag: Flag) -> Array:
        sides = []
        for side, sign in ((0, -1.0), (1, 1.0)):
            for reach, column in ((self.free, NOW), (self.coasted, COASTED)):
                place, margin = self.state.position[:, column], self.state.flags[flag][side, :, column, None]
                change = sign * reach.radius
                sets = -signed_distance(np, flag.set_in.shape, place)[:, None] + change
                stays = margin
                if flag.cleared_in is not None and sign < 0:
                    stays = np.minimum(margin, signed_distance(np, flag.cleared_in.shape, place)[:, None] + change)
                has = np.isin(np.arange(len(place)), flag.agents)[:, None]
                later = np.where(has, np.maximum(sets, stays), -np.inf)
                sides.append(np.where(reach.seconds > 0, later, margin))
        return _stacked(sides[0], sides[2], sides[1], sides[3])


def _stacked(least: Array, most: Array, coasted_least: Array, coasted_most: Array) -> Array:
    """Bounds over all continuations and over those with one step of coasting, in one array.

    They agree at the present step.

    Shape: (rows, 1 + cells) twice and (rows, cells) twice -> (4, rows, 1 + cells), metres.
    """
    found = np.empty((4, *least.shape))
    found[0], found[1] = least, most
    found[2:, :, 0] = found[:2, :, 0]
    found[2, :, 1:], found[3, :, 1:] = coasted_least, coasted_most
    return found


def _between(radius: Array) -> Array:
    """Upper bound on the change of each pair's distance, from the distance that each agent may move.

    Shape: (members, columns) -> (columns, members, members), metres.
    """
    change: Array = radius.T[:, :, None] + radius.T[:, None, :]
    itself = np.arange(len(radius))
    change[:, itself, itself] = 0.0
    return change


class Columns:
    """Robustness bounds of one formula by step, (4, rows, columns), in a buffer that shifts when it is full.

    The amortised cost of a step depends on the number of written columns, not on the mission's length.
    """

    def __init__(self, asked: StepRange, rows: int) -> None:
        self.asked, self.rows = asked, rows
        self.origin, self.now = asked.first, -1
        self.values = np.empty((4, rows, 0))

    def open(self, now: int, cells: int) -> None:
        """Allocate columns for the present step and the cells after it.

        Columns that are no longer read may be dropped.
        """
        self.now = now
        size = self.future + cells
        if size <= self.values.shape[2]:
            return
        base = max(self.origin, min(now - self.asked.kept - 1, self.asked.last))
        kept = self.values[:, :, base - self.origin :]
        self.origin = base
        grown = np.empty((4, self.rows, 2 * (self.future + cells) + 8))
        grown[:, :, : kept.shape[2]] = kept[:, :, : grown.shape[2]]
        self.values = grown

    @property
    def known(self) -> int:
        """Last step up to the present at which the formula is evaluated."""
        return min(self.now, self.asked.last)

    @property
    def begin(self) -> int:
        """First step at which the formula's value was not final before the present step."""
        return max(self.asked.first, self.now - self.asked.ahead)

    @property
    def future(self) -> int:
        """Column index of the first future cell."""
        return max(self.known + 1, self.asked.first) - self.origin

    def part(self, begin: int, count: int, cells: int) -> Array:
        """Temporary view of ``count`` steps from ``begin`` on and of the first future cells: (4, rows, columns),
        metres.
        """
        start = begin - self.origin if count > 0 else self.future
        return self.values[:, :, start : start + max(count, 0) + cells]

    def steps(self, begin: int, end: int) -> Array:
        """Bounds at the steps ``begin`` … ``end`` - 1: (4, rows, steps), metres."""
        return self.values[:, :, begin - self.origin : max(end, begin) - self.origin]

    def to_come(self, cells: int) -> Array:
        """Bounds in the future cells: (4, rows, cells), metres."""
        return self.values[:, :, self.future : self.future + cells]

    def at(self, steps: Indices, cells: Cells) -> Array:
        """Bounds at the given steps, for a future step those of its cell: (4, rows, steps), metres."""
        index = steps - self.origin
        if len(cells):
            index = np.where(steps > self.now, self.future + cells.of(steps), index)
        return self.values[:, :, np.clip(index, 0, self.values.shape[2] - 1)]


FEW = 4
"""Maximum number of column ranges that are reduced one by one."""


def over_ranges(choose: np.ufunc, values: Array, begin: Indices, end: Indices) -> Array:
    """Minimum or maximum (``choose``) over the columns ``begin`` … ``end`` of each range.

    Shape: (…, columns) -> (…, ranges), any unit.

    An empty range gives the neutral element: ``inf`` for ``minimum``, ``-inf`` for ``maximum``.
    """
    neutral = np.inf if choose is np.minimum else -np.inf
    result = np.full((*values.shape[:-1], len(begin)), neutral)
    begin, end = np.maximum(begin, 0), np.minimum(end, values.shape[-1] - 1)
    some = np.flatnonzero(begin <= end)
    if len(some) <= FEW:
        for each in some:
            result[..., each] = choose.reduce(values[..., begin[each] : end[each] + 1], axis=-1)
        return result
    level = np.zeros(len(begin), dtype=np.int64)
    level[some] = np.log2(end[some] - begin[some] + 1).astype(np.int64)
    doubled, size = values, 1
    for power in range(int(level.max()) + 1):
        mine = some[level[some] == power]
        if len(mine):
            result[..., mine] = choose(doubled[..., begin[mine]], doubled[..., end[mine] - size + 1])
        if doubled.shape[-1] > size:
            doubled = choose(doubled[..., :-size], doubled[..., size:])
        size *= 2
    return result


class _Ahead:
    """Operator that looks ahead: its pending steps, with accumulators (2, rows, steps) for final values of the
    operands.
    """

    def __init__(self, node: WindowNode | UntilNode, own: Columns, last: int, neutral: tuple[float, ...]) -> None:
        self.node, self.own, self.last = node, own, last
        self.origin = own.asked.first
        self.neutral = neutral
        self.waiting = [np.empty((2, own.rows, 0)) for _ in neutral]
        self.folded = -1

    def window(self, steps: Indices) -> tuple[Indices, Indices]:
        """First and last step of the window at each of the given steps; windows end with the mission."""
        high = (
            np.full_like(steps, self.last) if self.node.high is None else np.minimum(steps + self.node.high, self.last)
        )
        return steps + self.node.low, high

    def open(self, begin: int, known: int) -> None:
        """Drop the accumulators of steps before ``begin``, and create those up to the step ``known``."""
        drop = min(max(begin - self.origin, 0), self.waiting[0].shape[2])
        missing = known + 1 - begin - (self.waiting[0].shape[2] - drop)
        self.origin = max(begin, self.origin)
        for number, value in enumerate(self.neutral):
            kept = self.waiting[number][:, :, drop:]
            if drop or missing > 0:
                fresh = np.full((2, self.own.rows, max(missing, 0)), value)
                self.waiting[number] = np.concatenate([kept, fresh], axis=2)

    def those_that_hold(self, step: int) -> slice:
        """Slice of the accumulators of the pending steps whose window contains a step."""
        first = 0 if self.node.high is None else step - self.node.high - self.origin
        return slice(max(first, 0), max(step - self.node.low + 1 - self.origin, 0))


class Window(_Ahead):
    """Online evaluation of ``Always`` and ``Eventually``."""

    def __init__(self, node: WindowNode, own: Columns, body: Columns, last: int) -> None:
        super().__init__(node, own, last, (np.inf if node.every else -np.inf,))
        self.body = body
        self.choose = np.minimum if node.every else np.maximum

    def update(self, cells: Cells) -> Array:
        """Bounds of the operator at the pending steps and in the future cells: (4, rows, columns), metres."""
        now, own, body = cells.now, self.own, self.body
        begin, known = own.begin, own.known
        self.open(begin, known)
        (waiting,) = self.waiting
        final = self.last if now == self.last else now - body.asked.ahead
        final = min(final, body.known)
        for step in range(max(self.folded + 1, body.asked.first), final + 1):
            at = self.those_that_hold(step)
            value = body.steps(step, step + 1)[:2]
            waiting[:, :, at] = self.choose(waiting[:, :, at], value)
        self.folded = max(self.folded, final)
        steps = np.concatenate([np.arange(begin, known + 1), cells.ends if known == now or begin > now else []]).astype(
            np.int64
        )
        found = np.full((4, own.rows, len(steps)), self.neutral[0])
        found[:, :, : waiting.shape[2]] = waiting[[0, 1, 0, 1]]
        low, high = self.window(steps)
        settled = max(self.folded + 1, body.asked.first)
        if settled <= body.known:
            pending = body.steps(settled, body.known + 1)
            found = self.choose(found, over_ranges(self.choose, pending, low - settled, high - settled))
        if len(cells):
            ahead = np.flatnonzero(high > now)
            to_come = body.to_come(len(cells))
            near, far = to_come[:, :, cells.of(np.maximum(low, now + 1)[ahead])], to_come[:, :, cells.of(high[ahead])]
            first, other = (MOSTS, LEASTS) if self.node.every else (LEASTS, MOSTS)
            for rows, part in ((first, near), (other, far)):
                for row in rows:
                    found[row][:, ahead] = self.choose(found[row][:, ahead], part[row])
        return found


class UntilWindow(_Ahead):
    """Online evaluation of ``Until``, and of ``Release`` by negation."""

    def __init__(self, node: UntilNode, own: Columns, hold: Columns, end: Columns, last: int) -> None:
        super().__init__(node, own, last, (np.inf, -np.inf))
        self.hold, self.end = hold, end

    def update(self, cells: Cells) -> Array:
        """Bounds of the operator at the pending steps and in the future cells: (4, rows, columns), metres."""
        now, own, hold, end = cells.now, self.own, self.hold, self.end
        begin, known = own.begin, own.known
        self.open(begin, known)
        final = self.last if now == self.last else now - max(hold.asked.ahead, end.asked.ahead)
        self._fold(final)
        held, best = (each[[0, 1, 0, 1]] for each in self.waiting)
        to_come = known == now or begin > now
        steps = np.concatenate([np.arange(begin, known + 1), cells.ends if to_come else []]).astype(np.int64)
        fresh = len(steps) - held.shape[2]
        held, best = (
            np.concatenate([each, np.full((4, own.rows, fresh), value)], axis=2)
            for each, value in zip((held, best), self.neutral, strict=True)
        )
        low, high = self.window(steps)
        place = np.maximum(self.folded + 1, steps)
        opened = place <= high
        # Least value: ``end`` at the first step where it can still occur.
        first = np.maximum(low, place)
        until_then = np.minimum(held, self._held(place, first - 1, cells))
        least = np.minimum(until_then, self._at(self.end, first, cells))
        # Greatest value: ``end`` at once, or later while ``hold`` holds from now on.
        at_once = np.where(low <= place, np.minimum(held, self._at(self.end, place, cells)), -np.inf)
        later = np.minimum(
            np.minimum(held, self._at(self.hold, place, cells)), self._greatest(np.maximum(low, place + 1), high, cells)
        )
        most = np.maximum(at_once, np.where(place < high, later, -np.inf))
        found = best.copy()
        found[LEASTS] = np.maximum(best[LEASTS], np.where(opened, least[LEASTS], -np.inf))
        found[MOSTS] = np.maximum(best[MOSTS], np.where(opened, most[MOSTS], -np.inf))
        return denied(found) if self.node.every else found

    def _fold(self, final: int) -> None:
        held, best = self.waiting
        for step in range(max(self.folded + 1, self.own.asked.first), final + 1):
            at = self.those_that_hold(step)
            if self.end.asked.first <= step <= self.end.known:
                value = self._signed(self.end.steps(step, step + 1)[:2])
                best[:, :, at] = np.maximum(best[:, :, at], np.minimum(value, held[:, :, at]))
            if self.hold.asked.first <= step <= self.hold.known:
                begun = slice(0, max(step + 1 - self.origin, 0))
                value = self._signed(self.hold.steps(step, step + 1)[:2])
                held[:, :, begun] = np.minimum(held[:, :, begun], value)
        self.folded = max(self.folded, final)

    def _signed(self, bounds: Array) -> Array:
        return denied(bounds) if self.node.every else bounds

    def _at(self, operand: Columns, steps: Indices, cells: Cells) -> Array:
        return self._signed(operand.at(steps, cells))

    def _held(self, begin: Indices, end: Indices, cells: Cells) -> Array:
        """Bounds of "``hold`` at all steps from ``begin`` to ``end``": (4, rows, steps), metres."""
        found = self._over(np.minimum, self.hold, begin, end)
        if len(cells):
            ahead = (end > cells.now) & (end >= begin)
            found = np.where(ahead, np.minimum(found, self._at(self.hold, end, cells)), found)
        return found

    def _greatest(self, begin: Indices, end: Indices, cells: Cells) -> Array:
        """Bounds of "the operand ``end`` holds at some step from ``begin`` to ``end``": (4, rows, steps), metres."""
        found = self._over(np.maximum, self.end, begin, end)
        if len(cells):
            ahead = (end > cells.now) & (end >= begin)
            found = np.where(ahead, np.maximum(found, self._at(self.end, end, cells)), found)
        return found

    def _over(self, choose: np.ufunc, operand: Columns, begin: Indices, end: Indices) -> Array:
        """Minimum or maximum (``choose``) of an operand over the known steps that are not yet folded: (4, rows, steps),
        metres.
        """
        settled = max(self.folded + 1, operand.asked.first)
        pending = self._signed(operand.steps(settled, operand.known + 1))
        return over_ranges(choose, pending, begin - settled, np.minimum(end, operand.known) - settled)
