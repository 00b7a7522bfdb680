"""Queries whether a subset of the requirements is satisfiable on roadmaps that contain no plan for all of them.

    in   the roadmaps of a run that found no plan, and a conflict there
    out  the smallest conflict within the work: unsatisfiable on all roadmaps; for each proper subset, whether some
         roadmap satisfies it

Each query is answered by single-agent analysis first, then by a SAT problem of the whole team, then by prioritized
planning, and limited in units of work.
"""

from __future__ import annotations

import time
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from typing import TypeAlias

from missionc.backends.api import Budget, discard_plan, no_bound
from missionc.backends.run_account import CLAUSE, Account
from missionc.backends.smt.encode.clauses import Clauses, TooLarge
from missionc.backends.smt.encode.lower_motion import Ways, all_ways
from missionc.backends.smt.prioritized.prioritized_plan import PrioritizedPlan
from missionc.backends.smt.prioritized.single_agent_relaxation import SingleAgentRelaxation
from missionc.backends.smt.refine.lazy_constraints import Effort, JointMotion
from missionc.backends.smt.refine.problem import Deletion, Setting, named_by_solver
from missionc.backends.smt.roadmap.labels import Labels, Unexpressible
from missionc.backends.smt.roadmap.roadmap import Roadmap, whole_moves
from missionc.backends.smt.roadmap_answers import NoPlan
from missionc.backends.smt.sat.solve import Solvers, Unsatisfiable
from missionc.backends.smt.settings import smt_settings
from missionc.base.late_dataclass import Record
from missionc.ir import Mission, Objective
from missionc.ir.kernel.nodes import Goal, Kernel


class Holds(Record):
    """Answer: a roadmap contains a plan."""


class Unknown(Record):
    """Answer: neither a plan nor a refusal within the work."""


Answer: TypeAlias = Holds | NoPlan | Unknown


def infeasible_alone(
    goals: Iterable[Goal], mission: Mission, roadmaps: tuple[Roadmap, ...], account: Account
) -> list[str]:
    """Names of the requirements that single-agent analysis refutes on these roadmaps, each by itself."""
    if whole_moves(roadmaps) > smt_settings(mission).solver.relaxation_moves:
        return []
    everyone = frozenset(range(len(mission.agents)))
    with account.stage("alone"):
        relaxation = SingleAgentRelaxation(Labels(mission, roadmaps), Ways(roadmaps, {}), everyone)
        return [goal.name for goal in goals if relaxation.infeasible([goal.formula])]


