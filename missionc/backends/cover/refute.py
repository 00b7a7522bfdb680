"""Refutation on covers: proofs of infeasibility, and lower bounds of the duration.

    in   Mission, Kernel
    out  Refuted with the requirements of the proof, Inconclusive or Open

Coarse covers come first. On each cover, single agents are examined first, then pairs, then the team. A formula that is
unsatisfiable on a cover is unsatisfiable for every trajectory. A trajectory that a cover admits may still be
impossible. A cover that is too large gives no result.

The least duration is a number of steps that every plan needs. Bisection searches it between a known lower bound and the
steps of a known plan. Each query asks if every agent can be at rest from some step on. A resting agent stays in its
cell, so a refusal holds for every trajectory that ends by that step.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import combinations, pairwise
from typing import TypeAlias

import numpy as np

from missionc.backends.api import Budget
from missionc.backends.cover.cover import TOUCH, Cover, build_cover
from missionc.backends.cover.keep_apart import add_crowding, add_separation
from missionc.backends.cover.may_labels import MayLabels, relaxed
from missionc.backends.cover.may_moves import add_turns
from missionc.backends.cover.may_visit import add_visits
from missionc.backends.cover.motion_caps import Caps, motion_caps
from missionc.backends.run_account import CLAUSE, Account, conflicts_of, question_work
from missionc.backends.smt.encode.clauses import FALSE, Clauses, Literals, TooLarge
from missionc.backends.smt.encode.lower import lower
from missionc.backends.smt.encode.lower_motion import Motion, Occupancy, add_moves, all_ways, lower_motion
from missionc.backends.smt.prioritized.requirement_parts import named_agents, throughout
from missionc.backends.smt.roadmap.labels import Unexpressible
from missionc.backends.smt.roadmap_answers import cannot_hold
from missionc.backends.smt.sat.solve import Satisfiable, Solvers, Unsatisfiable, for_refusals
from missionc.base.late_dataclass import Record
from missionc.base.trace import Flags
from missionc.ir import Mission
from missionc.ir.kernel.nodes import All, At, Goal, Kernel, Node
from missionc.ir.kernel.walk import conjuncts

CLAUSES = 600_000
"""Maximum number of clauses of a query."""

PAIRED = 1 / 2_500_000
"""Work units for a pair of cells that two agents may occupy together at a step."""

CONFLICTS = 20_000
"""Maximum number of conflicts of a query; the remaining work may allow fewer."""


@dataclass(slots=True, eq=False)
class Question:
    """SAT query: does the cover admit a trajectory that satisfies these requirements?

    Args:
        together: agents with mutual separation; if empty, all agents are included without separation.
        solvers: solvers to use; they forget earlier problems.
        admitted: True if the cover admits a trajectory; valid after the query.
        smallest: True if the cover admits every proper subset of a refusal's requirements.
        motion: variables of the agents' positions, after lowering.
    """

    caps: Caps
    cover: Cover
    goals: tuple[Goal, ...]
    together: frozenset[int]
    budget: Budget
    account: Account
    solvers: Solvers
    admitted: bool = False
    smallest: bool = False
    motion: Motion | None = None

    @property
    def pair_work(self) -> float:
        """Work units to compute the possible joint positions of pairs of agents."""
        kinds = zip(self.cover.cells, self.cover.roadmaps, strict=True)
        count = {agent: len(cells) for cells, roadmap in kinds for agent in roadmap.agents}
        pairs = sum(count[one] * count[other] for one, other in combinations(self.together, 2))
        return PAIRED * pairs * (self.caps.mission.steps + 1)

    @property
    def cast(self) -> frozenset[int]:
        """Agents that the query is about."""
        return self.together or frozenset(range(len(self.caps.mission.agents)))

    @property
    def ways(self) -> tuple[Flags, ...]:
        """Possible cells of each agent at each step, (steps + 1, cells)."""
        return all_ways(self.cover.roadmaps, self.cover.never)

    @property
    def labels(self) -> MayLabels:
        """Labels of the cover's cells."""
        return MayLabels(self.caps.mission, self.cover.roadmaps, self.cover.cells)

    def refused(self) -> frozenset[str] | None:
        """Names of the requirements of a refusal; None if there is no refusal, or it would take too much work."""
        budget = self.budget
        if self.account.work + self.pair_work > budget.work:
            return None
        self.account.work += self.pair_work
        try:
            with self.account.stage("cover"):
                clauses, asked = self.lowered()
                self.account.work += CLAUSE * clauses.count
            self.solvers.begin()
            return self._refused(clauses, asked)
        except (TooLarge, Unexpressible):
            self.account.work += CLAUSE * CLAUSES
            return None

    def lowered(self) -> tuple[Clauses, tuple[int, ...]]:
        """Clauses of the query, and a literal to assume for each requirement.

        Raises:
            TooLarge: the clauses would exceed the limit.
            Unexpressible: cells do not decide a requirement.
        """
        mission, cover = self.caps.mission, self.cover
        clauses = Clauses(CLAUSES)
        cast = self.cast
        self.motion = motion = lower_motion(cover.roadmaps, self.ways, cast, clauses)
        _add_strides(cover, motion, cast, clauses)
        add_visits(mission, cover, motion, cast, self.caps.lengths, clauses)
        add_turns(mission, cover.cells, motion, cast, clauses)
        add_crowding(mission, cover, motion, self.together, clauses)
        add_separation(mission, cover, motion, self.together, clauses)
        lowered = lower(self.goals, self.labels, motion, clauses, Occupancy(motion, clauses), len(mission.agents))
        return clauses, lowered.goals

    def _refused(self, clauses: Clauses, asked: tuple[int, ...]) -> frozenset[str] | None:
        core = self.core(clauses, asked)
        if core is None:
            return None
        self.smallest = True
        for literal in core:
            if literal in core:
                self.admitted = False
                smaller = self.core(clauses, tuple(other for other in core if other != literal))
                self.smallest &= smaller is not None or self.admitted
                core = core if smaller is None else smaller
        return frozenset(goal.name for goal, literal in zip(self.goals, asked, strict=True) if literal in core)

    def core(self, clauses: Clauses, asked: tuple[int, ...]) -> tuple[int, ...] | None:
        """Assumed literals that a refusal uses; None without a refusal."""
        with self.account.stage("cover"):
            before, left = self.solvers.conflicts, self.budget.work - self.account.work
            self.solvers.add(clauses)
            allowed = conflicts_of(max(left, 0.0), clauses.count)
            answer = self.solvers.solve(asked, conflicts=min(CONFLICTS, allowed or CONFLICTS))
            self.account.work += question_work(clauses.count, self.solvers.conflicts - before)
        self.admitted = self.admitted or isinstance(answer, Satisfiable)
        return answer.core if isinstance(answer, Unsatisfiable) else None


