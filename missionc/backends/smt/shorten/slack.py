"""Slack: allowed states of one agent at each step, with all other agents fixed and every goal satisfied.

A satisfied goal depends on some of its satisfied subformulas: one part of an *or*, one step of an *eventually*. These
subformulas give a set of states for each step; an agent that moves within these sets violates nothing. Other motions
may also be valid, but other choices of subformulas are not searched.

Excess of a joint motion over the agents' cost-to-go: admissible bounds, and literals that count the excess.

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
from dataclasses import dataclass, field

import numpy as np

from missionc.backends.smt.encode.clauses import FALSE, TRUE, Clauses, Literals
from missionc.backends.smt.encode.lower_motion import Motion
from missionc.backends.smt.lift import lift
from missionc.backends.smt.roadmap.labels import Labels, own_states, states_of
from missionc.base.late_dataclass import Record
from missionc.base.trace import Array, Flags, Indices, Trace
from missionc.geometry.vectors import distinct
from missionc.ir import Graph, Mission, Predicate
from missionc.ir.couplings import directed
from missionc.ir.kernel.analysis import about_whom, linked_by, reads_lengths, steps_ahead
from missionc.ir.kernel.nodes import All, Any, At, AtLeast, Atom, Node, UntilNode, WindowNode
from missionc.ir.kernel.walk import awaited, conjuncts, postorder
from missionc.ir.language.margins.links import are_linked
from missionc.verification.monitoring.monitor import truths


@dataclass(slots=True)
class Goals:
    """Goals evaluated at step 0, with properties of their nodes.

    Args:
        instant: nodes that the states at their own step decide.
        own: instant nodes that the evaluated agent's own state decides.
        ahead: look-ahead of the other nodes in steps, including the move from the last step.
        concerns: (agents, agents), True if the motion of the first agent may matter for the second.
    """

    formulas: tuple[Node, ...]
    mission: Mission
    motion: Motion
    labels: Labels
    order: list[Node] = field(init=False)
    instant: set[Node] = field(init=False)
    own: set[Node] = field(init=False)
    ahead: dict[Node, int] = field(init=False)
    concerns: dict[Node, Flags] = field(init=False)
    work: int = 0
    """Number of examined pairs of agents, the dominant cost."""
    _states: dict[tuple[Node, int], Flags] = field(default_factory=dict)
    _read: dict[Node, tuple[tuple[Predicate, ...], tuple[Graph, ...]]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.order = postorder(self.formulas)
        self.own = own_states(self.order, self.labels)
        self.ahead = steps_ahead(self.formulas, self.motion.steps + 1, self._of_moves)
        self.instant = {node for node in self.order if not self.ahead[node] and not reads_lengths(node)}
        self.concerns = about_whom(self.formulas, len(self.mission.agents))

    def read_by(self, node: Node) -> tuple[tuple[Predicate, ...], tuple[Graph, ...]]:
        """Predicates and graphs that a formula reads."""
        if node not in self._read:
            below = postorder((node,))
            atoms = dict.fromkeys(each.predicate for each in below if isinstance(each, Atom))
            self._read[node] = tuple(atoms), linked_by((node,))
        return self._read[node]

    def states(self, node: Node, agent: int) -> Flags:
        """Return true for each of the agent's roadmap states, (states,), that makes the node true."""
        if (node, agent) not in self._states:
            self._states[node, agent] = states_of(node, agent, self.labels)
        return self._states[node, agent]

    def _of_moves(self, predicate: Predicate) -> int:
        """Look-ahead of a predicate in steps: 1 if it depends on moves, otherwise 0."""
        return int(any(self.labels.of_moves(predicate, number) for number in range(len(self.motion.roadmaps))))


class EvaluatedMotion(Record, eq=False):
    """Joint motion, states (agents, steps + 1), with the truth of every node below the goals, (agents, steps + 1)."""

    states: Indices
    trace: Trace
    truths: dict[Node, Flags]
    good: bool
    """True if all goals are satisfied."""

    @classmethod
    def of(cls, goals: Goals, states: Indices) -> EvaluatedMotion:
        trace = lift(states, goals.motion.own_roadmaps, goals.mission)
        goals.work += len(states) ** 2 * states.shape[1]
        found = truths(goals.order, goals.mission, trace)
        return cls(states.copy(), trace, found, all(bool(found[formula][0, 0]) for formula in goals.formulas))