@dataclass(slots=True, eq=False)
class SubsetQuestions:
    """Queries about subsets of the requirements, on roadmaps that contain no plan for all of them.

    Args:
        kernel: requirements in the form used on these roadmaps.
        unproven: names of requirements in a stronger form, so that a refusal that uses one of them proves nothing.
        roadmaps: roadmaps without a plan, small ones first.
        certify: True to use clauses that allow a proof.
    """

    mission: Mission
    kernel: Kernel
    unproven: frozenset[str]
    roadmaps: list[tuple[Roadmap, ...]]
    budget: Budget
    account: Account
    solvers: Solvers
    certify: bool = False
    most: float = field(init=False)
    longest: float = field(init=False)
    """Duration of the longest query so far, seconds; initially of a query on an earlier roadmap."""

    def __post_init__(self) -> None:
        settings = smt_settings(self.mission).work
        self.mission = replace(self.mission, objective=Objective.NONE)
        self.budget = replace(
            self.budget, on_incumbent=discard_plan, lower_bound=no_bound
        )  # a plan of less is none of the mission
        self.most = self.account.work + max(settings.conflict, settings.conflict_share * self.account.work)
        self.longest = sum(self.account.seconds.values()) / max(1, len(self.roadmaps))

    def smallest(self, conflict: tuple[str, ...], last: NoPlan) -> tuple[Deletion, NoPlan]:
        """Conflict after deletion, and its refusal by the last roadmap, initially ``last``."""
        deletion = Deletion(conflict)
        while (name := deletion.question()) is not None and self.affordable:
            begin = time.monotonic()
            try:
                answer = self.ask(deletion.without(name))
            except MemoryError:  # the existing refusal remains the answer
                answer = Unknown()
            match answer:
                case Holds():
                    deletion.holds(name)
                case NoPlan(core) as refusal:
                    deletion.refused(core)
                    last = refusal
                case Unknown():
                    deletion.unknown(name)
            self.longest = max(self.longest, time.monotonic() - begin)
        return deletion, last

    @property
    def affordable(self) -> bool:
        """True if work is left, and more time than a query takes, so that no answer is lost."""
        timely = time.monotonic() + 2 * self.longest < self.budget.deadline
        return timely and self.account.work < self.most and self.solvers.alive

    def ask(self, names: tuple[str, ...]) -> Answer:
        """Answer to the query whether these requirements alone are satisfiable on some roadmap; a refusal contains a
        core."""
        goals = tuple(goal for goal in self.kernel.requirements if goal.name in names)
        core, settled, last = set[str](), True, None
        for roadmaps in self.roadmaps:
            answer = self.on(roadmaps, goals)
            if isinstance(answer, Holds):
                return answer
            if isinstance(answer, NoPlan):
                core.update(answer.conflict)
                last = answer
            else:
                settled = False
        if not settled or last is None:
            return Unknown()
        return replace(last, conflict=tuple(goal.name for goal in goals if goal.name in core))

    def on(self, roadmaps: tuple[Roadmap, ...], goals: tuple[Goal, ...]) -> Answer:
        """Answer to the query whether these roadmaps contain a plan for the goals."""
        try:
            return self.proved(self.alone(roadmaps, goals) or self.together(roadmaps, goals))
        except (TooLarge, Unexpressible):
            return self.few_at_a_time(roadmaps, goals)

    def proved(self, answer: Answer) -> Answer:
        """Answer unchanged, unless it is a refusal of requirements in a stronger form, which becomes unknown."""
        doubtful = isinstance(answer, NoPlan) and not self.unproven.isdisjoint(answer.conflict)
        return Unknown() if doubtful else answer

    def alone(self, roadmaps: tuple[Roadmap, ...], goals: tuple[Goal, ...]) -> NoPlan | None:
        """Refusal of one goal by single-agent analysis; None without a refusal."""
        if self.certify:
            return None
        names = infeasible_alone(goals, self.mission, roadmaps, self.account)
        return NoPlan((names[0],), Clauses(1), ()) if names else None

    def together(self, roadmaps: tuple[Roadmap, ...], goals: tuple[Goal, ...]) -> Answer:
        """Plan or refusal from one SAT problem of all agents, or else a plan by prioritized planning.

        Raises:
            TooLarge: the clauses take more work than is left.
            Unexpressible: a predicate depends on too many agents at once.
        """
        share = smt_settings(self.mission).work.question_share * (self.most - self.account.work)
        everyone = frozenset(range(len(self.mission.agents)))
        setting = self.setting(share)
        ways = all_ways(roadmaps, {})
        settings = smt_settings(self.mission).solver
        effort = Effort(settings.conflict_conflicts, settings.conflict_rounds)
        problem = setting.problem(goals, roadmaps, ways, everyone, frozenset(), len(everyone), self.solvers)
        search, asked = problem.search, problem.lowered.goals
        result = search.find(asked, effort.within(share, search.clauses.count))
        if isinstance(result, JointMotion):
            return Holds()
        if isinstance(result, Unsatisfiable):
            core = named_by_solver(result.core, search)
            names = tuple(goal.name for goal, literal in zip(goals, asked, strict=True) if literal in core)
            return NoPlan(names, search.clauses, core)
        return self.few_at_a_time(roadmaps, goals)

    def few_at_a_time(self, roadmaps: tuple[Roadmap, ...], goals: tuple[Goal, ...]) -> Answer:
        """Answer by prioritized planning: a plan if one is found, otherwise unknown."""
        if self.mission.steps == 0 or not self.affordable:
            return Unknown()
        share = smt_settings(self.mission).work.question_share * (self.most - self.account.work)
        most = self.account.work + share
        plan = PrioritizedPlan(self.setting(share), Kernel(goals, ()), roadmaps, self.solvers, most, most)
        try:
            return Holds() if plan.find() is not None else Unknown()
        except (TooLarge, Unexpressible):
            return Unknown()

    def setting(self, share: float) -> Setting:
        """Common setting of problems, with as many clauses as ``share`` work units allow."""
        clauses = min(self.budget.limits.clauses, max(1, int(share / CLAUSE)))
        return Setting(self.mission, self.budget, self.account, clauses)