def _add_strides(cover: Cover, motion: Motion, cast: frozenset[int], clauses: Clauses) -> None:
    """Add clauses that limit the distance of each agent over several steps."""
    for roadmap, strides in zip(cover.roadmaps, cover.strides, strict=True):
        for steps, may in strides:
            source, target = np.nonzero(may)
            for agent in cast.intersection(roadmap.agents):
                here, there = motion.states[agent][:-steps], motion.states[agent][steps:]
                ways = motion.ways[agent]
                live = ways[:-steps][:, source] & ways[steps:][:, target]
                add_moves(clauses, here, there, live, source, target)


CELLS = 8, 40, 160, 480
"""Numbers of cells per kind of agent of the successive covers."""

MOST_PAIRS = 10
"""Maximum number of pairs of agents for which each pair is a separate query."""

SQUARED = 1 / 10_000_000
"""Work units for a pair of cells: their distance, and the chain between them."""


class Refuted(Record):
    """Proof that no trajectory satisfies the requirements ``conflict``, not even at the sample times only.

    Without requirements, the agents cannot move at all. ``smallest`` is true if the cover admits every proper subset of
    the requirements. ``question`` is the refused query.
    """

    conflict: tuple[str, ...]
    cells: int
    smallest: bool
    question: Question

    def __str__(self) -> str:
        return f"{cannot_hold(self.conflict)} by any motion (over-approximation with {self.cells} cells)"


