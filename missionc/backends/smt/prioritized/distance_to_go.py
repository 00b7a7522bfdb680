"""Distance to go: a lower bound on the metres that an agent still has to travel, from each state of its roadmap.

    in   a relaxed residual (``progression``), which propositions hold in which states
    out  metres, for each state

The product of the roadmap and the automaton of relaxed residuals knows no time, so that one Dijkstra from where the
task is done gives all of it. Agents who have the same still to do share it.

Source:
    Silver, "Cooperative pathfinding", 2005: true distances as heuristics in space and time.
"""

from __future__ import annotations

import math
from collections import OrderedDict
from collections.abc import Callable

import numpy as np
from scipy.sparse import coo_array, csr_array
from scipy.sparse.csgraph import dijkstra

from missionc.backends.smt.prioritized.progression import Letter, Relaxation, Residual
from missionc.backends.smt.roadmap.roadmap import Indices
from missionc.base.trace import Array, Flags

NO_WAY = 1e-12
"""Metres of a move that leads nowhere: a sparse graph has no edges of length 0."""


class DistanceToGo:
    """Bounds on one roadmap.

    Args:
        moves: (moves, 2), states from and to.
        length: (moves,), metres.
        states: how many there are.
    """

    def __init__(self, moves: Indices, length: Array, states: int) -> None:
        # A roadmap with more states is searched this many longest moves away, then twice as far, until a start is met.
        whole, near = 10_000, 16
        self._source, self._target = moves.T
        self._length, self._states = np.maximum(length, NO_WAY), states
        self._nothing, self._everything = np.zeros(states), np.full(states, np.inf)
        self._known: OrderedDict[object, tuple[Array, float]] = OrderedDict()
        self._furthest = float(self._length.sum())
        self._near = math.inf if states <= whole else near * float(self._length.max(initial=0.0))

    def of(
        self,
        residual: Residual,
        relaxation: Relaxation,
        kind: Indices,
        letters: list[Letter],
        signature: Callable[[Residual], object],
        finish: Flags,
        starts: Indices | None = None,
    ) -> Array:
        """Metres to go from each state, (states,); infinite where there is no way.

        Args:
            kind: (states,), indices into ``letters``: what holds there.
            signature: equal for residuals that are about the same states.
            finish: (states,), where the way may end.
            starts: one of them is near; what is further may be said to be less far than it is.
        """
        most_phases = 40  # remaining formulas, above which there is no bound
        kept = 1 << 28  # bytes of remembered bounds
        place = b"" if finish.all() else finish.tobytes()
        if residual is False:
            return self._everything
        if residual is True and not place:
            return self._nothing
        known, near = self._recall((signature(residual), place))
        if known is not None and (starts is None or _is_near(known[starts], near)):
            return known
        phases: dict[Residual, int] = {residual: 0}
        waiting: list[Residual] = [residual]
        after, beyond = dict[Residual, list[Residual]](), dict[Residual, Array]()
        while waiting:
            phase = waiting.pop()
            after[phase] = [relaxation.after(phase, letter) for letter in letters]
            for more in after[phase]:
                if more is False or more in phases or more in beyond:
                    continue
                known = self._nothing if more is True and not place else self._recall((signature(more), place))[0]
                if known is None:
                    phases[more] = len(phases)
                    waiting.append(more)
                else:
                    beyond[more] = known
            if len(phases) > most_phases:
                return self._nothing
        graph = self._graph(phases, after, beyond, relaxation, kind, letters, finish)
        near = max(near, self._near)
        found = self._within(graph, near)
        while starts is not None and not _is_near(found[0, starts], near):
            near = 2 * near if near < self._furthest else math.inf
            found = self._within(graph, near)
        for phase, number in phases.items():
            self._known[signature(phase), place] = np.asarray(found[number]), near
        while len(self._known) * self._nothing.nbytes > kept:
            self._known.popitem(last=False)
        return np.asarray(found[0])

    def _recall(self, key: object) -> tuple[Array | None, float]:
        """What is known, and up to how many metres it is."""
        if key in self._known:
            self._known.move_to_end(key)
        return self._known.get(key, (None, 0.0))

    def _graph(
        self,
        phases: dict[Residual, int],
        after: dict[Residual, list[Residual]],
        beyond: dict[Residual, Array],
        relaxation: Relaxation,
        kind: Indices,
        letters: list[Letter],
        finish: Flags,
    ) -> csr_array:
        """From what lies behind the last state of each way back to all states in all phases, metres.

        Args:
            beyond: of residuals that are known, metres to go, (states,).
        """
        count = self._states
        end = len(phases) * count
        tails, heads, weights = [], [], []
        least = np.full(end, np.inf)
        for phase, number in phases.items():
            ends = np.array([relaxation.ends(phase, letter) for letter in letters])
            row = least[number * count : (number + 1) * count]
            row[ends[kind] & finish] = NO_WAY
            for letter, more in enumerate(after[phase]):
                moves = np.flatnonzero(kind[self._source] == letter)
                if more is False or not moves.size:
                    continue
                if more in phases:
                    tails.append(phases[more] * count + self._target[moves])
                    heads.append(number * count + self._source[moves])
                    weights.append(self._length[moves])
                    continue
                np.minimum.at(row, self._source[moves], self._length[moves] + beyond[more][self._target[moves]])
        begins = np.flatnonzero(np.isfinite(least))
        tails.append(np.full(begins.size, end))
        heads.append(begins)
        weights.append(least[begins])
        edges = np.concatenate(weights), (np.concatenate(tails), np.concatenate(heads))
        return csr_array(coo_array(edges, shape=(end + 1, end + 1)))

    def _within(self, graph: csr_array, near: float) -> Array:
        """Metres to go, (phases, states), by Dijkstra; what is further than so many is said to be so many."""
        end = graph.shape[0] - 1
        metres = np.asarray(dijkstra(graph, indices=[end], limit=near))[0, :end]
        return np.minimum(metres, near).reshape(-1, self._states)


def _is_near(metres: Array, near: float) -> bool:
    """Whether one of these is less than what stands for all that is further."""
    return near == math.inf or float(metres.min(initial=math.inf)) < near
