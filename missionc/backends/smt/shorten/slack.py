"""Slack: allowed states of one agent at each step, with all other agents fixed and every goal satisfied.

A satisfied goal depends on some of its satisfied subformulas: one part of an *or*, one step of an *eventually*. These
subformulas give a set of states for each step; an agent that moves within these sets violates nothing. Other motions
may also be valid, but other choices of subformulas are not searched.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np

from missionc.backends.smt.encode.lower_motion import Motion
from missionc.backends.smt.lift import lift
from missionc.backends.smt.roadmap.labels import Labels, own_states, states_of
from missionc.base.late_dataclass import Record
from missionc.base.trace import Flags, Indices, Trace
from missionc.geometry.vectors import distinct
from missionc.ir import Graph, Mission, Predicate
from missionc.ir.kernel.analysis import about_whom, linked_by, reads_lengths, steps_ahead
from missionc.ir.kernel.nodes import All, Any, At, AtLeast, Atom, Node, UntilNode, WindowNode
from missionc.ir.kernel.walk import postorder
from missionc.ir.language.margins.links import are_linked
from missionc.ir.pair_ranges import directed
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
