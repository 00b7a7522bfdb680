"""Label-setting search through time: per step, the cheapest path to each state, residual and label.

    in   a Mover and its Task
    out  states of a path with the fewest metres within a bound

A path is identified by its state, its residual, and its label: its flags and its level of each resource. Of paths that
differ only in levels, the cheapest is retained for each bucket of a resource. If more is never worse, a path is
retained only if it has a higher level than any cheaper one. A result is therefore correct, but an empty result proves
nothing.

Source:
    Desrochers and Soumis, "A generalized permanent labelling algorithm for the shortest path problem with time
    windows", 1988: labels of resources and their dominance.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from missionc.backends.smt.prioritized.reservations import ReservationTable
from missionc.backends.smt.roadmap.labels import Labels
from missionc.backends.smt.roadmap.roadmap import Roadmap
from missionc.backends.smt.settings import smt_settings
from missionc.base.late_dataclass import Record
from missionc.base.trace import Array, Flags, Indices
from missionc.geometry.vectors import distinct
from missionc.ir import Compare, Flag, Flagged, Level, Predicate, Resource
from missionc.ir.kernel.nodes import AtLeast, Atom, Node, Not
from missionc.ir.kernel.walk import children, window_of
from missionc.ir.language.margins.predicate_margins import holds, of_states
from missionc.ir.language.margins.resources import changes, within
from missionc.planning.progression.residuals import (
    AlwaysResidual,
    EventuallyResidual,
    Joined,
    Letter,
    NextResidual,
    Progression,
    Relaxation,
    Residual,
    TooComplex,
    UntilResidual,
)


class Carried(Record, eq=False):
    """Labels of paths: ``flags``, (rows, flags), and resource ``levels``, (rows, resources)."""

    flags: Flags
    levels: Array

    def take(self, rows: Indices) -> Carried:
        return Carried(self.flags[rows], self.levels[rows])


class OwnMemory:
    """Flags and resource levels of an agent on its roadmap, for propositions about the past.

    Args:
        nodes: propositions, each an ``Atom`` that reads the past, or its negation.
        exact: True if different paths must not be merged.

    Raises:
        TooComplex: a proposition also reads a speed or another agent, or cannot be exact.
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
        """Labels of paths that begin in these states."""
        levels = np.tile(np.array([each.start for each in self._resources]), (len(starts), 1))
        return Carried(self._sets[starts], levels.reshape(len(starts), len(self._resources)))

    def moved(self, carried: Carried, row: Indices, move: Indices, there: Indices) -> Carried:
        """Labels of paths after one more move: each continues from a row of ``carried`` by a move to a state; rows,
        moves and states are (rows,) each."""
        flags = self._sets[there] | (carried.flags[row] & self._stays[there])
        return Carried(flags, np.minimum(self._capacity, carried.levels[row] + self._changes[move]))

    def letters(self, carried: Carried, state: Indices) -> Indices:
        """Truth of the propositions as bits of an integer, (rows,)."""
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
        """Row numbers of the paths to retain, (kept,): for each key and label, the cheapest; ``cost`` is (rows,),
        metres."""
        buckets = 48  # levels of a resource; of paths with the same levels, the cheapest is kept
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
        """Row numbers of paths with a higher level than any cheaper path with the same key and flags, (kept,).

        ``cost`` is in metres.
        """
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
    """Return true if a higher resource level can make a proposition true but never false."""
    predicate, sign = _atom(node), 1.0 if isinstance(node, Atom) else -1.0
    return not isinstance(predicate, Compare) or all(
        sign * weight >= 0 for weight, feature in predicate.terms if isinstance(feature, Level)
    )


def _base(predicate: Predicate, agent: int, labels: Labels, roadmap: Roadmap) -> Array:
    """Value of a comparison in each state, (states,), without its resource terms, in its unit, such as metres."""
    if not isinstance(predicate, Compare):
        return np.zeros(0)
    rest = replace(
        predicate, terms=tuple((weight, each) for weight, each in predicate.terms if not isinstance(each, Level))
    )
    margin = of_states(rest, labels.mission, agent, roadmap.position, roadmap.velocity)
    return np.broadcast_to(np.asarray(margin) * rest.scale(labels.mission.dimension), len(roadmap.position))


