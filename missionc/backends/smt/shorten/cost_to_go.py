"""Admissible cost-to-go: a lower bound on the metres of one agent, from every state at every step, by itself.

What a requirement asks of one agent by its own state is a bound on where it
may be, or a visit. A *phase* is which of its visits an agent has made, a bit
for each. Nobody else is looked at, so that no plan is shorter; and along a
move nothing is lost: its length and what is left after it are together no less
than what was left before. What it costs more than that, its *excess*, adds up
along a motion to all that the motion is longer than the least.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from missionc.backends.smt.roadmap.roadmap import Indices
from missionc.backends.smt.shorten.held_goals import Goals
from missionc.base.trace import Array, Flags
from missionc.kernel.nodes import All, Always, Any, At, Eventually, Node, Until

VISITS = 3
"""Visits of an agent; the phases are twice as many with each. What it must visit besides is not counted."""


@dataclass(frozen=True, slots=True, eq=False)
class SingleAgentTask:
    """The task of one agent by itself: bounds on where it may be, and visits.

    Args:
        room: (steps + 1, states), where it may be.
        visits: (visits, steps + 1, states): of each it must be in one of these states, at its step.
    """

    room: Flags
    visits: Flags

    def and_also(self, more: SingleAgentTask) -> SingleAgentTask:
        return SingleAgentTask(self.room & more.room, np.concatenate([self.visits, more.visits])[:VISITS])


@dataclass(frozen=True, slots=True, eq=False)
class CostToGo:
    """The cost-to-go of one agent.

    Args:
        left: (steps + 1, states, phases), metres still to go at least; infinite where there is no way.
        made: (steps + 1, states), the visits made by being in a state at a step, as bits.
    """

    task: SingleAgentTask
    left: Array
    made: Indices

    @property
    def least(self) -> float:
        """Metres of its shortest motion."""
        return float(self.begin().min())

    def begin(self) -> Array:
        """Metres to go from each state it may start in: (states,)."""
        begin: Array = self.left[0, np.arange(self.left.shape[1]), self.made[0]]
        return begin


def single_agent_tasks(goals: Goals) -> list[SingleAgentTask]:
    """The task of each agent by itself in the goals that hold, (agents)."""
    found = [SingleAgentTask(way, np.zeros((0, *way.shape), dtype=np.bool_)) for way in goals.motion.ways]
    for formula in goals.formulas:
        for agent, one in _asked(formula, goals):
            found[agent] = found[agent].and_also(one)
    return found


def disjunctive_tasks(goals: Goals) -> Iterator[list[tuple[int, SingleAgentTask]]]:
    """The tasks of each *or* that must hold and asks something of one agent in each part: agents and tasks."""
    for node in _required(goals.formulas):
        if isinstance(node, Any):
            options = [list(_asked(part, goals)) for part in node.parts]
            if all(len(option) == 1 for option in options):
                yield [option[0] for option in options]


def _required(formulas: tuple[Node, ...]) -> Iterator[Node]:
    """Nodes that all hold at step 0, none of them an *and*."""
    rest = list(reversed(formulas))
    while rest:
        node = rest.pop()
        if isinstance(node, All):
            rest.extend(reversed(node.parts))
        else:
            yield node


def _asked(formula: Node, goals: Goals) -> Iterator[tuple[int, SingleAgentTask]]:
    for node in _required((formula,)):
        if isinstance(node, At):
            for body in _required((node.body,)):
                yield from _of_agent(body, node.agent, goals)


def _of_agent(node: Node, agent: int, goals: Goals) -> Iterator[tuple[int, SingleAgentTask]]:
    """The task that a formula required of an agent at step 0 is for its own states; none where it asks for more."""
    last = goals.motion.steps
    room = np.ones((last + 1, len(goals.motion.roadmap(agent).position)), dtype=np.bool_)
    visit, none = np.zeros_like(room), np.zeros((0, *room.shape), dtype=np.bool_)
    match node:
        case Always(body, low, high) if body in goals.own:
            room[low : None if high is None else high + 1] &= goals.states(body, agent)
            yield agent, SingleAgentTask(room, none)
        case Eventually(body, low, high) | Until(_, body, low, high) if body in goals.own:
            visit[low : None if high is None else high + 1] = goals.states(body, agent)
            yield agent, SingleAgentTask(room, visit[None])
        case _ if node in goals.own:
            room[0] &= goals.states(node, agent)
            yield agent, SingleAgentTask(room, none)
        case _:
            pass


def cost_to_go(goals: Goals, agent: int, task: SingleAgentTask, metres: Array) -> CostToGo:
    """The cost-to-go of an agent, by dynamic programming backwards over the steps.

    Args:
        metres: (moves,), how long each move of its roadmap is.
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