def slack(goals: Goals, agent: int, evaluated: EvaluatedMotion) -> Flags:
    """Slack of an agent: allowed states of its roadmap at each step, (steps + 1, states).

    The agent's current motion is within the slack. Any other motion within the slack satisfies every goal if the other
    agents keep their motions.
    """
    found = Slack(goals, agent, evaluated)
    for formula in goals.formulas:
        found.need(formula, 0, 0)
    return found.room


class Slack:
    """Slack of one agent, computed by a traversal of the goals."""

    def __init__(self, goals: Goals, agent: int, evaluated: EvaluatedMotion) -> None:
        self.goals, self.agent = goals, agent
        self.states, self.trace, self.truths = evaluated.states, evaluated.trace, evaluated.truths
        self.motion, self.labels = goals.motion, goals.labels
        self.room = goals.motion.ways[agent].copy()
        self.concerns = {node: of_agents[agent] for node, of_agents in goals.concerns.items()}
        self.seen: set[tuple[Node, int, int]] = set()
        self.tried: dict[tuple[Node, int], tuple[Flags, Flags]] = {}

    def holds(self, node: Node, asked: int, step: int) -> bool:
        """Return the truth of the node, for agent ``asked`` at the step, in the current motion."""
        return bool(self.truths[node][asked, step])

    def need(self, node: Node, asked: int, step: int) -> None:
        """Restrict the slack so that a true node stays true for agent ``asked`` at the step."""
        key = (node, asked, step)
        if key in self.seen or not self.concerns[node][asked]:
            return
        self.seen.add(key)
        match node:
            case At(other, body):
                self.need(body, other, step)
            case All(parts):
                for part in self._cheap_first(parts):
                    self.need(part, asked, step)
            case WindowNode(body, low, high) if node.every and asked == self.agent and body in self.goals.own:
                window = self._window(step, low, high)
                self.room[window.start : window.stop] &= self.goals.states(body, asked)
            case _ if node in self.goals.instant:
                self.room[step] &= self.mask(node, asked, step, self.room[step])
            case Any(parts):
                self._some(1, [(part, asked, step) for part in parts])
            case AtLeast(count, parts):
                self._some(count, [(part, asked, step) for part in parts])
            case WindowNode(body, low, high) if node.every:
                for moment in self._window(step, low, high):
                    self.need(body, asked, moment)
            case WindowNode(body, low, high):
                self._some(1, [(body, asked, moment) for moment in self._window(step, low, high)])
            case UntilNode():
                (self._release if node.every else self._until)(node, asked, step)
            case _:
                # At the last step a speed is that of the motion which ended there.
                last = self.motion.steps
                for moment in range(max(0, min(step, last - 1)), min(step + self.goals.ahead[node], last) + 1):
                    self._stay(moment)

    def mask(self, node: Node, asked: int, step: int, wanted: Flags) -> Flags:
        """Return true for each state of ``wanted``, (states,), in which an instant node is true; other states are
        undefined."""
        if not self.concerns[node][asked]:
            return np.full(len(wanted), self.holds(node, asked, step))
        match node:
            case _ if asked == self.agent and node in self.goals.own:
                return self.goals.states(node, asked)
            case At(other, body):
                return self.mask(body, other, step, wanted)
            case All(parts) | Any(parts):
                every, here = node.every, self.states[self.agent, step]
                left, decided = wanted.copy(), np.zeros(len(wanted), dtype=np.bool_)
                for part in self._cheap_first(parts):
                    if not left.any() or (decided[here] and not every and self._of_others(part)):
                        break
                    decided |= left & (self.mask(part, asked, step, left) != every)
                    left &= ~decided
                return np.not_equal(decided, every)
            case _:
                return self._supposed(node, asked, step, wanted)

    def _supposed(self, node: Node, asked: int, step: int, wanted: Flags) -> Flags:
        """Truth of a node with the agent in each wanted state at the step: (states,)."""
        shape = (len(self.states), len(wanted))
        value, known = self.tried.setdefault((node, step), (np.zeros(shape, np.bool_), np.zeros(shape[1], np.bool_)))
        missing = np.flatnonzero(wanted & ~known)
        if missing.size:
            first, kind = self._kinds(node, step, missing)
            position = np.repeat(self.trace.position[:, step, None], first.size, axis=1)
            position[self.agent] = self.motion.roadmap(self.agent).position[first]
            velocity = np.repeat(self.trace.velocity[:, step, None], first.size, axis=1)
            velocity[self.agent] = self.motion.roadmap(self.agent).velocity[first]
            supposed = Trace(self.trace.step, position, velocity, np.zeros(position.shape[:2]))
            value[:, missing] = truths((node,), self.goals.mission, supposed)[node][:, kind]
            known[missing] = True
            self.goals.work += first.size * shape[0] ** 2
        found: Flags = value[asked]
        return found

    def _kinds(self, node: Node, step: int, states: Indices) -> tuple[Indices, Indices]:
        """One state of each kind, and the kind of each state; states of a kind have equal links and equal
        predicates."""
        atoms, graphs = self.goals.read_by(node)
        number = int(self.motion.roadmap_of[self.agent])
        if not all(self.labels.of_places(predicate) for predicate in atoms):
            return states, np.arange(states.size)
        columns = [self.labels.states(predicate, number)[states, None] for predicate in atoms]
        here, others = self.motion.roadmap(self.agent).position[states, None], self.trace.position[None, :, step]
        everyone = np.arange(len(self.trace.position))
        columns += [are_linked(graph, self.agent, everyone, here, others) for graph in graphs]
        columns += [are_linked(graph, everyone, self.agent, others, here) for graph in graphs if directed(graph)]
        rows = np.packbits(np.concatenate([np.zeros((states.size, 1), np.bool_), *columns], axis=1), axis=1)
        first, kind = distinct(rows)
        return states[first], kind

    def _some(self, count: int, options: Iterable[tuple[Node, int, int]]) -> None:
        """Restrict the slack so that ``count`` of the true options stay true: first options independent of the agent,
        then in order."""
        true = [option for option in options if self.holds(*option)]
        concerning = [option for option in true if self.concerns[option[0]][option[1]]]
        for option in concerning[: max(0, count - (len(true) - len(concerning)))]:
            self.need(*option)

    def _until(self, node: UntilNode, asked: int, step: int) -> None:
        window = self._window(step, node.low, node.high)
        end = next(moment for moment in window if self.holds(node.end, asked, moment))
        self.need(node.end, asked, end)
        for moment in range(step, end):
            self.need(node.hold, asked, moment)

    def _release(self, node: UntilNode, asked: int, step: int) -> None:
        window = self._window(step, node.low, node.high)
        freed = (moment for moment in range(step, window.stop - 1) if self.holds(node.hold, asked, moment))
        stop = next(freed, window.stop)
        if stop < window.stop:
            self.need(node.hold, asked, stop)
        for moment in window:
            if moment <= stop:
                self.need(node.end, asked, moment)

    def _window(self, step: int, low: int, high: int | None) -> range:
        last = self.motion.steps
        return range(step + low, (last if high is None else min(step + high, last)) + 1)

    def _stay(self, step: int) -> None:
        """Restrict the slack at the step to the agent's current state."""
        here = self.states[self.agent, step]
        self.room[step, np.arange(self.room.shape[1]) != here] = False

    def _cheap_first(self, parts: tuple[Node, ...]) -> list[Node]:
        """Parts sorted so that parts without conditions on other agents come first."""
        return sorted(parts, key=self._of_others)

    def _of_others(self, node: Node) -> bool:
        """Return true if the motions of agents other than the evaluated agent matter for the node."""
        return bool(np.count_nonzero(self.concerns[node]) > 1)


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
