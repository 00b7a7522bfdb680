"""Lazy constraint generation (CEGAR): solve, find collisions in the model, forbid them, until there are none."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TypeAlias

import numpy as np

from missionc.backends.api import Progress, Reason
from missionc.backends.run_account import Account
from missionc.backends.smt.encode.clauses import FALSE, TRUE, Clauses, Literals, TooLarge
from missionc.backends.smt.encode.lower_motion import Motion
from missionc.backends.smt.refine.collisions import Separation, too_near
from missionc.backends.smt.sat.solve import Answer, Satisfiable, Solvers, Stopped, Unsatisfiable
from missionc.backends.smt.settings import smt_settings
from missionc.backends.work import conflicts_of, question_work
from missionc.base.figures import counted
from missionc.base.late_dataclass import Record
from missionc.base.trace import Flags, Indices
from missionc.ir import Mission


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
