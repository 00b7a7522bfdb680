"""Visits of a schedule, their steps and places, and key frames: the data types of scheduling."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import NamedTuple, TypeAlias

from missionc.backends.clot.optimise.active_set import Choices
from missionc.backends.clot.schedule.goal_sets import GoalSet
from missionc.backends.clot.schedule.mutex_literals import (
    TimedLiterals,
)
from missionc.backends.clot.schedule.presence import NOBODY, Meeting, PresenceConstraints
from missionc.backends.clot.schedule.tasks import Decision, Event, Hold, Option, Outline
from missionc.base.late_dataclass import Record
from missionc.base.trace import Array
from missionc.ir import Predicate, Region
from missionc.ir.kernel.nodes import Node

Key = tuple[int, int]
"""A visit: the index of its task, -1 for none, and its index within it."""


class Visit(Record):
    """An event, its agents' regions, and the visit that it follows (``then``).

    ``shapes`` are the required formations and graphs, ``kept`` the formations up to it. ``says`` has its exclusive
    literals, in seconds from the event; ``before`` likewise up to it, from the enclosing event. ``fixed``: it
    represents a condition at fixed steps, and decides nothing.
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
        """Agents that must move for it."""
        return self.come.agents | {agent for shape in self.shapes for agent in shape.others}


class Place(Record, eq=False):
    """Target of an agent, (dim,), metres.

    ``goal``: alternative targets, if known. ``sure``: a path is known. ``leaves``: position at the end of the visit,
    (dim,), metres; None if it stays.
    """

    agent: int
    point: Array
    goal: GoalSet | None = None
    sure: bool = True
    leaves: Array | None = None


class Appointment(Record, eq=False):
    """A visit at a step of the mission; ``places``: its agents' targets."""

    visit: Visit
    step: int
    places: tuple[Place, ...] = ()


class Escort(Record):
    """A meeting from one step to another, both included, while its agents move."""

    meeting: Meeting
    low: int
    high: int


class Schedule(Record):
    """Complete decision: conditions with their steps, and the choices for the cost graph.

    ``late`` is its estimated delay, seconds; ``company``: permanent companions; ``escorts``: temporary ones.
    """

    appointments: tuple[Appointment, ...]
    holds: tuple[Hold, ...]
    decisions: tuple[Decision, ...]
    choices: Choices
    late: float
    company: PresenceConstraints = NOBODY
    escorts: tuple[Escort, ...] = ()


class Leg(NamedTuple):
    """Path of an agent to a visit: from visit ``before`` (-1 for the start), with its duration.

    ``seconds`` at an agent's usual speed, ``least`` at top speed, ``most`` at its least speed.
    """

    begin: int
    seconds: float
    least: float
    most: float


@dataclass(slots=True)
class VisitRun:
    """Times of an order of visits, each the earliest; ``legs``: for each visit, its agents."""

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
    """Conditions and decisions counted from step 0, and all choices by formula, agent and step."""
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
"""Routes of agents, (corners, dim) in metres, from the previous key frame, if decided."""

NO_TOURS: Mapping[int, Array] = MappingProxyType({})
"""No agent on a tour of its own."""


class KeyFrame(Record, eq=False):
    """Configuration of all agents at a step.

    Args:
        position: (agents, dim), metres.
        shortfall: violation of the worst margin at this step, metres; at most 0 if all hold.
    """

    step: int
    position: Array
    shortfall: float
    worst: str
    routes: Routes = field(default_factory=dict)
