"""The paper's estimate of a moved waypoint's robustness by its rules.

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
from typing import assert_never

import numpy as np
import torch
from torch import Tensor

from missionc.backends.clot.cost_graph.leaf_margins import UNLIMITED
from missionc.backends.clot.paper.perturbed_robustness import Perturbed
from missionc.backends.clot.paper.sparsity_pattern import TermPattern, mark, window
from missionc.base.trace import Flags
from missionc.kernel import nodes as kernel
from missionc.kernel.nodes import LeafNode, NeighbourNode, Node, RouteNode, UntilNode


class PaperRules(Perturbed):
    """Values of formulas by the paper's four rules."""

    def conjunction(self, node: kernel.All | kernel.Always | UntilNode, pattern: TermPattern) -> Tensor:
        match node:
            case kernel.All(parts):
                whole = self._conjunction(pattern)
                for part in parts:
                    whole.add(self.laid(part, pattern), self._reads(part, pattern), is_leaf(part))
                return whole.value()
            case kernel.Always(body):
                whole = self._conjunction(pattern)
                for ahead in self.ahead(node, pattern):
                    whole.add(self.laid(body, pattern, ahead=ahead), self._reads(body, pattern, ahead), is_leaf(body))
                return whole.value()
            case kernel.Until():
                return self._until(node, pattern)
            case kernel.Release():
                return self._release(node, pattern)
            case _:
                assert_never(node)

    def _until(self, term: kernel.Until, pattern: TermPattern) -> Tensor:
        shape = window(term)
        later, nonzero = self._conjunction(pattern).least, np.zeros_like(pattern.nonzero)
        later = -later
        for ahead in reversed(self.ahead(term, pattern)):
            here, both = self._steps(pattern, ahead), self._conjunction(pattern)
            goes_on = self._steps(pattern, ahead + 1) if ahead + 1 in self.ahead(term, pattern) else 0
            hold = self._reads(term.hold, pattern, ahead)
            both.add(self.laid(term.hold, pattern, ahead=ahead), hold, is_leaf(term.hold))
            both.add(later, nonzero, False)
            later = both.value()
            later[:, :, goes_on:] = -inf
            nonzero = both.nonzero.copy()
            nonzero[:, goes_on:] = False
            if ahead >= shape.low:
                end = self.laid(term.end, pattern, ahead=ahead)
                later[:, :, :here] = torch.maximum(later[:, :, :here], end)
                nonzero[:, :here] |= self._reads(term.end, pattern, ahead)
        return later

    def _release(self, term: kernel.Release, pattern: TermPattern) -> Tensor:
        shape = window(term)
        later, nonzero = self._conjunction(pattern).least, np.zeros_like(pattern.nonzero)
        for ahead in reversed(self.ahead(term, pattern)):
            here, both = self._steps(pattern, ahead), self._conjunction(pattern)
            goes_on = self._steps(pattern, ahead + 1) if ahead + 1 in self.ahead(term, pattern) else 0
            free = self.laid(term.hold, pattern, ahead=ahead)
            later[:, :, :here] = torch.maximum(later[:, :, :here], free)
            nonzero[:, :here] |= self._reads(term.hold, pattern, ahead)
            later[:, :, goes_on:] = inf
            nonzero[:, goes_on:] = False
            if ahead >= shape.low:
                end = self._reads(term.end, pattern, ahead)
                both.add(self.laid(term.end, pattern, ahead=ahead), end, is_leaf(term.end))
                both.add(later, nonzero, False)
                later, nonzero = both.value(), both.nonzero
        return later

    def _steps(self, pattern: TermPattern, ahead: int) -> int:
        """How many of the steps have a step so far ahead of them."""
        return min(pattern.steps, self.position.shape[2] - pattern.first - ahead)

    def _reads(self, part: Node, pattern: TermPattern, ahead: int = 0) -> Flags:
        """What a part touches, laid out as in ``laid``: (rows, steps, offsets)."""
        rows, _, offsets = pattern.nonzero.shape
        nonzero = np.zeros((rows, self._steps(pattern, ahead), offsets), dtype=bool)
        below = self.patterns.of.get(part)
        if below is not None:
            start = below.low + ahead - pattern.low
            inner = slice(max(start, 0), start + below.nonzero.shape[2])
            mark(nonzero[:, :, inner], pattern.rows, below, pattern.first + ahead)
        return nonzero

    def _conjunction(self, pattern: TermPattern) -> Conjunction:
        return Conjunction(self.everywhere(inf, pattern), np.zeros_like(pattern.nonzero))


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


def is_leaf(term: Node) -> bool:
    """Neither a conjunction nor a disjunction."""
    while isinstance(term, kernel.At):
        term = term.body
    return isinstance(term, kernel.Not | LeafNode | NeighbourNode | RouteNode)


def _tensor(nonzero: Flags, device: torch.device) -> Tensor:
    """(rows, steps, offsets) -> (1, rows, steps, offsets, 1)."""
    return torch.from_numpy(np.array(nonzero)).to(device, non_blocking=True)[None, ..., None]
