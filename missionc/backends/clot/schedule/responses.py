"""Responses: events that an agent's visits trigger, by requirements such as ``always (p implies eventually[0, d] q)``.

    in   Outline
    out  the same, in which a visit to a place with ``p`` is followed by an event ``q``

An agent is in a trigger's place for some time before it reaches its target there, and the deadline counts from the
first moment: it is earlier by that time. What an agent merely passes on its way is left to the motion.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from missionc.backends.clot.schedule.goal_sets import GoalSets
from missionc.backends.clot.schedule.presence import agents_of, attendance
from missionc.backends.clot.schedule.tasks import Event, Hold, Outline, Task, conjuncts
from missionc.base.late_dataclass import Record
from missionc.ir.kernel.nodes import Any, Eventually, Node
from missionc.ir.kernel.walk import postorder, window_of


class Response(Record):
    """``answer`` of an agent at each step from ``low`` to ``high`` at which none of ``otherwise`` holds."""

    agent: int
    otherwise: tuple[Node, ...]
    answer: Eventually
    low: int
    high: int


def with_responses(outline: Outline, goals: GoalSets) -> Outline:
    """Outline with the responses to each visit as events after it."""
    found = [each for hold in outline.holds if not hold.timeless for each in _responses(hold)]
    if not found:
        return outline

    def answered(event: Event) -> Event:
        then = (*map(answered, event.then), *(each for response in found for each in _answers(response, event, goals)))
        return replace(event, then=then)

    tasks = tuple(
        Task(
            task.name,
            tuple(replace(option, events=tuple(map(answered, option.events))) for option in task.options),
        )
        for task in outline.tasks
    )
    return replace(outline, tasks=tasks)


def _responses(hold: Hold) -> Iterator[Response]:
    for agent, node in conjuncts(hold.agent, hold.node):
        if not isinstance(node, Any):
            continue
        answers = [part for part in node.parts if isinstance(part, Eventually)]
        otherwise = tuple(part for part in node.parts if not isinstance(part, Eventually))
        asked = (*otherwise, *(each.body for each in answers))
        if len(answers) == 1 and otherwise and all(_of_place(part, agent) for part in asked):
            yield Response(agent, otherwise, answers[0], hold.low, hold.high)


def _of_place(node: Node, agent: int) -> bool:
    """Return whether an agent's own place decides a formula, without temporal operators."""
    return all(window_of(each) is None for each in postorder([node])) and agents_of(agent, node) == {agent}


def _answers(response: Response, event: Event, goals: GoalSets) -> Iterator[Event]:
    """The event of a response after an event, if its visit triggers it."""
    answer, mission = response.answer, goals.mission
    places = dict(attendance(mission, event.holds).goals)
    goal = goals.of(response.agent, places[response.agent]) if response.agent in places else None
    if goal is None or answer.high is None or event.high < response.low or event.low > response.high:
        return
    margin = goals.margin(response.agent, (Any(response.otherwise),), goal.points)
    if margin is None or (np.broadcast_to(margin, len(goal.points)) >= 0).any():
        return
    depth = -float(np.max(margin)) + goals.grid.cell
    before = math.ceil(depth / (float(mission.agents[response.agent].dynamics.top_speed) * mission.step))
    latest = answer.high - before
    if latest >= answer.low:
        hold = Hold(response.agent, answer.body, 0, 0, True)
        yield Event(answer, response.agent, 0, answer.low, latest, (hold,))