FAR = 1e-9
"""Distance to go, metres, below which it counts as 0."""


@dataclass(slots=True, eq=False)
class Task:
    """Task of one agent on its roadmap: formulas to satisfy, as an automaton over propositions of states and moves.

    Args:
        places: propositions of states, (states,) or (steps + 1, states), as indices into ``place_letters``.
        moves: propositions at a move's beginning, (moves,), as indices into ``move_letters``; ``ends``: at its end.
        finish: (states,), True if its path may end in the state.
        own_places: propositions that the state alone decides, (states,), as indices into ``own_letters``.
        bound: function from a residual to lower bounds of the distance to go from each state, (states,), metres.
        memory: flags and levels for propositions about the past; None without such propositions.
    """

    progression: Progression
    begin: Residual
    places: Indices
    place_letters: list[Letter]
    moves: Indices
    ends: Indices
    move_letters: list[Letter]
    finish: Flags
    own_places: Indices
    own_letters: list[Letter]
    relaxation: Relaxation
    bound: Callable[[Residual], Array]
    memory: OwnMemory | None = None
    residuals: list[Residual] = field(default_factory=list)
    numbers: dict[Residual, int] = field(default_factory=dict)
    bounds: list[int] = field(default_factory=list)
    """For each residual, the row of ``metres`` with its bounds."""
    metres: list[Array] = field(default_factory=list)
    _stacked: Array = field(default_factory=lambda: np.zeros((0, 0)))
    _rows: dict[int, int] = field(default_factory=dict)
    _after: dict[tuple[int, int], int] = field(default_factory=dict)
    """Residual after a step, by step and one number for the previous residual and both letters."""

    def number(self, residual: Residual) -> int:
        residuals = 3_000  # number of residuals above which the search gives up
        if residual not in self.numbers:
            if len(self.residuals) >= residuals:
                raise TooComplex
            self.numbers[residual] = len(self.residuals)
            self.residuals.append(residual)
            bound = self.bound(residual)
            if id(bound) not in self._rows:
                self._rows[id(bound)] = len(self.metres)
                self.metres.append(bound)
            self.bounds.append(self._rows[id(bound)])
        return self.numbers[residual]

    def after(
        self, step: int, residual: Indices, place: Indices, move: Indices, past: Indices | None = None
    ) -> Indices:
        """Residuals, (rows,), after a step with these letters; -1 if violated."""
        kind = residual * (len(self.place_letters) * len(self.move_letters)) + place * len(self.move_letters) + move
        if past is not None:
            kind = (kind << self.bits) | past
        if kind.size and (kind == kind[0]).all():
            return np.full(len(kind), self._left(step, int(kind[0])))
        kinds, row = np.unique(kind, return_inverse=True)
        return np.array([self._left(step, each) for each in kinds.tolist()], dtype=np.int64)[row]

    def _left(self, step: int, kind: int) -> int:
        """Residual after a step, by one number for the previous residual and all letters; -1 if violated."""
        if (step, kind) not in self._after:
            before, letter = divmod(kind >> self.bits, len(self.place_letters) * len(self.move_letters))
            at, along = divmod(letter, len(self.move_letters))
            remembered = tuple(bool(kind >> bit & 1) for bit in range(self.bits))
            letters = self.place_letters[at] + self.move_letters[along] + remembered
            left = self.progression.after(self.residuals[before], step, letters)
            self._after[step, kind] = -1 if left is False else self.number(left)
        return self._after[step, kind]

    @property
    def bits(self) -> int:
        """Number of propositions that read the past."""
        return 0 if self.memory is None else len(self.memory.nodes)

    @property
    def work(self) -> int:
        """Work spent on residuals, in units of moves."""
        left_work = 200  # moves that equal the work of progressing a formula by one step
        return left_work * len(self._after)

    def to_go(self, residual: Indices, states: Indices) -> Array:
        """Lower bound of the remaining distance, (rows,), metres."""
        if len(self._stacked) < len(self.metres):
            self._stacked = np.stack(self.metres)
        if len(self.metres) == 1:
            return np.asarray(self._stacked[0, states])
        return np.asarray(self._stacked[np.array(self.bounds)[residual], states])

    def place(self, step: int, states: Indices) -> Indices:
        return self.places[states] if self.places.ndim == 1 else self.places[step, states]


