"""Lazy constraint generation (CEGAR): solve, find collisions in the model, forbid them, until there are none.

Separation constraints, added when a model violates them: no two bodies closer than the mission allows.

Conflicts are computed from a model's joint motion. The added constraints cover all agents and steps: two agents in one
roadmap state, in states too close to each other, or on simultaneous moves that come too close.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TypeAlias

import numpy as np

from missionc.backends.api import Progress, Reason
from missionc.backends.run_account import Account, conflicts_of, question_work
from missionc.backends.smt.encode.clauses import FALSE, TRUE, Clauses, Literals, TooLarge
from missionc.backends.smt.encode.lower_motion import Motion, add_at_most_one
from missionc.backends.smt.sat.solve import Answer, Satisfiable, Solvers, Stopped, Unsatisfiable
from missionc.backends.smt.settings import smt_settings
from missionc.base.late_dataclass import Record
from missionc.base.trace import Array, Flags, Indices, counted
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


class Effort(Record):
    """Limits of one SAT query in counted units, so that they are equal on every machine.

    ``conflicts`` is the limit of each call of the solver, ``rounds`` the maximum number of calls.
    """

    conflicts: int
    rounds: int

    def within(self, work: float, clauses: int) -> Effort:
        """Limits reduced to ``work`` units for this number of clauses, but not below a minimum of rounds, since the
        first is expensive."""
        least_rounds = 8  # rounds of collision clauses of every question
        conflicts, rounds = conflicts_of(work, clauses), work / question_work(max(1, clauses), 0)
        fewer = self.conflicts if conflicts is None else min(self.conflicts, conflicts)
        return Effort(fewer, int(min(self.rounds, max(least_rounds, rounds))))


class JointMotion(Record, eq=False):
    """Joint motion without conflicts: each agent's state in its roadmap, (agents, steps + 1)."""

    states: Indices


Result: TypeAlias = JointMotion | Unsatisfiable | Stopped


@dataclass(slots=True)
class LazyConstraints:
    """Lazy constraint generation for one problem; collision clauses are retained for later queries.

    ``cast``, (cast,), are the agents to plan. Other agents are absent, or their motion is known and out of reach of the
    agents' moves.
    """

    mission: Mission
    motion: Motion
    cast: Indices
    clauses: Clauses
    solvers: Solvers
    account: Account
    listen: Callable[[Progress], None]
    proves: bool = True
    """True if a refusal proves that the roadmaps contain no plan; False for a problem stronger than the mission."""
    rounds: int = 0
    work: float = 0.0
    """Work of its queries, in units of ``work``."""
    presolve_budget: int = field(init=False)
    """Number of clauses that presolves may still read; 0 once a presolve gave no answer."""
    nearest: Indices | None = None
    """First model with the fewest collisions so far, states (agents, steps + 1), as in ``JointMotion``."""
    fewest: int = 0
    """Number of collisions of ``nearest``."""
    _separation: Separation = field(init=False)

    def __post_init__(self) -> None:
        pair, crowd = 2, 5  # a pair needs few clauses, and a crowd meets often: their places are separated at once
        settings = smt_settings(self.mission).solver
        self.presolve_budget = settings.presolve_clauses
        self._separation = Separation(self.mission, self.motion, self.cast, self.clauses)
        if len(self.cast) == pair or len(self.cast) >= crowd or self.clauses.count < settings.eager_clauses:
            with self.account.stage("collisions"):
                self._separation.one_in_each_place()

    def find(self, assumptions: tuple[int, ...], effort: Effort | None = None) -> Result:
        """Joint motion without collisions under the assumptions, or the reason why there is none."""
        most = None if effort is None else self.rounds + effort.rounds
        while self.rounds != most:
            self.rounds += 1
            with self.account.stage("solve"):
                states = self.joint_motion(assumptions, effort)
            if not isinstance(states, np.ndarray):
                return states
            with self.account.stage("collisions"):
                near = too_near(states, self.cast, self.motion, self.mission)
                if not len(near):
                    return JointMotion(states)
                if self.nearest is None or len(near) < self.fewest:
                    self.nearest, self.fewest = states, len(near)
                try:
                    self._separation.forbid(near, states)
                except TooLarge as error:
                    return Stopped(Reason.SIZE, f"{error}; the limit is {self.clauses.limit}")
            self.listen(Progress("solve", self.rounds, f"{counted(len(near), 'conflict')} between agents"))
        wrong = f"agents still conflict after {effort.rounds} rounds" if effort else ""
        return Stopped(Reason.SOLVER, wrong, paused=True)

    def joint_motion(self, assumptions: tuple[int, ...], effort: Effort | None) -> Indices | Unsatisfiable | Stopped:
        """Each agent's state, (agents, steps + 1), in a model of the clauses so far, or the reason why there is
        none."""
        presolved = 100  # assumed number of conflicts of a presolve, which does not report them
        seen = None
        if self.presolve_budget > 0:
            seen = self.solvers.presolve(self.clauses, assumptions)
            self.worked(presolved)
            self.presolve_budget = 0 if seen is None else self.presolve_budget - self.clauses.count
        if isinstance(seen, Unsatisfiable):
            return seen
        if seen is not None:
            return self._states(seen.__getitem__)
        answer = self.ask(assumptions, effort)
        return self._states(self.solvers.values) if isinstance(answer, Satisfiable) else answer

    def ask(self, assumptions: tuple[int, ...], effort: Effort | None = None) -> Answer:
        """Answer of the solver for the clauses so far; a refusal contains its core."""
        self.solvers.add(self.clauses)
        before = self.solvers.conflicts
        answer = self.solvers.solve(assumptions, conflicts=effort.conflicts if effort else None)
        self.worked(self.solvers.conflicts - before)
        return answer

    def worked(self, conflicts: int) -> None:
        """Add the work of a query with this number of conflicts to the account."""
        done = question_work(self.clauses.count, conflicts)
        self.work += done
        self.account.work += done

    def _states(self, holding: Callable[[Literals], Flags | Stopped]) -> Indices | Stopped:
        """States of the agents in a model, (agents, steps + 1), read step by step, only for reachable states.

        Args:
            holding: function from variables, by number, to their truth in the model.
        """
        motion = self.motion
        states = np.zeros((motion.agents, motion.steps + 1), dtype=np.int64)
        for step in range(motion.steps + 1):
            agents, options, literals = [], [], []
            for agent in self.cast.tolist():
                there = motion.states[agent][step]
                moves = motion.roadmap(agent).moves
                able = moves[moves[:, 0] == states[agent, step - 1], 1] if step else np.arange(len(there))
                able = able[there[able] != FALSE]
                agents.append(np.full(len(able), agent))
                options.append(able)
                literals.append(there[able])
            query = np.concatenate(literals)
            values = holding(query)
            if isinstance(values, Stopped):
                return values
            true = values | (query == TRUE)
            states[np.concatenate(agents)[true], step] = np.concatenate(options)[true]
        return states
