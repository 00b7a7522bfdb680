"""The least duration that covers prove: how long some agent is under way in every motion that satisfies the mission.

    in   Mission, Kernel, a number of steps that every plan takes, and one that some plan takes
    out  a number of steps that every plan takes, at least the one that was given

Covers are asked, coarse ones first, whether everybody may be still from some step on. An agent that is still stays in
its cell, so that a refusal is one of every motion that is over by then. What lies between is halved.
"""

from __future__ import annotations

import numpy as np

from missionc.backends.api import Budget
from missionc.backends.cover.cover import TOUCH, Cover, build_cover
from missionc.backends.cover.motion_caps import motion_caps
from missionc.backends.cover.question import CLAUSES, Question
from missionc.backends.cover.refute import CELLS, over, questions, squared_work
from missionc.backends.cover.relax_kernel import relaxed
from missionc.backends.run_account import Account
from missionc.backends.smt.encode.clauses import FALSE, Clauses, Literals, TooLarge
from missionc.backends.smt.encode.lower_motion import Motion
from missionc.backends.smt.roadmap.labels import Unexpressible
from missionc.backends.smt.sat.solve import Solvers, for_refusals
from missionc.backends.work import CLAUSE
from missionc.base.trace import Flags
from missionc.ir import Mission
from missionc.kernel.nodes import Kernel


def least_duration(
    mission: Mission, kernel: Kernel, least: int, lasts: int, budget: Budget, account: Account, solver: str = "auto"
) -> int:
    """The steps that every plan takes, as far as covers show within the budget's work, which is of this alone.

    Args:
        least: a number of steps that every plan takes.
        lasts: what a plan takes.
    """
    weaker, caps = relaxed(mission, kernel), motion_caps(mission, kernel)
    everybody = frozenset(range(len(mission.agents)))
    with Solvers(for_refusals(solver), budget.memory_bytes, budget.seed, budget.deadline, presolves=False) as solvers:
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
    """The steps that every answer to a question takes, as far as its cover shows."""
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
    """For each step, (steps + 1,), a literal that implies that everybody is still from it on.

    Raises:
        TooLarge: the clauses would pass their limit.
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
    """Which cells, (cells, cells), may be those of one place: each itself, and a point with the cells round it."""
    cells = cover.cells[number]
    point = np.all(cells.low == cells.high, axis=1)
    same: Flags = (cells.distance.low <= TOUCH) & (point[:, None] | point[None, :])
    same[np.diag_indices(len(cells))] = True
    return same
