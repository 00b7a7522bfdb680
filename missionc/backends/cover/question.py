"""A question to a cover: whether its cells hold a motion of some agents that may satisfy what is asked of them.

in   Caps, Cover, the requirements asked, who must keep apart
out  the requirements that a refusal rests on; or that the cover admits them all; or neither, where it is too large
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np

from missionc.backends.api import Budget
from missionc.backends.cover.cover import Cover
from missionc.backends.cover.crowding import add_crowding
from missionc.backends.cover.keep_apart import add_separation
from missionc.backends.cover.may_labels import MayLabels
from missionc.backends.cover.may_turn import add_turns
from missionc.backends.cover.may_visit import add_visits
from missionc.backends.cover.motion_caps import Caps
from missionc.backends.run_account import Account
from missionc.backends.smt.encode.clauses import Clauses, TooLarge
from missionc.backends.smt.encode.lower import lower
from missionc.backends.smt.encode.lower_motion import Motion, add_moves, all_ways, lower_motion
from missionc.backends.smt.encode.occupancy import Occupancy
from missionc.backends.smt.roadmap.labels import Unexpressible
from missionc.backends.smt.sat.solve import Satisfiable, Solvers, Unsatisfiable
from missionc.backends.work import CLAUSE, conflicts_of, question_work
from missionc.base.trace import Flags
from missionc.kernel.nodes import Goal

CLAUSES = 600_000
"""Clauses of a question, beyond which it is not asked."""

PAIRED = 1 / 2_500_000
"""Units of work of a pair of cells that two agents may be in together at a step."""

CONFLICTS = 20_000
"""Conflicts of a question, after which it is left open, or earlier where its work is done."""


@dataclass(slots=True, eq=False)
class Question:
    """One question.

    Args:
        together: who must keep apart and is asked; where it is nobody, everybody is asked, each as if alone.
        solvers: those that are asked; what they knew before is forgotten.
        admitted: whether the cover holds an answer, once it was asked.
        smallest: whether it holds one of every proper subset of what a refusal rests on.
        motion: the variables of who is where, once it was lowered.
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
        """Units of work that it takes to say who may be where together."""
        kinds = zip(self.cover.cells, self.cover.roadmaps, strict=True)
        count = {agent: len(cells) for cells, roadmap in kinds for agent in roadmap.agents}
        pairs = sum(count[one] * count[other] for one, other in combinations(self.together, 2))
        return PAIRED * pairs * (self.caps.mission.steps + 1)

    @property
    def cast(self) -> frozenset[int]:
        """Those who are asked."""
        return self.together or frozenset(range(len(self.caps.mission.agents)))

    @property
    def ways(self) -> tuple[Flags, ...]:
        """For each agent where it can be, (steps + 1, cells)."""
        return all_ways(self.cover.roadmaps, self.cover.never)

    @property
    def labels(self) -> MayLabels:
        """What may hold in the cover's cells, and what may fail."""
        return MayLabels(self.caps.mission, self.cover.roadmaps, self.cover.cells)

    def refused(self) -> frozenset[str] | None:
        """The requirements that a refusal rests on; None where there is none, or it would take too much to know."""
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
        """The clauses, and a literal to assume for each requirement.

        Raises:
            TooLarge: there would be more than may be asked.
            Unexpressible: cells do not decide what is asked.
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
        """The literals among those asked for that a refusal rests on; None where there is none."""
        with self.account.stage("cover"):
            before, left = self.solvers.conflicts, self.budget.work - self.account.work
            self.solvers.add(clauses)
            allowed = conflicts_of(max(left, 0.0), clauses.count)
            answer = self.solvers.solve(asked, conflicts=min(CONFLICTS, allowed or CONFLICTS))
            self.account.work += question_work(clauses.count, self.solvers.conflicts - before)
        self.admitted = self.admitted or isinstance(answer, Satisfiable)
        return answer.core if isinstance(answer, Unsatisfiable) else None


def _add_strides(cover: Cover, motion: Motion, cast: frozenset[int], clauses: Clauses) -> None:
    """Adds that each agent gets no further in several steps than it may."""
    for roadmap, strides in zip(cover.roadmaps, cover.strides, strict=True):
        for steps, may in strides:
            source, target = np.nonzero(may)
            for agent in cast.intersection(roadmap.agents):
                here, there = motion.states[agent][:-steps], motion.states[agent][steps:]
                ways = motion.ways[agent]
                live = ways[:-steps][:, source] & ways[steps:][:, target]
                add_moves(clauses, here, there, live, source, target)
