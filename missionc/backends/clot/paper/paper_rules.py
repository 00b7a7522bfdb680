"""Paper's estimate of robustness under a moved waypoint, by its four rules.

A minimum hides all but the worst of its parts, so the paper replaces it above a moved waypoint. (I) A leaf has its
value with the waypoint moved. (II) A conjunction directly above a leaf that reads the waypoint has that leaf's value
(the least of several). (III) A conjunction further up has the mean of its parts. (IV) A disjunction has the maximum.
Formulas that do not read the waypoint have their usual value.

A leaf is a formula of one time, like the paper's predicates: "all robots are in the region" is its μ_A, and a
disjunction of two leaves reads the waypoint at that time only. Therefore ``always (row or parked)`` has the value at
the waypoint's time; with a mean, each waypoint would count for one step among all. Formulas over links are leaves too.
``a until b`` is read as ``b or (a and the same one step later)``, ``release`` as ``b and (a or ...)``. Infinite parts
are excluded from means.

Source:
    [clot] IV-A.2.
"""

from __future__ import annotations

from functools import reduce
from math import inf
from typing import TypeAlias

import numpy as np
import torch
from torch import Tensor

from missionc.backends.clot.paper.leaf_margins import UNLIMITED
from missionc.backends.clot.paper.motion_batch import Team
from missionc.backends.clot.paper.perturbed_robustness import Perturbed
from missionc.backends.clot.paper.sparsity_pattern import NodePattern, SparsityPattern, mark
from missionc.base.trace import Flags
from missionc.ir.kernel.nodes import All, Node, UntilNode, WindowNode
from missionc.ir.kernel.walk import children

Reading: TypeAlias = tuple[Tensor, Flags]
"""Values, (batch, rows, steps, offsets, directions), metres, with flags (rows, steps, offsets): reads the waypoint."""


class PaperRules(Perturbed):
    """Robustness under a moved waypoint by the paper's four rules.

    Args:
        enough: greatest value of a part in a mean, metres, so that no large margin compensates a failure.
    """

    def __init__(
        self, patterns: SparsityPattern, team: Team, position: Tensor, probes: Tensor, enough: float = inf
    ) -> None:
        super().__init__(patterns, team, position, probes)
        self.enough = enough

    def conjunction(self, node: All | WindowNode | UntilNode, pattern: NodePattern) -> Tensor:
        """Value of a conjunctive node: (batch, rows, steps, offsets, directions), metres."""
        if isinstance(node, UntilNode):
            return self._until(node, pattern)
        if isinstance(node, All) and self.is_leaf(node):
            return self._full(reduce(torch.minimum, [self.laid(part, pattern) for part in node.parts]), pattern)
        if isinstance(node, WindowNode) and self.at_moment(node.body):
            return self._passed(node, pattern)
        whole = self._conjunction(pattern)
        for part in children(node):
            for ahead in (0,) if isinstance(node, All) else self.ahead(node, pattern):
                whole.add(self.laid(part, pattern, ahead=ahead), self._reads(part, pattern, ahead), self.is_leaf(part))
        return whole.value()

    def _passed(self, node: WindowNode, pattern: NodePattern) -> Tensor:
        """Value of ``always`` over a single-time formula by rule II only, at the waypoint's time.

        Shape: (batch, rows, steps, offsets, directions), metres.
        """
        here = slice(pattern.first, pattern.first + pattern.steps)
        still = self.unmoved.spread(self._rows(self.standard[node], pattern.rows))[:, :, here, None, None]
        value, part, below = self._full(still, pattern).clone(), self.values[node.body], self.patterns.of[node.body]
        for offset in self.ahead(node, pattern):
            count, first = self._steps(pattern, offset), pattern.first + offset - below.first
            value[:, :, :count, offset - pattern.low] = part[:, :, first : first + count, 0]
        return value

    def _until(self, node: UntilNode, pattern: NodePattern) -> Tensor:
        """Value of ``until`` or its dual, computed from the last step of the window to the first.

        Shape: (batch, rows, steps, offsets, directions), metres.
        """
        held, ends = (self._or, self._and) if node.every else (self._and, self._or)
        nothing = inf if node.every else -inf
        later, nonzero = self.everywhere(nothing, pattern), np.zeros_like(pattern.nonzero)
        for ahead in reversed(self.ahead(node, pattern)):
            if ahead + 1 in self.ahead(node, pattern):
                goes_on = self._steps(pattern, ahead + 1)
                later, nonzero = held(node.hold, ahead, pattern, later, nonzero)
                later[:, :, goes_on:] = nothing
                nonzero[:, goes_on:] = False
            if ahead >= node.low:
                later, nonzero = ends(node.end, ahead, pattern, later, nonzero)
        return later

    def _and(self, part: Node, ahead: int, pattern: NodePattern, later: Tensor, nonzero: Flags) -> Reading:
        both = self._conjunction(pattern)
        both.add(self.laid(part, pattern, ahead=ahead), self._reads(part, pattern, ahead), self.is_leaf(part))
        both.add(later, nonzero, False)
        return both.value(), both.nonzero

    def _or(self, part: Node, ahead: int, pattern: NodePattern, later: Tensor, nonzero: Flags) -> Reading:
        here = self._steps(pattern, ahead)
        later[:, :, :here] = torch.maximum(later[:, :, :here], self.laid(part, pattern, ahead=ahead))
        nonzero[:, :here] |= self._reads(part, pattern, ahead)
        return later, nonzero

    def _steps(self, pattern: NodePattern, ahead: int) -> int:
        """Number of steps of the pattern for which the step ``ahead`` steps later exists."""
        return min(pattern.steps, self.position.shape[2] - pattern.first - ahead)

    def _reads(self, part: Node, pattern: NodePattern, ahead: int = 0) -> Flags:
        """Flags of the part's values that read the waypoint, in the layout of its parent: (rows, steps, offsets)."""
        rows, _, offsets = pattern.nonzero.shape
        nonzero = np.zeros((rows, self._steps(pattern, ahead), offsets), dtype=bool)
        below = self.patterns.of.get(part)
        if below is not None:
            start = below.low + ahead - pattern.low
            inner = slice(max(start, 0), start + below.nonzero.shape[2])
            mark(nonzero[:, :, inner], pattern.rows, below, pattern.first + ahead)
        return nonzero

    def _conjunction(self, pattern: NodePattern) -> Conjunction:
        return Conjunction(self.everywhere(inf, pattern), np.zeros_like(pattern.nonzero), self.enough)