class Mover(Record, eq=False):
    """Agent with its task and its allowed states.

    Args:
        may: (steps + 1, states), True for allowed states.
        starts: start states, (starts,).
    """

    task: Task
    table: ReservationTable
    may: Flags
    starts: Indices


@dataclass(slots=True, eq=False)
class Sweep:
    """Search for one path, step by step through the time-expanded roadmap.

    Args:
        may: (steps + 1, states), True for allowed states.
        starts: start states, (starts,).
        step_cost: cost of a step in metres while the agent is not finished.
        stride, rest: greatest reduction of the distance to go by a step, and by waiting, metres.
        pushing: True if conflicts with movable agents are expensive instead of forbidden.
        in_the_way: (states,), states to avoid as the end unless much nearer.
        most: maximum number of expanded moves.
    """

    task: Task
    table: ReservationTable
    may: Flags
    starts: Indices
    step_cost: float
    stride: float
    rest: float
    pushing: bool
    in_the_way: Flags
    most: float
    work: int = 0

    def within(self, bound: float) -> Indices | None:
        """Cheapest path, states (steps + 1,), with a cost of at most ``bound``; None without such a path.

        Raises:
            TooComplex: the search takes too much work.
        """
        step_work = 1_000  # overhead of a step, in moves
        restless = 1e-6  # metres added to each step in motion, more for later steps: of equal paths the earliest wins
        settings = smt_settings(self.table.mission).search
        task, table, memory = self.task, self.table, self.task.memory
        states, steps = len(task.finish), len(table.roadmap.allowed)
        carried = None if memory is None else memory.at(self.starts)
        target = np.ascontiguousarray(table.roadmap.moves[:, 1])
        done = task.number(True)
        key = task.number(task.begin) * states + self.starts
        cost = np.zeros(len(key))
        goes = task.to_go(key // states, self.starts) > FAR
        trail: list[tuple[Indices, Indices]] = []
        for step in range(steps):
            known = task.work
            residual, state = np.divmod(key, states)
            row, move = table.onward(state)
            self.work += step_work + len(move)
            if self.work > self.most:
                raise TooComplex
            there = target.take(move)
            free = self.may[step + 1].take(there) & table.free(step, move, pushing=self.pushing)
            row, move, there = _of(free, row, move, there)
            place, past = task.place(step, state), self._past(carried, state)
            if len(task.move_letters) == 1:
                left = task.after(step, residual, place, np.zeros_like(place), past).take(row)
            else:
                of_row = None if past is None else past[row]
                left = task.after(step, residual[row], place[row], task.moves[move], of_row)
            if step == steps - 1:
                row, move, there, left = _of((left >= 0) & task.finish[there], row, move, there, left)
                past = self._past(self._moved(carried, row, move, there), there)
                left = task.after(steps, left, task.place(steps, there), task.ends[move], past)
                left[left != done] = -1
            self.work += task.work - known
            row, move, there, left = _of(left >= 0, row, move, there, left)
            after = cost.take(row) + table.length.take(move)
            after += restless * (1 + step / (1 + steps)) * table.leads_on.take(move)
            after += (self.step_cost * goes).take(row)
            if self.pushing:
                after += settings.push * table.longest * table.weight(step, move)
            if step == steps - 1:
                after += settings.end * table.longest * self.in_the_way.take(there)
            to_go = task.to_go(left, there)
            going, resting = max(table.over - step - 1, 0), steps - max(table.over, step + 1)
            in_time = to_go <= going * self.stride + resting * self.rest + FAR
            near = (after + np.maximum(to_go, table.to_come[step + 1]) <= bound) & in_time
            row, move, there, left, after, to_go = _of(near, row, move, there, left, after, to_go)
            key = left * states + there
            if memory is None:
                key, first = _cheapest(key, after)
            else:
                moved = self._moved(carried, row, move, there)
                assert moved is not None
                first = memory.kept(key, after, moved)
                key, carried = key[first], moved.take(first)
            cost, parent, goes = after.take(first), row.take(first), to_go.take(first) > FAR
            if not key.size:
                return None
            trail.append((key % states, parent))
        way = np.empty(steps + 1, dtype=np.int64)
        best = int(np.argmin(cost))
        for step in range(steps, 0, -1):
            reached, parent = trail[step - 1]
            way[step], best = reached[best], int(parent[best])
        way[0] = self.starts[best]
        return way

    def _past(self, carried: Carried | None, state: Indices) -> Indices | None:
        """Truth of propositions about the past, as bits, (rows,); None without such propositions."""
        memory = self.task.memory
        return None if memory is None or carried is None else memory.letters(carried, state)

    def _moved(self, carried: Carried | None, row: Indices, move: Indices, there: Indices) -> Carried | None:
        memory = self.task.memory
        return None if memory is None or carried is None else memory.moved(carried, row, move, there)


def _of(which: Flags, *columns: NDArray[Any]) -> tuple[NDArray[Any], ...]:
    """Flagged rows of the columns, (rows,) each, of any unit; the same columns if all rows are flagged."""
    rows = which.nonzero()[0]
    return columns if len(rows) == len(which) else tuple(column.take(rows) for column in columns)


def _cheapest(key: Indices, cost: Array) -> tuple[Indices, Indices]:
    """Distinct keys, ascending, and the first row of least cost for each: (keys,) each.

    ``cost`` is in metres.
    """
    dense = 4  # keys per row up to which a table is used
    count = int(key.max(initial=-1)) + 1
    if count <= dense * len(key):  # a table of all possible keys is faster than sorting
        keys, group = None, key
    else:
        keys, group = np.unique(key, return_inverse=True)
        count = len(keys)
    least = np.full(count, np.inf)
    np.minimum.at(least, group, cost)
    best = (cost == least.take(group)).nonzero()[0][::-1]  # with ties, the first is written last
    first = np.full(count, -1)
    first[group.take(best)] = best
    if keys is not None:
        return keys, first
    there = (first >= 0).nonzero()[0]
    return there, first.take(there)


def letters_of(rows: Sequence[Flags], size: int) -> tuple[Indices, list[Letter]]:
    """Truth of propositions by column: the kind of each column, (size,), and the letter of each kind, from one row per
    proposition."""
    if not rows:
        return np.zeros(size, dtype=np.int64), [()]
    columns = np.stack(rows, axis=1)
    first, kind = distinct(np.packbits(columns, axis=1))
    return kind, [tuple(column) for column in columns[first].tolist()]


class Signature:
    """Signature of a residual: its structure, with propositions identified by the states in which they are true."""

    def __init__(self, leaves: dict[Node, bytes]) -> None:
        self._known: dict[Node, object] = dict(leaves)

    def of(self, residual: Residual) -> object:
        match residual:
            case Joined(count, parts):
                return count, frozenset(map(self.of, parts))
            case NextResidual(node) | EventuallyResidual(node) | AlwaysResidual(node) | UntilResidual(node):
                return type(residual), self._of(node)
            case _:
                return residual

    def _of(self, node: Node) -> object:
        if node not in self._known:
            below = tuple(map(self._of, children(node)))
            count = node.count if isinstance(node, AtLeast) else 0
            self._known[node] = type(node), window_of(node), count, below
        return self._known[node]
