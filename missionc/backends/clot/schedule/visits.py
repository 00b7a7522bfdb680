"""Data types of scheduling: visits, their steps and positions, and joint waypoints."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import NamedTuple, TypeAlias

from missionc.backends.clot.optimise.active_set import Choices
from missionc.backends.clot.schedule.goal_sets import GoalSet
from missionc.backends.clot.schedule.presence import NOBODY, Meeting, PresenceConstraints
from missionc.backends.clot.schedule.tasks import (
    Decision,
    Event,
    Hold,
    Option,
    Outline,
    TimedLiterals,
)
from missionc.base.late_dataclass import Record
from missionc.base.trace import Array
from missionc.ir import Predicate, Region
from missionc.ir.kernel.nodes import Node

Key = tuple[int, int]
"""Identifier of a visit: the index of its task, -1 for none, and its index within the task."""


class Visit(Record):
    """Visit of a schedule: an event, its agents' regions, and the visit that it follows.

    Args:
        come: presence constraints of the event.
        regions: regions of agents at the event.
        shapes: required formations and graphs.
        lasts: duration, steps.
        after: visit from which its window counts; None for step 0.
        kept: formations up to the visit.
        says: literals that others may exclude, in seconds from the event.
        before: such literals up to the event, in seconds from the enclosing event.
        fixed: True if the visit represents a condition at fixed steps, without a choice.
    """

    key: Key
    event: Event
    come: PresenceConstraints
    regions: tuple[tuple[int, Region], ...]
    shapes: tuple[Predicate, ...]
    lasts: int
    after: Key | None = None
    kept: tuple[Predicate, ...] = ()
    says: tuple[TimedLiterals, ...] = ()
    before: tuple[TimedLiterals, ...] = ()
    fixed: bool = False

    @property
    def agents(self) -> set[int]:
        """Agents that must move for the visit."""
        return self.come.agents | {agent for shape in self.shapes for agent in shape.others}


class Place(Record, eq=False):
    """Target position of an agent, (dim,), metres.

    Args:
        goal: goal set with alternative targets, if known.
        sure: True if a path to the target is known.
        leaves: position at the end of the visit, (dim,), metres; None if the agent stays.
    """

    agent: int
    point: Array
    goal: GoalSet | None = None
    sure: bool = True
    leaves: Array | None = None


class Appointment(Record, eq=False):
    """Visit at a step of the mission; ``places`` are its agents' target positions."""

    visit: Visit
    step: int
    places: tuple[Place, ...] = ()


class Escort(Record):
    """Meeting of agents that move meanwhile, from one step to another, both included."""

    meeting: Meeting
    low: int
    high: int


class Schedule(Record):
    """Complete schedule: conditions with their steps, and the choices for the cost graph.

    ``late`` is the estimated delay of the schedule, seconds. ``company`` are permanent, ``escorts`` temporary
    companions of agents.
    """

    appointments: tuple[Appointment, ...]
    holds: tuple[Hold, ...]
    decisions: tuple[Decision, ...]
    choices: Choices
    late: float
    company: PresenceConstraints = NOBODY
    escorts: tuple[Escort, ...] = ()


class Leg(NamedTuple):
    """Path of an agent to a visit: from visit ``begin`` (-1 for the start), with its durations.

    Durations, seconds: ``seconds`` at the agent's usual speed, ``least`` at top speed, ``most`` at its least speed.
    """

    begin: int
    seconds: float
    least: float
    most: float


@dataclass(slots=True)
class VisitRun:
    """Earliest times of the visits of an order, with ``legs``: the paths of the agents to each visit."""

    cost: float = 0.0
    late: float = 0.0
    end: float = 0.0
    times: list[float] = field(default_factory=list)
    legs: list[list[Leg]] = field(default_factory=list)
    last: list[tuple[int, float]] = field(default_factory=list)
    places: list[tuple[Place, ...]] = field(default_factory=list)


def schedule_of(
    outline: Outline, appointments: tuple[Appointment, ...], options: list[Option], late: float, steps: int
) -> Schedule:
    """Schedule with conditions and choices counted from step 0, and all choices by formula, agent and step."""
    holds = [*outline.holds, *(hold for option in options for hold in option.holds)]
    decisions = [decision for option in options for decision in option.decisions]
    choices: dict[tuple[Node, int, int], int] = {}
    step_of = {each.visit.key: each.step for each in appointments}
    for appointment in appointments:
        if appointment.visit.fixed or appointment.visit.event.again:
            continue
        event, at = appointment.visit.event, appointment.step
        holds.extend(
            Hold(hold.agent, hold.node, hold.low + at, min(hold.high + at, steps), hold.timeless)
            for hold in event.holds
        )
        base = 0 if appointment.visit.after is None else step_of[appointment.visit.after]
        holds.extend(
            Hold(hold.agent, hold.node, base + hold.low, at - 1, hold.timeless)
            for hold in event.before
            if at > base + hold.low
        )
        decisions.extend(
            Decision(each.node, each.agent, each.part, each.low + at, min(each.high + at, steps))
            for each in event.decisions
        )
        choices[event.chooser, event.agent, event.step + base] = at
    for each in decisions:
        for step in range(each.low, each.high + 1):
            choices[each.node, each.agent, step] = each.part
    return Schedule(appointments, tuple(holds), tuple(decisions), choices, late)


Routes: TypeAlias = dict[int, Array]
"""Routes of agents, (corners, dim), metres, from the previous joint waypoint, if decided."""

NO_TOURS: Mapping[int, Array] = MappingProxyType({})
"""Empty mapping: no agent is on a separate tour."""


class KeyFrame(Record, eq=False):
    """Joint waypoint: configuration of all agents at a step.

    Args:
        position: (agents, dim), metres.
        shortfall: shortfall of the worst margin at this step, metres; at most 0 if all conditions are satisfied.
        worst: name of the condition with the worst margin.
    """

    step: int
    position: Array
    shortfall: float
    worst: str
    routes: Routes = field(default_factory=dict)
