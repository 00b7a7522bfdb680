"""Operators of time that look back: all but the steps to come is known, and what came first is summed up."""

from __future__ import annotations

import numpy as np

from missionc.base.trace import Array
from missionc.kernel.nodes import UntilNode, WindowNode
from missionc.monitoring.live.asked_steps import reaches_start
from missionc.monitoring.live.bounds import LEASTS, MOSTS, denied
from missionc.monitoring.live.columns import Columns
from missionc.monitoring.live.horizon_cells import Cells, Indices


class PastWindow:
    """``once`` and ``since``; their duals by their negation. Without ``hold``, whatever was in between counts for true.

    Where every window reaches back to step 0, what the steps of long ago came to is one number, ``carried``.
    """

    def __init__(
        self, node: WindowNode | UntilNode, own: Columns, hold: Columns | None, end: Columns, last: int
    ) -> None:
        self.node, self.own, self.hold, self.end, self.last = node, own, hold, end, last
        self.near, self.far = -(node.high or 0), -node.low
        self.carries = reaches_start(node, own.asked)
        self.folded = -1
        self.carried = np.full((4, own.rows, 1), -np.inf)

    def update(self, cells: Cells) -> Array:
        """The bounds at the steps that are not final, and in the cells to come: (4, rows, columns)."""
        now, own = cells.now, self.own
        begin, known = own.begin, own.known
        if self.carries:
            self._carry(min(begin - 1 - self.near, now - self.end.asked.ahead, now - self._hold_ahead()))
        columns = [self._since(step, step - self.far, step - self.near) for step in range(begin, known + 1)]
        if len(cells) and (known == now or begin > now):
            columns.append(self._to_come(cells))
        found = np.concatenate(columns, axis=2) if columns else np.empty((4, own.rows, 0))
        return denied(found) if self.node.every else found

    def _hold_ahead(self) -> int:
        return 0 if self.hold is None else self.hold.asked.ahead

    def _carry(self, final: int) -> None:
        for step in range(self.folded + 1, min(final, self.end.known) + 1):
            value = self._of(self.end, step, step + 1)
            if self.hold is not None and self.hold.asked.first <= step <= self.hold.known:
                self.carried = np.minimum(self.carried, self._of(self.hold, step, step + 1))
            self.carried = np.maximum(self.carried, value)
            self.folded = step

    def _since(self, step: int, begin: int, end: int) -> Array:
        """``end`` at some step from ``begin`` to ``end``, ``hold`` after it up to ``step``: (4, rows, 1)."""
        first = max(begin, self.folded + 1, 0)
        if self.hold is None:
            ends = self._of(self.end, first, end + 1)
            found = ends.max(axis=2, keepdims=True, initial=-np.inf)
            found = np.maximum(found, self.carried) if self.carries and begin <= self.folded else found
            return np.asarray(found)
        first = max(first, self.hold.asked.first - 1, self.end.asked.first)
        # From the present back: what ``hold`` came to after each step.
        since = self._of(self.hold, first + 1, step + 1)[:, :, ::-1]
        held = np.minimum.accumulate(np.concatenate([np.full((4, since.shape[1], 1), np.inf), since], axis=2), axis=2)
        held = held[:, :, ::-1]
        ends = self._of(self.end, first, end + 1)
        found = np.minimum(ends, held[:, :, : ends.shape[2]]).max(axis=2, keepdims=True, initial=-np.inf)
        if self.carries and begin <= self.folded:
            whole = self._of(self.hold, first, step + 1).min(axis=2, keepdims=True, initial=np.inf)
            found = np.maximum(found, np.minimum(self.carried, whole))
        return np.broadcast_to(found, (4, self.own.rows, 1))

    def _to_come(self, cells: Cells) -> Array:
        """The cells: what is known of the window of each step, and what may come. They widen from one to the next."""
        now, count = cells.now, len(cells)
        ends = self._signed(self.end.to_come(count))
        holds = None if self.hold is None else self._signed(self.hold.to_come(count))
        found = np.full((4, self.own.rows, count), -np.inf)
        if self.hold is None and self.near == 0:
            # Every window reaches up to now: what it holds is the end of what is known.
            begin = max(now - self.far, self.folded + 1, self.end.asked.first)
            whole = self._of(self.end, begin, now + 1)[:2, :, ::-1]
            so_far = np.maximum.accumulate(whole, axis=2)[[0, 1, 0, 1], :, ::-1]
            at = np.stack([cells.ends, cells.begins]) - self.far - begin
            known = [self._part(so_far, each) for each in at]
            found[LEASTS] = np.maximum(known[0], ends)[LEASTS]
            found[MOSTS] = np.maximum(known[1], ends)[MOSTS]
            return self._widening(found)
        for cell, (first, last) in enumerate(zip(cells.begins.tolist(), cells.ends.tolist(), strict=True)):
            surely = self._since(now, last - self.far, min(now, first - self.near))
            perhaps = self._since(now, first - self.far, min(now, last - self.near))
            if holds is not None:
                surely = np.minimum(surely, holds[:, :, cell : cell + 1])
                perhaps = np.minimum(perhaps, holds[:, :, :1])
            least, most = surely[:, :, 0], perhaps[:, :, 0]
            if self.near == 0:
                least = np.maximum(least, ends[:, :, cell])
            if last - self.near > now and self.end.asked.last > now:
                most = np.maximum(most, ends[:, :, int(cells.of(np.array(last - self.near)))])
            found[LEASTS, :, cell], found[MOSTS, :, cell] = least[LEASTS], most[MOSTS]
        return self._widening(found)

    def _part(self, so_far: Array, begin: Indices) -> Array:
        """What the steps from each of these columns on came to; from before them, with what was summed up."""
        columns = so_far.shape[2]
        if not columns:
            found = np.full((4, self.own.rows, len(begin)), -np.inf)
        else:
            found = so_far[:, :, np.clip(begin, 0, columns - 1)]
            found = np.where(begin >= columns, -np.inf, found)
        return np.where(begin < 0, np.maximum(found, self.carried), found) if self.carries else found

    def _widening(self, found: Array) -> Array:
        """Bounds of cells that hold for those before them too."""
        for row in LEASTS:
            found[row] = np.minimum.accumulate(found[row], axis=1)
        for row in MOSTS:
            found[row] = np.maximum.accumulate(found[row], axis=1)
        return found

    def _signed(self, bounds: Array) -> Array:
        return denied(bounds) if self.node.every else bounds

    def _of(self, operand: Columns, begin: int, end: int) -> Array:
        """The columns of an operand at known steps that it is asked at."""
        begin = max(begin, operand.asked.first)
        return self._signed(operand.steps(begin, max(min(end, operand.known + 1), begin)))
