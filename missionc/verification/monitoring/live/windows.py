"""Online evaluation of temporal operators that look ahead: final values are folded once, and bounds cover the rest.

The value of an operator at a step is pending until its window has passed. Each pending step has an accumulator. A final
value of the operand goes into the accumulators of all steps whose window contains it, and is then no longer needed.
Minimum and maximum values over ranges of columns give the bounds.
"""

from __future__ import annotations

import numpy as np

from missionc.base.trace import Array, Indices
from missionc.ir.kernel.nodes import UntilNode, WindowNode
from missionc.verification.monitoring.live.atom_bounds import Cells
from missionc.verification.monitoring.live.bounds import LEASTS, MOSTS, denied
from missionc.verification.monitoring.live.columns import Columns

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
