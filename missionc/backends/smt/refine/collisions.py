"""Separation constraints, added when a model violates them: no two bodies closer than the mission allows.

Conflicts are computed from a model's joint motion. The added constraints cover all agents and steps: two agents in one
roadmap state, in states too close to each other, or on simultaneous moves that come too close.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from missionc.backends.smt.encode.clauses import FALSE, Clauses, Literals
from missionc.backends.smt.encode.lower_motion import Motion, add_at_most_one
from missionc.base.late_dataclass import Record
from missionc.base.trace import Array, Indices
from missionc.geometry.dynamics import Motions, States, motions_between
from missionc.geometry.relative_motion import closest_approach
from missionc.geometry.required_separation import SpacingTable
from missionc.ir import Mission

CUSHION = 1e-6
"""Additional separation, metres, so that rounding errors cause no contact."""


class Near(Record, eq=False):
    """Pairs of agents that come too close within a step: both agents and the step, (pairs,) each."""

    first: Indices
    second: Indices
    step: Indices

    def __len__(self) -> int:
        return len(self.step)


def too_near(states: Indices, agents: Indices, motion: Motion, mission: Mission) -> Near:
    """All pairs of ``agents`` that violate the separation in a joint motion, with the steps.

    Args:
        states: each agent's state in its roadmap, (agents of the mission, steps + 1).
    """
    first, second = np.triu_indices(len(agents), k=1)
    moving = kinematics(states[agents], agents, motion, mission)
    factors = each_step(metric(agents[first], agents[second], mission))
    least = closest_approach(moving.take(first), moving.take(second), mission.step if motion.steps else 0.0, factors)
    first, second = agents[first], agents[second]
    pair, step = np.nonzero(least < needed(first, second, mission)[:, None])
    return Near(first[pair], second[pair], step)


def needed(first: Indices, second: Indices, mission: Mission) -> Array:
    """Required horizontal distance of the centres of pairs of agents, (pairs,), metres."""
    return SpacingTable.of(mission).between(first, second) + CUSHION


def metric(first: Indices, second: Indices, mission: Mission) -> Array | None:
    """Factors on the axes of the differences of pairs of agents, (pairs, dim), dimensionless; None if all factors are
    1."""
    return SpacingTable.of(mission).metric(first, second)


def each_step(factors: Array | None) -> Array | None:
    """Factors for every step: (pairs, dim) -> (pairs, 1, dim), dimensionless; None stays None."""
    return None if factors is None else factors[:, None]


def kinematics(states: Indices, agents: Indices, motion: Motion, mission: Mission) -> Motions:
    """Motions of each step, (agents, steps); in a mission without steps, one motion at rest.

    Args:
        states: states in the roadmap of each of ``agents`` (mission indices, (agents,)), (agents, steps + 1).
    """
    rows = []
    for agent, row in zip(agents.tolist(), states, strict=True):
        roadmap = motion.roadmap(agent)
        here = States(roadmap.position[row], roadmap.velocity[row])
        if motion.steps == 0:
            rows.append(Motions(here.position, np.zeros_like(here.position), np.zeros_like(here.position)))
            continue
        before, after = here.take(np.arange(motion.steps)), here.take(np.arange(1, motion.steps + 1))
        rows.append(motions_between(mission.agents[agent].dynamics, before, after, mission.step))
    return Motions.stacked(rows)


@dataclass(slots=True)
class Separation:
    """Separation clauses so far, for the agents of ``cast``, (cast,)."""

    mission: Mission
    motion: Motion
    cast: Indices
    clauses: Clauses
    _alone: set[int] = field(default_factory=set)
    _apart: set[tuple[tuple[int, ...], tuple[int, ...]]] = field(default_factory=set)
    _events: dict[tuple[int, ...], Literals] = field(default_factory=dict)
    _members: list[list[int]] = field(init=False)
    """For each roadmap, its agents that are encoded."""

    def __post_init__(self) -> None:
        numbers = self.motion.roadmap_of[self.cast]
        self._members = [self.cast[numbers == number].tolist() for number in range(len(self.motion.roadmaps))]

    def one_in_each_place(self) -> None:
        """Add in advance that no two agents are in one state.

        Raises:
            TooLarge: the clauses would exceed their limit.
        """
        for members in self._members:
            there = [self.motion.states[agent].ravel() for agent in members]
            if there:
                self._one_of(np.stack(there, axis=1))
        self._alone.update(range(self.motion.places))

    def forbid(self, near: Near, states: Indices) -> None:
        """Add clauses that forbid these conflicts, and the same conflicts of other agents and steps.

        Args:
            states: joint motion with the conflicts, (agents, steps + 1).

        Raises:
            TooLarge: the clauses would exceed their limit.
        """
        last = self.motion.steps
        for first, second, step in zip(near.first.tolist(), near.second.tolist(), near.step.tolist(), strict=True):
            one = self._place(first, states[first, step])
            other = self._place(second, states[second, step])
            if one == other:
                self._one_at(one)
            elif self._touch(first, states[first, step], second, states[second, step]):
                self._not_both((one,), (other,))
            elif step < last:
                after = self._place(first, states[first, step + 1]), self._place(second, states[second, step + 1])
                if after[0] == after[1]:
                    self._one_at(after[0])
                else:
                    self._not_both((one, after[0]), (other, after[1]))

    def _place(self, agent: int, state: int) -> int:
        return int(state) + int(self.motion.places_of(agent).start)

    def _touch(self, first: int, one: int, second: int, other: int) -> bool:
        pair = np.array([first]), np.array([second])
        between = self.motion.roadmap(first).position[one] - self.motion.roadmap(second).position[other]
        factors = metric(*pair, self.mission)
        apart = between if factors is None else between * factors[0]
        return float(np.linalg.norm(apart)) < float(needed(*pair, self.mission)[0])

    def _one_at(self, place: int) -> None:
        """Add that a state contains at most one agent at every step."""
        if place not in self._alone:
            self._alone.add(place)
            number, state = self._state(place)
            self._one_of(np.stack([self.motion.states[agent][:, state] for agent in self._members[number]], axis=1))

    def _one_of(self, there: Literals) -> None:
        """Add that at most one literal of each row, (rows, agents), is true."""
        crowded = (there != FALSE).sum(axis=1) > 1
        add_at_most_one(self.clauses, there[crowded])

    def _not_both(self, one: tuple[int, ...], other: tuple[int, ...]) -> None:
        """Add that no two agents occupy both states, or make both moves, at any step."""
        if (one, other) not in self._apart:
            self._apart |= {(one, other), (other, one)}
            self.clauses.add(-self._event(one), -self._event(other))

    def _event(self, places: tuple[int, ...]) -> Literals:
        """Literals that some agent is in the state, or moves from the first to the second state: (steps,), or one more
        for a state."""
        if places not in self._events:
            number, *_ = (self._state(place)[0] for place in places)
            moments = self.motion.steps + 2 - len(places)
            name = self.clauses.fresh(moments)
            for agent in self._members[number]:
                states = self.motion.states[agent]
                there = [-states[ahead : ahead + moments, self._state(place)[1]] for ahead, place in enumerate(places)]
                self.clauses.add(*there, name)
            self._events[places] = name
        return self._events[places]

    def _state(self, place: int) -> tuple[int, int]:
        """Index of the roadmap of a place (a state counted over all roadmaps), and the state's index in that
        roadmap."""
        number = int(np.searchsorted(self.motion.first_place, place, side="right")) - 1
        return number, place - int(self.motion.first_place[number])
