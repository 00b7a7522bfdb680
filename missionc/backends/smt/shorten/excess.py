"""Excess of a joint motion over the agents' cost-to-go: admissible bounds, and literals that count the excess.

The cost-to-go of an agent is a lower bound on its path length from every state at every step. Requirements on one
agent's own state become restrictions of its states, or visits. A *phase* is the set of completed visits, a bit for
each. Other agents are ignored, so no plan is shorter. The length of a move plus the bound after it is at least the
bound before it. The difference, its *excess*, adds up along a motion to the motion's length above the minimum. A unary
totalizer counts the excess.

``distance_to_go`` differs: it bounds every residual formula without time. Here the steps count, as in the clauses.

Source:
    Bailleux and Boufkhad, "Efficient CNF encoding of Boolean cardinality constraints", 2003.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from missionc.backends.smt.encode.clauses import FALSE, TRUE, Clauses, Literals
from missionc.backends.smt.encode.lower_motion import Motion
from missionc.backends.smt.shorten.slack import Goals
from missionc.base.late_dataclass import Record
from missionc.base.trace import Array, Flags, Indices
from missionc.ir.kernel.conjuncts import conjuncts
from missionc.ir.kernel.nodes import Any, Node
from missionc.ir.kernel.walk import awaited


class SingleAgentTask(Record, eq=False):
    """Task of one agent alone: allowed states, and visits.

    Args:
        room: (steps + 1, states), True for allowed states.
        visits: (visits, steps + 1, states): each visit must be satisfied by one of these states at its step.
    """

    room: Flags
    visits: Flags

    @classmethod
    def nothing(cls, room: Flags) -> SingleAgentTask:
        """Task with the allowed states ``room``, (steps + 1, states), and without visits."""
        return cls(room, np.zeros((0, *room.shape), dtype=np.bool_))

    def and_also(self, more: SingleAgentTask) -> SingleAgentTask:
        # Maximum number of visits of an agent; phases double with each. Further visits are ignored.
        visits = 3
        return SingleAgentTask(self.room & more.room, np.concatenate([self.visits, more.visits])[:visits])


class CostToGo(Record, eq=False):
    """Cost-to-go of one agent: a lower bound of the distance that it still has to travel.

    Args:
        left: lower bound of the remaining distance, (steps + 1, states, phases), metres; infinite without a path.
        made: visits satisfied by a state at a step, as bits, (steps + 1, states).
    """

    task: SingleAgentTask
    left: Array
    made: Indices

    @property
    def least(self) -> float:
        """Lower bound of the length of the agent's whole path, metres."""
        return float(self.begin().min())

    def begin(self) -> Array:
        """Lower bound of the path length from each start state: (states,), metres."""
        begin: Array = self.left[0, np.arange(self.left.shape[1]), self.made[0]]
        return begin


def single_agent_tasks(goals: Goals) -> list[SingleAgentTask]:
    """Task of each agent alone that the goals imply, in mission order."""
    asked = _tasks(goals.formulas, goals)
    return [asked.get(agent) or SingleAgentTask.nothing(way) for agent, way in enumerate(goals.motion.ways)]


def disjunctive_tasks(goals: Goals) -> Iterator[list[tuple[int, SingleAgentTask]]]:
    """Yield, for each required *or* with a condition on one agent in each part, the agents and their tasks."""
    for agent, windows, node in conjuncts(goals.formulas):
        if agent is None and not windows and isinstance(node, Any):
            options = [list(_tasks((part,), goals).items()) for part in node.parts]
            if all(len(option) == 1 for option in options):
                yield [option[0] for option in options]


def _tasks(formulas: Iterable[Node], goals: Goals) -> dict[int, SingleAgentTask]:
    """Tasks of agents from conditions on their own states at step 0; other conditions are ignored."""
    tasks: dict[int, SingleAgentTask] = {}
    for conjunct in conjuncts(formulas):
        agent, windows, node = conjunct
        if agent is None or conjunct.steps is None:
            continue
        task = tasks.get(agent) or SingleAgentTask.nothing(goals.motion.ways[agent])
        event = awaited(node)
        if event and not windows and event.node in goals.own:
            visit = np.zeros_like(task.room)
            visit[event.steps] = goals.states(event.node, agent)
            tasks[agent] = task.and_also(SingleAgentTask(task.room, visit[None]))
        elif node in goals.own:
            room = np.ones_like(task.room)
            room[conjunct.steps] = goals.states(node, agent)
            tasks[agent] = task.and_also(SingleAgentTask.nothing(room))
    return tasks


def cost_to_go(goals: Goals, agent: int, task: SingleAgentTask, metres: Array) -> CostToGo:
    """Cost-to-go of an agent, by dynamic programming backwards over the steps.

    Args:
        metres: length of each move of its roadmap, (moves,), metres.
    """
    roadmap = goals.motion.roadmap(agent)
    source, target = roadmap.moves.T
    begins = np.flatnonzero(np.diff(source, prepend=-1))
    phases = 1 << len(task.visits)
    bits = (1 << np.arange(len(task.visits)))[:, None, None]
    made = (task.visits * bits).sum(axis=0).astype(np.int64)
    left = np.full((*task.room.shape, phases), np.inf)
    left[-1, task.room[-1], phases - 1] = 0.0
    for step in range(len(task.room) - 2, -1, -1):
        live = task.room[step, source] & task.room[step + 1, target] & roadmap.allowed[step]
        for phase in range(phases):
            whole = np.where(live, metres + left[step + 1, target, phase | made[step + 1, target]], np.inf)
            left[step, source[begins], phase] = np.minimum.reduceat(whole, begins)
    left[0, ~task.room[0]] = np.inf
    return CostToGo(task, left, made)


