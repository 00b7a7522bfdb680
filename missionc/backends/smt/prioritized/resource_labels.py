"""Labels of flags and resources in a single-agent search: their values along each path that it compares.

    in   the propositions of a formula that read the past, a roadmap
    out  a label for each way, carried from step to step

A way is told by its state, by what remains of the formulas, and by its label: its flags, and what it has left of each
resource. Both are exact. Of ways that agree in all but what is left, the cheapest is kept for each of ``BUCKETS``
stretches of a resource, and only where it has more left than any cheaper one if more can never hurt. So what is found
is right; that nothing is found says nothing.

Source:
    Desrochers and Soumis, "A generalized permanent labelling algorithm for the shortest path problem with time
    windows", 1988: labels of resources and their dominance.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from missionc.backends.smt.prioritized.progression import TooComplex
from missionc.backends.smt.roadmap.labels import Labels
from missionc.backends.smt.roadmap.roadmap import Indices, Roadmap
from missionc.base.trace import Array, Flags
from missionc.ir import Compare, Flag, Flagged, Level, Predicate, Resource
from missionc.ir.kernel.nodes import Atom, Node, Not
from missionc.ir.language.margins.predicate_margins import holds, of_states
from missionc.ir.language.margins.resources import changes, within


@dataclass(frozen=True, slots=True, eq=False)
class Carried:
    """The labels of ways: ``flags``, (rows, flags), and ``levels``, (rows, resources)."""

    flags: Flags
    levels: Array

    def take(self, rows: Indices) -> Carried:
        return Carried(self.flags[rows], self.levels[rows])


class OwnMemory:
    """What an agent's way so far bears on, on its roadmap.

    Args:
        nodes: the propositions, each an ``Atom`` that reads the past or its negation.
        exact: no two ways may be taken for one.

    Raises:
        TooComplex: one of them reads a speed or another agent too, or is not kept exactly.
    """

    def __init__(self, nodes: Sequence[Node], agent: int, labels: Labels, roadmap: Roadmap, *, exact: bool) -> None:
        most_propositions = 20  # bits of a number
        self.nodes = tuple(nodes)
        atoms = [_atom(node) for node in nodes]
        if len(nodes) > most_propositions or any(each.others or each.reads_speed for each in atoms):
            raise TooComplex
        mine = [each.flag for each in atoms if isinstance(each, Flagged)]
        self._flags: list[Flag] = list(dict.fromkeys(mine))
        levels = (feature for each in atoms if isinstance(each, Compare) for _, feature in each.terms)
        self._resources: list[Resource] = list(
            dict.fromkeys(each.resource for each in levels if isinstance(each, Level))
        )
        position, count = roadmap.position, len(self._flags)
        self._sets: Flags = np.zeros((len(position), count), dtype=np.bool_)
        self._stays: Flags = np.ones((len(position), count), dtype=np.bool_)
        for number, flag in enumerate(self._flags):
            self._sets[:, number] = within(flag.set_in, position) & (agent in flag.agents)
            if flag.cleared_in is not None:
                self._stays[:, number] = ~within(flag.cleared_in, position)
        source, target = roadmap.moves.T
        self._changes: Array = np.zeros((len(source), len(self._resources)))
        for number, resource in enumerate(self._resources):
            self._changes[:, number] = changes(resource, labels.mission.step, position[source], position[target])
        self._capacity = np.array([each.capacity for each in self._resources])
        self._bases = [_base(each, agent, labels, roadmap) for each in atoms]
        if exact and self._resources:
            raise TooComplex
        self.more_is_better = len(self._resources) == 1 and all(map(_helped, nodes))

    def at(self, starts: Indices) -> Carried:
        """The labels of ways that begin in these states."""
        levels = np.tile(np.array([each.start for each in self._resources]), (len(starts), 1))
        return Carried(self._sets[starts], levels.reshape(len(starts), len(self._resources)))

    def moved(self, carried: Carried, row: Indices, move: Indices, there: Indices) -> Carried:
        """The labels of ways that go on from these rows by these moves into these states, (rows,) each."""
        flags = self._sets[there] | (carried.flags[row] & self._stays[there])
        return Carried(flags, np.minimum(self._capacity, carried.levels[row] + self._changes[move]))

    def letters(self, carried: Carried, state: Indices) -> Indices:
        """Which of the propositions hold, (rows,): a bit for each."""
        letters = np.zeros(len(state), dtype=np.int64)
        for bit, node in enumerate(self.nodes):
            letters |= self._holds(node, self._bases[bit], carried, state).astype(np.int64) << bit
        return letters

    def _holds(self, node: Node, base: Array, carried: Carried, state: Indices) -> Flags:
        predicate = _atom(node)
        if isinstance(predicate, Flagged):
            found = carried.flags[:, self._flags.index(predicate.flag)]
        else:
            assert isinstance(predicate, Compare)
            value = base[state]
            for weight, feature in predicate.terms:
                if isinstance(feature, Level):
                    value = value + weight * carried.levels[:, self._resources.index(feature.resource)]
            found = holds(predicate, value)
        return np.asarray(found if isinstance(node, Atom) else ~found)

    def kept(self, key: Indices, cost: Array, carried: Carried) -> Indices:
        """The rows of the ways that are kept: of each key and label the cheapest."""
        buckets = 48  # levels of a resource; of paths with the same levels the cheapest is kept
        label = np.zeros(len(key), dtype=np.int64)
        for column in carried.flags.T:
            label = 2 * label + column
        share = carried.levels / np.maximum(self._capacity, 1e-12)
        for column in np.clip(np.floor(buckets * share), 0, buckets - 1).astype(np.int64).T:
            label = buckets * label + column
        order = np.lexsort((cost, label, key))
        first = np.ones(len(order), dtype=np.bool_)
        first[1:] = (np.diff(key[order]) != 0) | (np.diff(label[order]) != 0)
        rows = order[first]
        return self._undominated(rows, key, cost, carried) if self.more_is_better else rows

    def _undominated(self, rows: Indices, key: Indices, cost: Array, carried: Carried) -> Indices:
        """Those of the rows that have more left than any cheaper one of their key with the same flags."""
        bits = carried.flags[rows] @ (1 << np.arange(carried.flags.shape[1], dtype=np.int64))
        level = carried.levels[rows, 0]
        order = np.lexsort((-level, cost[rows], bits, key[rows]))
        group = np.zeros(len(order), dtype=np.int64)
        group[1:] = np.cumsum((np.diff(key[rows][order]) != 0) | (np.diff(bits[order]) != 0))
        rank = np.argsort(np.argsort(level, kind="stable"), kind="stable")[order]
        most = np.maximum.accumulate(group * (len(order) + 1) + rank)
        first = np.r_[True, (np.diff(group) != 0)][: len(order)]
        more = np.r_[True, most[1:] > most[:-1]][: len(order)]
        return np.asarray(rows[order[first | more]])


def _atom(node: Node) -> Predicate:
    leaf = node.body if isinstance(node, Not) else node
    assert isinstance(leaf, Atom)
    return leaf.predicate


def _helped(node: Node) -> bool:
    """Whether to have more left can only make a proposition true."""
    predicate, sign = _atom(node), 1.0 if isinstance(node, Atom) else -1.0
    return not isinstance(predicate, Compare) or all(
        sign * weight >= 0 for weight, feature in predicate.terms if isinstance(feature, Level)
    )


def _base(predicate: Predicate, agent: int, labels: Labels, roadmap: Roadmap) -> Array:
    """What a comparison's value is in each state, (states,), but for what it reads of resources."""
    if not isinstance(predicate, Compare):
        return np.zeros(0)
    rest = replace(
        predicate, terms=tuple((weight, each) for weight, each in predicate.terms if not isinstance(each, Level))
    )
    margin = of_states(rest, labels.mission, agent, roadmap.position, roadmap.velocity)
    return np.broadcast_to(np.asarray(margin) * rest.scale(labels.mission.dimension), len(roadmap.position))