class Inconclusive(Record):
    """Result that a cover with this many cells admits a trajectory, which does not imply that a plan exists."""

    cells: int

    def __str__(self) -> str:
        return f"an over-approximation with {self.cells} cells does not exclude other motions"


class Open(Record):
    """Result that nothing is proved: no query about the whole mission fitted into the budget, and no smaller query was
    refused."""

    def __str__(self) -> str:
        return "other motions are not excluded: no over-approximation of the mission was decided"


Answer: TypeAlias = Refuted | Inconclusive | Open


def refute(mission: Mission, kernel: Kernel, budget: Budget, account: Account, solver: str = "auto") -> Answer:
    """Result of the cover method for the requirements, within the budget's work, all of which the function may use."""
    with Solvers(for_refusals(solver), budget.memory_bytes, budget.seed, budget.deadline, presolve=0) as solvers:
        return _refuted(mission, kernel, budget, account, solvers)


def _refuted(mission: Mission, kernel: Kernel, budget: Budget, account: Account, solvers: Solvers) -> Answer:
    weaker = relaxed(mission, kernel)
    everybody = frozenset(range(len(mission.agents)))
    caps = motion_caps(mission, kernel)
    answer: Answer = Open()
    took = 0.0
    for before, count in pairwise((CELLS[0], *CELLS)):
        if over(budget, account) or time.monotonic() + took * (count / before) ** 2 > budget.deadline:
            break  # the work is done, or the next cover would come too late
        began = time.monotonic()
        with account.stage("cover"):
            cover = build_cover(caps.mission, weaker, count)
            account.work += squared_work(cover)
        took = time.monotonic() - began
        for together, goals in questions(mission, weaker, everybody):
            if over(budget, account) or not solvers.alive:
                return answer
            question = Question(caps, cover, goals, together, budget, account, solvers)
            conflict, smallest = question.refused(), question.smallest and not caps.causes
            if conflict is not None and caps.causes:
                freer = Caps(mission, {}, frozenset())
                uncapped = build_cover(mission, weaker, count)
                uncapped_question = Question(freer, uncapped, goals, together, budget, account, solvers)
                alone = uncapped_question.refused()
                conflict = conflict | caps.causes if alone is None else alone
                question = question if alone is None else uncapped_question
            if conflict is not None:
                names = tuple(goal.name for goal in kernel.requirements if goal.name in conflict)
                return Refuted(names, cover.states, smallest, question)
            if question.admitted and (together == everybody or len(everybody) == 1):
                answer = Inconclusive(cover.states)
    return answer


def squared_work(cover: Cover) -> float:
    """Work units to build a cover."""
    return SQUARED * sum(len(cells) ** 2 for cells in cover.cells)


def over(budget: Budget, account: Account) -> bool:
    """Return true if the budget's work is done, or its time is up."""
    return account.work >= budget.work or time.monotonic() >= budget.deadline


def questions(
    mission: Mission, kernel: Kernel, everybody: frozenset[int]
) -> Iterator[tuple[frozenset[int], tuple[Goal, ...]]]:
    """Yield sets of agents with separation, each with the requirements about its agents: single agents, pairs (if few),
    all agents.

    Pairs are omitted if one of the agents has no prescribed position.
    """
    goals = kernel.requirements
    yield frozenset(), _about(goals, 1, everybody)
    bound = frozenset(agent.index for agent in mission.agents if agent.finish is not None)
    pairs = [frozenset(pair) for pair in combinations(sorted(everybody), 2)]
    if 1 < len(pairs) <= MOST_PAIRS:
        for pair in pairs:
            asked = _about(goals, 2, pair)
            named = named_agents(goal.formula for goal in asked)
            if pair <= bound.union(*(named[goal.formula] for goal in asked)):
                yield pair, asked
    if pairs:
        yield everybody, goals


