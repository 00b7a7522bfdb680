"""Encoding of temporal operators: literals for windows of steps, and for until."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

import numpy as np

from missionc.backends.smt.encode.clauses import FALSE, NOTHING, TRUE, Clauses, Literals
from missionc.base.trace import Indices
from missionc.ir.kernel.nodes import Node, UntilNode, WindowNode


class AgentWindows(Protocol):
    """Interface of literals for formulas about agents: (cells,) twice, an agent and a step each, -> literals,
    (cells,)."""

    def holds(self, node: Node, agents: Indices, steps: Indices) -> Literals: ...


Body = Callable[[Indices, Indices], Literals]


class Windows:
    """Literals of temporal operators; a cell is a pair of agent and step, (cells,) each. Past the last step every
    formula is false."""

    def __init__(self, of_agents: AgentWindows, last: int, clauses: Clauses) -> None:
        self.of_agents, self.last, self.clauses = of_agents, last, clauses
        self._spans: dict[tuple[Node, bool, int], dict[int, int]] = {}

    def window(self, node: WindowNode, agents: Indices, steps: Indices) -> Literals:
        """Literals that the body is true at every step of the window ahead (``Always``), or at some step
        (``Eventually``): (cells,)."""
        first = steps + node.low
        final = np.full_like(steps, self.last) if node.high is None else steps + node.high
        result = np.full(len(steps), FALSE, dtype=np.int32)
        there = (first <= final) & (final <= self.last)
        result[there] = self._between(node.body, node.every, agents[there], first[there], final[there])
        return result

    def until(self, node: UntilNode, agents: Indices, steps: Indices) -> Literals:
        """Literals of ``Until`` or its dual: (cells,).

        ``Until`` is equivalent to an end within the window together with a chain of ``hold`` to the first end; all
        cells share the chains.
        """
        some = not node.every
        first = steps + node.low
        final = np.full_like(steps, self.last) if node.high is None else steps + node.high
        result = np.full(len(steps), FALSE, dtype=np.int32)
        there = np.flatnonzero((first <= final) & (final <= self.last))
        agents, steps, first, final = agents[there], steps[there], first[there], final[there]
        if not there.size:
            return result
        furthest = int(final.max())
        parts = [self._chain(node, agents, first, furthest)]
        bounded = final < furthest
        if bounded.any():
            inside = np.full(len(there), TRUE if some else FALSE, dtype=np.int32)
            window = agents[bounded], first[bounded], final[bounded]
            inside[bounded] = self._between(node.end, not some, *window)
            parts.append(inside)
        if node.low > 0:
            parts.append(self._between(node.hold, some, agents, steps, first - 1))
        result[there] = (self.clauses.all_of if some else self.clauses.any_of)(*parts)
        return result

    def _chain(self, node: UntilNode, agents: Indices, first: Indices, furthest: int) -> Literals:
        """For each cell, a literal that ``hold`` is true up to some ``end`` at step ``furthest`` or before; or its
        dual."""
        who = np.unique(agents)
        earliest = np.array([first[agents == agent].min() for agent in who])
        chains = np.full((len(who), furthest + 1), NOTHING, dtype=np.int32)
        self._ahead(node.end, who, earliest, furthest)
        self._ahead(node.hold, who, earliest, furthest - 1)
        for step in range(furthest, int(earliest.min()) - 1, -1):
            rows = np.flatnonzero(earliest <= step)
            moment = np.full(len(rows), step)
            end = self.of_agents.holds(node.end, who[rows], moment)
            if step == furthest:
                chains[rows, step] = end
                continue
            hold = self.of_agents.holds(node.hold, who[rows], moment)
            onward = chains[rows, step + 1]
            if node.every:
                chains[rows, step] = self.clauses.all_of(end, self.clauses.any_of(hold, onward))
            else:
                chains[rows, step] = self.clauses.either(end, hold, onward)
        return chains[np.searchsorted(who, agents), first]

    def _ahead(self, body: Node, agents: Indices, first: Indices, final: int) -> None:
        """Encode a formula at all steps from ``first`` to ``final`` at once, since all of them will be needed."""
        sizes = np.maximum(final - first + 1, 0)
        owner = np.repeat(np.arange(len(sizes)), sizes)
        step = first[owner] + np.arange(len(owner)) - np.repeat(np.cumsum(sizes) - sizes, sizes)
        self.of_agents.holds(body, agents[owner], step)

    def _between(self, body: Node, every: bool, agents: Indices, first: Indices, final: Indices) -> Literals:
        """Literals that the body is true at every step from ``first`` to ``final``, or at some step; all are within the
        mission."""
        shared = 4  # windows share halves, quarters and so on if this saves at least this factor of literals
        sizes = final - first + 1
        if not sizes.size:
            return np.zeros(0, dtype=np.int32)
        covered = len(np.unique(_cells(agents, first, sizes, self.last + 1)))
        levels = int(sizes.max()).bit_length() - 1
        if int(sizes.sum()) <= shared * max(levels, 1) * covered:
            owner = np.repeat(np.arange(len(sizes)), sizes)
            step = first[owner] + np.arange(len(owner)) - np.repeat(np.cumsum(sizes) - sizes, sizes)
            literals = self.of_agents.holds(body, agents[owner], step)
            return (self.clauses.all_of_ragged if every else self.clauses.any_of_ragged)(literals, sizes)
        result = np.empty(len(sizes), dtype=np.int32)
        join = self.clauses.all_of if every else self.clauses.any_of
        for level in np.unique(np.frexp(sizes)[1] - 1).tolist():
            rows = np.flatnonzero(np.frexp(sizes)[1] - 1 == level)
            left = self._span(body, every, level, agents[rows], first[rows])
            right = self._span(body, every, level, agents[rows], final[rows] - 2**level + 1)
            result[rows] = join(left, right)
        return result

    def _span(self, body: Node, every: bool, level: int, agents: Indices, first: Indices) -> Literals:
        """Literals of the body over 2 to the power ``level`` steps from each ``first`` on."""
        if level == 0:
            return self.of_agents.holds(body, agents, first)
        known = self._spans.setdefault((body, every, level), {})
        keys = agents * (self.last + 1) + first
        missing = np.array([key for key in np.unique(keys).tolist() if key not in known], dtype=np.int64)
        if missing.size:
            who, step = np.divmod(missing, self.last + 1)
            left = self._span(body, every, level - 1, who, step)
            right = self._span(body, every, level - 1, who, step + 2 ** (level - 1))
            join = self.clauses.all_of if every else self.clauses.any_of
            known.update(zip(missing.tolist(), join(left, right).tolist(), strict=True))
        return np.array([known[key] for key in keys.tolist()], dtype=np.int32)


def _cells(agents: Indices, first: Indices, sizes: Indices, steps: int) -> Indices:
    """Cells covered by windows, each as one number, with repetitions."""
    owner = np.repeat(np.arange(len(sizes)), sizes)
    return agents[owner] * steps + first[owner] + np.arange(len(owner)) - np.repeat(np.cumsum(sizes) - sizes, sizes)
