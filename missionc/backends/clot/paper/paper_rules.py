"""The paper's estimate of a moved waypoint's robustness by its rules, beside the exact ``perturbed_robustness``.

A least hides all but the worst of its parts, so the paper replaces it above a
moved waypoint: (I) a leaf has its value where the waypoint is moved; (II) a
conjunction directly above a leaf that reads the waypoint passes that leaf's
value on (the least of them, where they are several); (III) a conjunction
further up takes the mean of its parts; (IV) a disjunction takes the greatest.
What does not read the waypoint has its usual value.

A leaf is what is neither conjunction nor disjunction, so terms over links are
leaves too. ``a until b`` is read as ``b or (a and what is so one step later)``,
``release`` as ``b and (a or ...)``. Parts without limit stay out of means.

Source:
    [clot] IV-A.2.
"""

from __future__ import annotations

from math import inf

import numpy as np
import torch
from torch import Tensor

from missionc.backends.clot.cost_graph.cost_graph import (
    EveryLinked,
    Least,
    LeastOver,
    Length,
    Margin,
    Member,
    Of,
    Release,
    SomeLinked,
    Term,
    Until,
)
from missionc.backends.clot.cost_graph.leaf_margins import UNLIMITED
from missionc.backends.clot.paper.perturbed_robustness import Perturbed
from missionc.backends.clot.paper.sparsity_pattern import TermPattern, Window, mark, window
from missionc.base.trace import Flags


class PaperRules(Perturbed):
    """Values of terms by the paper's four rules; used as ``Perturbed`` is."""

    def value(self, term: Term, reading: TermPattern) -> Tensor:
        """The value of a term from those of the terms below it."""
        match term:
            case Least(parts):
                whole = self._conjunction(reading)
                for part in parts:
                    whole.add(self.laid(part, reading), self._touches(part, reading), is_leaf(part))
                return whole.value()
            case LeastOver(body) if is_leaf(body):
                return self._least_touched(term, body, reading)
            case LeastOver(body):
                shape, whole = window(term), self._conjunction(reading)
                for ahead in self._ahead(shape, reading):
                    whole.add(self.laid(body, reading, ahead=ahead), self._touches(body, reading, ahead), False)
                return whole.value()
            case Until():
                return self._until(term, reading)
            case Release():
                return self._release(term, reading)
            case _:
                return super().value(term, reading)

    def _until(self, term: Until, reading: TermPattern) -> Tensor:
        shape = window(term)
        later, nonzero = self._conjunction(reading).least, np.zeros_like(reading.nonzero)
        later = -later
        for ahead in reversed(self._ahead(shape, reading)):
            here, both = self._steps(reading, ahead), self._conjunction(reading)
            goes_on = self._steps(reading, ahead + 1) if ahead + 1 in self._ahead(shape, reading) else 0
            hold = self._touches(term.hold, reading, ahead)
            both.add(self.laid(term.hold, reading, ahead=ahead), hold, is_leaf(term.hold))
            both.add(later, nonzero, False)
            later = both.value()
            later[:, :, goes_on:] = -inf
            nonzero = both.nonzero.copy()
            nonzero[:, goes_on:] = False
            if ahead >= shape.low:
                end = self.laid(term.end, reading, ahead=ahead)
                later[:, :, :here] = torch.maximum(later[:, :, :here], end)
                nonzero[:, :here] |= self._touches(term.end, reading, ahead)
        return later

    def _release(self, term: Release, reading: TermPattern) -> Tensor:
        shape = window(term)
        later, nonzero = self._conjunction(reading).least, np.zeros_like(reading.nonzero)
        for ahead in reversed(self._ahead(shape, reading)):
            here, both = self._steps(reading, ahead), self._conjunction(reading)
            goes_on = self._steps(reading, ahead + 1) if ahead + 1 in self._ahead(shape, reading) else 0
            free = self.laid(term.free, reading, ahead=ahead)
            later[:, :, :here] = torch.maximum(later[:, :, :here], free)
            nonzero[:, :here] |= self._touches(term.free, reading, ahead)
            later[:, :, goes_on:] = inf
            nonzero[:, goes_on:] = False
            if ahead >= shape.low:
                end = self._touches(term.end, reading, ahead)
                both.add(self.laid(term.end, reading, ahead=ahead), end, is_leaf(term.end))
                both.add(later, nonzero, False)
                later, nonzero = both.value(), both.nonzero
        return later

    def _least_touched(self, term: LeastOver, body: Term, reading: TermPattern) -> Tensor:
        """Rule II for a window: of its leaves, those that read the waypoint."""
        shape, below = window(term), self.readings.of[body]
        width = shape.width((reading.first, reading.first + reading.steps - 1), self.position.shape[2])
        start = reading.first + shape.first - below.first
        passed = self._conjunction(reading).least
        for place, offset in enumerate(range(below.low, below.high + 1)):
            moved = self._touched(body, reading, shape.first, width, 1.0, inf, offset)
            assert moved is not None
            reads = below.nonzero[:, start : start + reading.steps + width - 1, place]
            reads = np.pad(reads, ((0, 0), (0, reading.steps + width - 1 - reads.shape[1])))
            flags = self._flags(np.lib.stride_tricks.sliding_window_view(reads, width, axis=1))
            piece = passed[:, :, :, place : place + width]
            piece.copy_(torch.minimum(piece, moved.masked_fill(~flags, inf)))
        return torch.where(self._flags(reading.nonzero), passed, self._usual(term, reading))

    def _ahead(self, shape: Window, reading: TermPattern) -> range:
        width = shape.width((reading.first, reading.first + reading.steps - 1), self.position.shape[2])
        return range(shape.first, shape.first + width)

    def _steps(self, reading: TermPattern, ahead: int) -> int:
        """How many of the steps have a step so far ahead of them."""
        return min(reading.steps, self.position.shape[2] - reading.first - ahead)

    def _touches(self, part: Term, reading: TermPattern, ahead: int = 0) -> Flags:
        """What a part touches, laid out as in ``laid``: (rows, steps, offsets)."""
        rows, _, offsets = reading.nonzero.shape
        nonzero = np.zeros((rows, self._steps(reading, ahead), offsets), dtype=bool)
        below = self.readings.of.get(part)
        if below is not None:
            start = below.low + ahead - reading.low
            inner = slice(max(start, 0), start + below.nonzero.shape[2])
            mark(nonzero[:, :, inner], reading.rows, below, reading.first + ahead)
        return nonzero

    def _usual(self, term: Term, reading: TermPattern) -> Tensor:
        value = self.unmoved.spread(self._rows(self.standard[term], reading.rows))
        return value[:, :, reading.first : reading.first + reading.steps, None, None]

    def _conjunction(self, reading: TermPattern) -> Conjunction:
        shape = (self.probes.shape[0], *reading.nonzero.shape, self.probes.shape[2])
        return Conjunction(self.position.new_full(shape, inf), np.zeros_like(reading.nonzero))

    def _flags(self, nonzero: Flags) -> Tensor:
        return _tensor(nonzero, self.position.device)