def _about(goals: tuple[Goal, ...], most: int, among: frozenset[int]) -> tuple[Goal, ...]:
    """Requirements that name at most ``most`` of the agents ``among``, and no others."""
    made = []
    for goal in goals:
        parts: list[Node] = []
        for agent, windows, node in conjuncts((goal.formula,)):
            named = named_agents((node,))[node] | ({agent} if agent is not None else set())
            if 0 < len(named) <= most and named <= among:
                body = throughout(windows, node)
                parts.append(body if agent is None else At(agent, body, node.span))
        if parts:
            made.append(replace(goal, formula=All(tuple(parts))))
    return tuple(made)


def least_duration(
    mission: Mission, kernel: Kernel, least: int, lasts: int, budget: Budget, account: Account, solver: str = "auto"
) -> int:
    """Lower bound of the steps of every plan by the cover method, within the budget's work, all of which the function
    may use.

    Args:
        least: known lower bound of the steps.
        lasts: number of steps of a known plan.
    """
    weaker, caps = relaxed(mission, kernel), motion_caps(mission, kernel)
    everybody = frozenset(range(len(mission.agents)))
    with Solvers(for_refusals(solver), budget.memory_bytes, budget.seed, budget.deadline, presolve=0) as solvers:
        for count in CELLS:
            if least >= lasts or over(budget, account):
                break
            with account.stage("bound"):
                cover = build_cover(caps.mission, weaker, count)
                account.work += squared_work(cover)
            for together, goals in questions(mission, weaker, everybody):
                if least < lasts and solvers.alive and not over(budget, account):
                    least = _asked(Question(caps, cover, goals, together, budget, account, solvers), least, lasts)
    return least


def _asked(question: Question, least: int, lasts: int) -> int:
    """Lower bound of the steps of every trajectory that a query's cover admits, between ``least`` and ``lasts``."""
    budget, account = question.budget, question.account
    account.work += question.pair_work
    if over(budget, account):
        return least
    try:
        with account.stage("bound"):
            clauses, asked = question.lowered()
            question.solvers.begin()
            assert question.motion is not None
            rests = add_rests(question.cover, question.motion, clauses)
            account.work += CLAUSE * clauses.count
        while least < lasts and not over(budget, account):
            middle = (least + lasts) // 2
            refused = question.core(clauses, (*asked, int(rests[middle]))) is not None
            least, lasts = (middle + 1, lasts) if refused else (least, middle)
    except (TooLarge, Unexpressible):
        account.work += CLAUSE * CLAUSES
    return least


def add_rests(cover: Cover, motion: Motion, clauses: Clauses) -> Literals:
    """Literals, one per step (steps + 1,), that imply that all agents are at rest from the step on.

    Raises:
        TooLarge: the clauses would exceed their limit.
    """
    rests = clauses.fresh(motion.steps + 1)
    clauses.add(-rests[:-1], rests[1:])
    same = [np.nonzero(_same_place(cover, number)) for number in range(len(cover.roadmaps))]
    for agent, there in enumerate(motion.states):
        source, target = same[int(motion.roadmap_of[agent])]
        step, cell = np.nonzero(there[:-1] != FALSE)
        when, stay = np.nonzero((there[:-1][:, source] != FALSE) & (there[1:][:, target] != FALSE))
        of = np.searchsorted(step * there.shape[1] + cell, when * there.shape[1] + source[stay])
        heads = np.stack([-rests[step], -there[step, cell]], axis=1)
        clauses.add_ragged(heads, there[when + 1, target[stay]], np.bincount(of, minlength=len(step)))
    return rests


def _same_place(cover: Cover, number: int) -> Flags:
    """Return true for each pair of cells, (cells, cells), that may contain one position: equal cells, or a point and a
    cell around it."""
    cells = cover.cells[number]
    point = np.all(cells.low == cells.high, axis=1)
    same: Flags = (cells.distance.low <= TOUCH) & (point[:, None] | point[None, :])
    same[np.diag_indices(len(cells))] = True
    return same
