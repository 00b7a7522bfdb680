"""Distance to go: lower bound of the remaining path length from each state of an agent's graph.

    in   a relaxed residual (``residuals``), the moves of a graph, the propositions of each state
    out  metres for each state

The product of the graph and the automaton of relaxed residuals is independent of time. One Dijkstra search backwards
from its goal vertices therefore gives the bounds of all its states. Agents with equal residuals share the bounds.

Source:
    Silver, "Cooperative pathfinding", 2005: true distances as heuristics in space and time.
"""

from __future__ import annotations

import math
from collections import OrderedDict
from collections.abc import Callable, Sequence

import numpy as np
from scipy.sparse import coo_array, csr_array
from scipy.sparse.csgraph import dijkstra

from missionc.base.late_dataclass import Record
from missionc.base.trace import Array, Flags, Indices
from missionc.planning.progression.residuals import Letter, Relaxation, Residual, TooComplex

NO_WAY = 1e-12
"""Length, metres, that replaces a zero-length move, since a sparse graph cannot store edges of length 0."""


class ProductGraph(Record, eq=False):
    """Product of an agent's graph and the automaton of relaxed residuals. A *spot* is a pair of residual and state.

    Args:
        phases: index of each residual.
        tail: spot at the start of each edge, (edges,); ``head``: spot at its end.
        move: move of the agent's graph for each edge, (edges,).
        ends: (spots,), True if a path may end at the spot.
        beyond: edges into residuals with known bounds: their tails, their moves, and the bounds, (states,), metres.
    """

    phases: dict[Residual, int]
    tail: Indices
    head: Indices
    move: Indices
    ends: Flags
    beyond: list[tuple[Indices, Indices, Array]]

    @classmethod
    def of(
        cls,
        begin: Residual,
        relaxation: Relaxation,
        letters: Sequence[Letter],
        kind: Indices,
        finish: Flags,
        moves: Indices,
        most: int,
        usable: Flags | None = None,
        bound: Callable[[Residual], Array | None] = lambda residual: None,
    ) -> ProductGraph:
        """Product graph with all residuals that are reachable from ``begin``.

        Args:
            kind: proposition set of each state, (states,), as indices into ``letters``.
            finish: (states,), True if a path may end in the state.
            moves: (moves, 2), start and end state of each move.
            most: maximum number of residuals.
            usable: (moves,), True for usable moves; None for all.
            bound: function from a residual to its known bounds, (states,), metres; None if the residual must be
                expanded.

        Raises:
            TooComplex: there are more than ``most`` residuals.
        """
        source, target = moves.T
        counted = np.ones(len(moves), dtype=np.bool_) if usable is None else usable
        of_kind = [np.flatnonzero(counted & (kind[source] == letter)) for letter in range(len(letters))]
        phases, known = {begin: 0}, dict[Residual, Array]()
        waiting, ends = [begin], list[Flags]()
        nothing = np.zeros(0, dtype=np.int64)
        tails, heads, taken, beyond = [nothing], [nothing], [nothing], list[tuple[Indices, Indices, Array]]()
        for phase in waiting:
            here = phases[phase] * len(kind)
            ends.append(np.array([relaxation.ends(phase, letter) for letter in letters])[kind] & finish)
            for letter, leaving in zip(letters, of_kind, strict=True):
                after = relaxation.after(phase, letter)
                if after is False:
                    continue
                if after not in phases and after not in known:
                    metres = bound(after)
                    if metres is None:
                        phases[after] = len(phases)
                        waiting.append(after)
                    else:
                        known[after] = metres
                if len(phases) > most:
                    raise TooComplex
                if after in known:
                    beyond.append((here + source[leaving], leaving, known[after]))
                    continue
                tails.append(here + source[leaving])
                heads.append(phases[after] * len(kind) + target[leaving])
                taken.append(leaving)
        tail, head, move = (np.concatenate(parts) for parts in (tails, heads, taken))
        return cls(phases, tail, head, move, np.concatenate(ends), beyond)