class Conjunction:
    """A conjunction whose parts come one after the other.

    Args:
        least: of the parts so far, (batch, rows, steps, offsets, directions).
        touched: (rows, steps, offsets), where a part so far reads the waypoint.
    """

    def __init__(self, least: Tensor, nonzero: Flags) -> None:
        self.least, self.nonzero = least, nonzero
        self.passed, self.leaves = least.clone(), nonzero.copy()
        self.total, self.count = torch.zeros_like(least), torch.zeros_like(least)

    def add(self, value: Tensor, nonzero: Flags, leaf: bool) -> None:
        """A part; it may be missing at the last steps."""
        steps = nonzero.shape[1]
        least, passed, total, count = (each[:, :, :steps] for each in (self.least, self.passed, self.total, self.count))
        least.copy_(torch.minimum(least, value))
        limited = value.abs() < UNLIMITED
        total += torch.where(limited, value, 0.0)
        count += limited
        self.nonzero[:, :steps] |= nonzero
        if leaf and nonzero.any():
            self.leaves[:, :steps] |= nonzero
            passed.copy_(torch.minimum(passed, torch.where(_tensor(nonzero, value.device), value, inf)))

    def value(self) -> Tensor:
        """By rule II where a leaf reads the waypoint, by rule III where any part does; else the least."""
        unlimited = (self.count == 0) | (self.least <= -UNLIMITED)
        mean = torch.where(unlimited, self.least, self.total / self.count.clamp(min=1.0))
        above = torch.where(_tensor(self.nonzero, mean.device), mean, self.least)
        return torch.where(_tensor(self.leaves, mean.device), self.passed, above)


def is_leaf(term: Term) -> bool:
    """Neither a conjunction nor a disjunction."""
    while isinstance(term, Of):
        term = term.body
    return isinstance(term, Margin | Member | SomeLinked | EveryLinked | Length)


def _tensor(nonzero: Flags, device: torch.device) -> Tensor:
    """(rows, steps, offsets) -> (1, rows, steps, offsets, 1)."""
    return torch.from_numpy(np.array(nonzero)).to(device, non_blocking=True)[None, ..., None]
