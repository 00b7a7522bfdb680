"""Visits of a schedule, their steps and places, and key frames: the values that scheduling passes on."""

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
from missionc.base.trace import Array
from missionc.ir import Predicate, Region
from missionc.ir.kernel.nodes import Node

Key = tuple[int, int]
"""A visit: the number of its task, -1 for none, and its own within that."""


@dataclass(frozen=True, slots=True)
class Visit:
    """An event, the regions its agents are asked to be in, and which visit it comes after (``then``).

    ``shapes`` are the formations and graphs asked for, ``kept`` the formations up to it. ``says`` is what
    else may deny, in seconds from the event; ``before`` likewise up to it, from the event around it.
    ``fixed``: it stands for what holds at fixed steps, and decides nothing.
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
        """Who has to get somewhere for it."""
        return self.come.agents | {agent for shape in self.shapes for agent in shape.others}


@dataclass(frozen=True, slots=True, eq=False)
class Place:
    """Where an agent goes, (dim,), metres.

    ``goal``: where else would do, where that is known. ``sure``: a way there is known. ``leaves``: where it has come to
    when the visit ends, (dim,), metres; None where it stays.
    """

    agent: int
    point: Array
    goal: GoalSet | None = None
    sure: bool = True
    leaves: Array | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Appointment:
    """A visit at a step of the mission; ``places``: where its agents go for it."""

    visit: Visit
    step: int
    places: tuple[Place, ...] = ()


@dataclass(frozen=True, slots=True)
class Escort:
    """A meeting that lasts from one step to another, both included, wherever its agents go meanwhile."""

    meeting: Meeting
    low: int
    high: int


@dataclass(frozen=True, slots=True)
class Schedule:
    """Everything decided: what holds at which steps of the mission, and the choices to tell the cost graph.

    ``late`` is by how many seconds it cannot be kept, by this estimate;
    ``company``: who has to be near whom all the time; ``escorts``: and who for a while.
    """

    appointments: tuple[Appointment, ...]
    holds: tuple[Hold, ...]
    decisions: tuple[Decision, ...]
    choices: Choices
    late: float
    company: PresenceConstraints = NOBODY
    escorts: tuple[Escort, ...] = ()


class Leg(NamedTuple):
    """An agent's way to a visit: from which one, by its number, -1 for the start; and how long after that one it is.

    ``seconds`` at an agent's usual pace, ``least`` at top speed, ``most`` at the least speed that it can go.
    """

    begin: int
    seconds: float
    least: float
    most: float


@dataclass(slots=True)
class VisitRun:
    """An order of visits as it comes out, each as soon as can be; ``legs``: for each visit those who come for it."""

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
    """Holds and decisions counted from step 0, and all choices by formula, agent and step."""
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
"""The routes, (corners, dim) in metres, by which agents come from the key frame before, where that is decided."""

NO_TOURS: Mapping[int, Array] = MappingProxyType({})
"""No agent on a tour of its own."""


@dataclass(frozen=True, slots=True, eq=False)
class KeyFrame:
    """Args:
    position: (agents, dim), metres.
    shortfall: metres by which the worst margin fails at this step; at most 0 where all hold.
    """

    step: int
    position: Array
    shortfall: float
    worst: str
    routes: Routes = field(default_factory=dict)