class Conjunction:
    """Accumulator of a conjunction whose parts are added one after the other.

    Args:
        least: minimum of the parts so far, (batch, rows, steps, offsets, directions), metres.
        nonzero: (rows, steps, offsets), True if a part so far reads the waypoint.
        enough: greatest value of a part in the mean, metres.
    """

    def __init__(self, least: Tensor, nonzero: Flags, enough: float = inf) -> None:
        self.least, self.nonzero, self.enough = least, nonzero, enough
        self.passed, self.leaves = least.clone(), nonzero.copy()
        self.total, self.count = torch.zeros_like(least), torch.zeros_like(least)

    def add(self, value: Tensor, nonzero: Flags, leaf: bool) -> None:
        """Add the value of a part, (batch, rows, steps, offsets, directions), metres; it may be missing at the last
        steps."""
        steps = nonzero.shape[1]
        least, passed, total, count = (each[:, :, :steps] for each in (self.least, self.passed, self.total, self.count))
        least.copy_(torch.minimum(least, value))
        limited = value.abs() < UNLIMITED
        total += torch.where(limited, value.clamp(max=self.enough), 0.0)
        count += limited
        self.nonzero[:, :steps] |= nonzero
        if leaf and nonzero.any():
            self.leaves[:, :steps] |= nonzero
            passed.copy_(torch.minimum(passed, torch.where(_tensor(nonzero, value.device), value, inf)))

    def value(self) -> Tensor:
        """Value of the conjunction: by rule II if a leaf reads the waypoint, by rule III if another part does,
        otherwise the minimum of the parts.

        Shape: (batch, rows, steps, offsets, directions), metres.
        """
        unlimited = (self.count == 0) | (self.least <= -UNLIMITED)
        mean = torch.where(unlimited, self.least, self.total / self.count.clamp(min=1.0))
        above = torch.where(_tensor(self.nonzero, mean.device), mean, self.least)
        return torch.where(_tensor(self.leaves, mean.device), self.passed, above)


def _tensor(nonzero: Flags, device: torch.device) -> Tensor:
    """Boolean tensor of flags: (rows, steps, offsets) -> (1, rows, steps, offsets, 1)."""
    return torch.from_numpy(np.array(nonzero)).to(device, non_blocking=True)[None, ..., None]
