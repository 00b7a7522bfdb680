"""Admissible cost-to-go: a lower bound on the metres of one agent, from every state at every step, by itself.

What a requirement asks of one agent by its own state is a bound on where it
may be, or a visit. A *phase* is which of its visits an agent has made, a bit
for each. Nobody else is looked at, so that no plan is shorter; and along a
move nothing is lost: its length and what is left after it are together no less
than what was left before. What it costs more than that, its *excess*, adds up
along a motion to all that the motion is longer than the least.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from missionc.backends.smt.roadmap.roadmap import Indices
from missionc.backends.smt.shorten.held_goals import Goals
from missionc.base.trace import Array, Flags
from missionc.ir.kernel.conjuncts import conjuncts
from missionc.ir.kernel.nodes import Any, Node
from missionc.ir.kernel.walk import awaited


@dataclass(frozen=True, slots=True, eq=False)
class SingleAgentTask:
    """The task of one agent by itself: bounds on where it may be, and visits.

    Args:
        room: (steps + 1, states), where it may be.
        visits: (visits, steps + 1, states): of each it must be in one of these states, at its step.
    """

    room: Flags
    visits: Flags

    @classmethod
    def nothing(cls, room: Flags) -> SingleAgentTask:
        """To be where it may be."""
        return cls(room, np.zeros((0, *room.shape), dtype=np.bool_))

    def and_also(self, more: SingleAgentTask) -> SingleAgentTask:
        # Visits of an agent; the phases are twice as many with each. What it must visit besides is not counted.
        visits = 3
        return SingleAgentTask(self.room & more.room, np.concatenate([self.visits, more.visits])[:visits])


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
    asked = _tasks(goals.formulas, goals)
    return [asked.get(agent) or SingleAgentTask.nothing(way) for agent, way in enumerate(goals.motion.ways)]


def disjunctive_tasks(goals: Goals) -> Iterator[list[tuple[int, SingleAgentTask]]]:
    """The tasks of each *or* that must hold and asks something of one agent in each part: agents and tasks."""
    for agent, windows, node in conjuncts(goals.formulas):
        if agent is None and not windows and isinstance(node, Any):
            options = [list(_tasks((part,), goals).items()) for part in node.parts]
            if all(len(option) == 1 for option in options):
                yield [option[0] for option in options]


def _tasks(formulas: Iterable[Node], goals: Goals) -> dict[int, SingleAgentTask]:
    """The tasks of agents of whose own states the formulas ask something at step 0; what asks for more is left out."""
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