def reversed_to_ends(tail: Indices, head: Indices, length: Array, left: Array) -> csr_array:
    """Graph with reversed edges and one additional vertex, the last, with edges to the goal vertices.

    There must be no parallel edges, whose lengths a sparse array would add.

    Args:
        tail, head: vertices of each edge, (edges,).
        length: (edges,), metres.
        left: remaining distance at a goal vertex, (vertices,), metres; infinite at other vertices.
    """
    count, ends = len(left), np.flatnonzero(np.isfinite(left))
    weights = np.concatenate([length, left[ends]])
    edges = np.concatenate([head, np.full(ends.size, count)]), np.concatenate([tail, ends])
    return csr_array(coo_array((weights, edges), shape=(count + 1, count + 1)))


class DistanceToGo:
    """Cache of lower bounds of the distance to go on one graph.

    Args:
        moves: (moves, 2), start and end state of each move.
        length: (moves,), metres.
        states: number of states.
    """

    def __init__(self, moves: Indices, length: Array, states: int) -> None:
        # A graph with more states is searched up to this many longest moves, then twice as far, until a start is
        # reached.
        whole, near = 10_000, 16
        self._moves = moves
        self._length = np.maximum(length, NO_WAY)
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
        """Lower bound of the distance from each state until the residual is satisfied, (states,), metres; infinite
        without a path.

        Args:
            kind: proposition set of each state, (states,), as indices into ``letters``.
            signature: function whose values are equal for residuals that constrain the same states.
            finish: (states,), True if the path may end in the state.
            starts: the search stops when it reaches the first of these states; states further away get a weaker bound.
        """
        most_phases = 40  # number of residuals above which there is no bound
        kept = 1 << 28  # bytes of cached bounds
        place = b"" if finish.all() else finish.tobytes()
        if residual is False:
            return self._everything
        if residual is True and not place:
            return self._nothing
        known, near = self._recall((signature(residual), place))
        if known is not None and (starts is None or _is_near(known[starts], near)):
            return known

        def bound(more: Residual) -> Array | None:
            return self._nothing if more is True and not place else self._recall((signature(more), place))[0]

        try:
            product = ProductGraph.of(
                residual, relaxation, letters, kind, finish, self._moves, most_phases, bound=bound
            )
        except TooComplex:
            return self._nothing
        left = np.where(product.ends, NO_WAY, np.inf)
        for tail, move, metres in product.beyond:
            np.minimum.at(left, tail, self._length[move] + metres[self._moves[move, 1]])
        graph = reversed_to_ends(product.tail, product.head, self._length[product.move], left)
        near = max(near, self._near)
        found = self._within(graph, near)
        while starts is not None and not _is_near(found[0, starts], near):
            near = 2 * near if near < self._furthest else math.inf
            found = self._within(graph, near)
        for phase, number in product.phases.items():
            self._known[signature(phase), place] = np.asarray(found[number]), near
        while len(self._known) * self._nothing.nbytes > kept:
            self._known.popitem(last=False)
        return np.asarray(found[0])

    def _recall(self, key: object) -> tuple[Array | None, float]:
        """Cached bounds, (states,), metres (None without any), and the distance up to which they are exact."""
        if key in self._known:
            self._known.move_to_end(key)
        return self._known.get(key, (None, 0.0))

    def _within(self, graph: csr_array, near: float) -> Array:
        """Distances to go by Dijkstra's algorithm, (phases, states), metres; distances above ``near`` are reported as
        ``near``."""
        end = graph.shape[0] - 1
        metres = np.asarray(dijkstra(graph, indices=[end], limit=near))[0, :end]
        return np.minimum(metres, near).reshape(-1, len(self._nothing))


def _is_near(metres: Array, near: float) -> bool:
    """Return true if some distance, (some,), metres, is below ``near``, the value that stands for all larger
    distances."""
    return near == math.inf or float(metres.min(initial=math.inf)) < near