def add_totalizer(
    clauses: Clauses, motion: Motion, alone: Sequence[CostToGo], metres: Sequence[Array], unit: float, most: int
) -> Literals:
    """Literals, (most + 1,), implied by a joint motion: the ``k``-th by an excess of more than ``k`` units.

    Args:
        alone: cost-to-go of each agent.
        metres: length of each move, for each roadmap, (moves,), metres.
        unit: metres. Each move's excess is rounded down to units.
        most: larger excesses are not distinguished.

    Raises:
        TooLarge: the clauses would exceed their limit.
    """
    numbers = [
        number
        for agent, least in enumerate(alone)
        for number in _numbers(clauses, motion, agent, least, metres[motion.roadmap_of[agent]] / unit, unit, most)
    ]
    while len(numbers) > 1:
        pairs = zip(numbers[::2], numbers[1::2], strict=False)
        odd = numbers[len(numbers) // 2 * 2 :]
        numbers = [_sum(clauses, one, other, most + 1) for one, other in pairs] + odd
    total = np.full(most + 1, FALSE, dtype=np.int32)
    if numbers:
        total[: len(numbers[0])] = numbers[0][: most + 1]
    return total


def _numbers(
    clauses: Clauses, motion: Motion, agent: int, least: CostToGo, lengths: Array, unit: float, most: int
) -> Iterator[Literals]:
    """Yield unary numbers for the excess of an agent's start and of each of its moves, (moves,), in units of ``unit``
    metres."""
    roadmap, states, made = motion.roadmap(agent), motion.states[agent], least.made
    source, target = roadmap.moves.T
    left = least.left / unit
    phases = np.arange(left.shape[-1])
    visited = _visited(clauses, states, least)
    at_start = _Number(clauses, most)
    begins = least.begin()
    at_start.add(_units(begins - begins.min(), unit, most), -states[0])
    yield from at_start.done()
    for step in range(motion.steps):
        here, there = states[step, source], states[step + 1, target]
        live = (here != FALSE) & (there != FALSE) & roadmap.allowed[step]
        number = _Number(clauses, most)
        for phase in phases.tolist():
            possible = (
                live & (phase & made[step, source] == made[step, source]) & np.isfinite(left[step, source, phase])
            )
            rows = np.flatnonzero(possible)
            after = left[step + 1, target[rows], phase | made[step + 1, target[rows]]]
            over = lengths[rows] + after - left[step, source[rows], phase]
            # Literals give the agent's visits: in another phase the clause is satisfied.
            in_phase = [-visit[step] if phase >> bit & 1 else visit[step] for bit, visit in enumerate(visited)]
            others = [np.full(len(rows), literal, dtype=np.int32) for literal in in_phase]
            number.add(_units(over, 1.0, most), -here[rows], -there[rows], *others)
        yield from number.done()


def _units(over: Array, unit: float, most: int) -> np.ndarray[tuple[int], np.dtype[np.int64]]:
    """Excess, (rows,), metres, in whole units, rounded down; at most ``most + 1``."""
    return np.floor(np.clip(over / unit - 1e-9, 0.0, most + 1.0)).astype(np.int64)


def _visited(clauses: Clauses, states: Literals, least: CostToGo) -> list[Literals]:
    """For each visit, literals, (steps + 1,), that the visit is completed by then."""
    literals = []
    for visit in least.task.visits:
        by_then = clauses.fresh(len(states))
        step, state = np.nonzero(visit & (states != FALSE))
        clauses.add(-states[step, state], by_then[step])
        clauses.add(-by_then[:-1], by_then[1:])
        for moment, there in enumerate(visit):
            now = states[moment, there & (states[moment] != FALSE)]
            before = by_then[moment - 1 : moment] if moment else by_then[:0]
            clauses.add(np.concatenate([-by_then[moment : moment + 1], before, now])[None, :])
        literals.append(by_then)
    return literals


class _Number:
    """Unary number of at most ``most + 1`` units, defined by clauses for its lower bounds."""

    def __init__(self, clauses: Clauses, most: int) -> None:
        self.clauses, self.most = clauses, most
        self.parts: list[tuple[np.ndarray[tuple[int], np.dtype[np.int64]], tuple[Literals, ...]]] = []

    def add(self, units: np.ndarray[tuple[int], np.dtype[np.int64]], *unless: Literals) -> None:
        """Add ``units``, (rows,), that count unless one of the row's literals is true."""
        some = units > 0
        self.parts.append((units[some], tuple(literals[some] for literals in unless)))

    def done(self) -> Iterator[Literals]:
        """Yield the number, if it can be positive: literals, the ``k``-th implied by more than ``k`` units."""
        size = max((int(units.max(initial=0)) for units, _ in self.parts), default=0)
        if size:
            number = self.clauses.fresh(size)
            for units, unless in self.parts:
                if units.size:
                    self.clauses.add(*unless, number[units - 1])
            self.clauses.add(-number[1:], number[:-1])
            yield number


def _sum(clauses: Clauses, one: Literals, other: Literals, most: int) -> Literals:
    """Sum of two unary numbers, exact up to ``most``."""
    clauses.reserve(len(one) * len(other))
    total = clauses.fresh(min(len(one) + len(other), most))
    left = np.concatenate([[TRUE], one]).astype(np.int32)
    right = np.concatenate([[TRUE], other]).astype(np.int32)
    row, column = np.meshgrid(np.arange(len(left)), np.arange(len(right)), indexing="ij")
    counts = (row + column > 0) & (row + column <= len(total))
    clauses.add(-left[row[counts]], -right[column[counts]], total[row[counts] + column[counts] - 1])
    return total
