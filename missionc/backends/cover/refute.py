"""Refutation on covers, coarse ones first: whether no motion at all satisfies the requirements, and which ones.

    in   Mission, Kernel
    out  Refused, Admitted or Open

On each cover everybody is asked alone first, then pairs, then the team. What is unsatisfiable there is so of every
motion; what a cover admits may still be impossible.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import combinations, pairwise
from typing import TypeAlias

from missionc.backends.api import Budget
from missionc.backends.cover.cover import Cover, build_cover
from missionc.backends.cover.motion_caps import Caps, motion_caps
from missionc.backends.cover.question import Question
from missionc.backends.cover.relax_kernel import relaxed
from missionc.backends.run_account import Account
from missionc.backends.smt.prioritized.requirement_parts import named_agents, throughout
from missionc.backends.smt.roadmap_answers import cannot_hold
from missionc.backends.smt.sat.solve import Solvers, for_refusals
from missionc.ir import Mission
from missionc.kernel.conjuncts import conjuncts
from missionc.kernel.nodes import All, At, Goal, Kernel, Node

CELLS = 8, 40, 160, 480
"""The cells of each cover, for each kind of agent."""

MOST_PAIRS = 10
"""Pairs of agents up to which each is asked by itself."""

SQUARED = 1 / 10_000_000
"""Units of work of a pair of cells: how far apart they are, and whether a chain leads from one to the other."""


@dataclass(frozen=True, slots=True)
class Refused:
    """No motion of the agents satisfies these requirements at its steps; with none, they cannot move as they must.

    ``smallest``: asked the same of every proper subset of them, the cover admits it. ``question`` is what was refused.
    """

    conflict: tuple[str, ...]
    cells: int
    smallest: bool
    question: Question

    def __str__(self) -> str:
        return f"on a cover of {self.cells} cells, which holds every motion there is, {cannot_hold(self.conflict)}"


@dataclass(frozen=True, slots=True)
class Admitted:
    """A cover of so many cells holds what would be a plan if cells were places: of plans that says nothing."""

    cells: int

    def __str__(self) -> str:
        return f"a cover of {self.cells} cells admits the mission: motions off these roadmaps may satisfy it"


@dataclass(frozen=True, slots=True)
class Open:
    """No cover was asked about the whole mission within the budget, and none refused a part of it."""

    def __str__(self) -> str:
        return "motions off these roadmaps may satisfy it: no cover of the mission was decided"


Answer: TypeAlias = Refused | Admitted | Open


def refute(mission: Mission, kernel: Kernel, budget: Budget, account: Account, solver: str = "auto") -> Answer:
    """What covers show of the requirements within the budget's work, which is of this alone."""
    with Solvers(for_refusals(solver), budget.memory_bytes, budget.seed, budget.deadline, presolves=False) as solvers:
        return _refuted(mission, kernel, budget, account, solvers)


def _refuted(mission: Mission, kernel: Kernel, budget: Budget, account: Account, solvers: Solvers) -> Answer:
    weaker = relaxed(mission, kernel)
    everybody = frozenset(range(len(mission.agents)))
    caps = motion_caps(mission, kernel)
    answer: Answer = Open()
    took = 0.0
    for before, count in pairwise((CELLS[0], *CELLS)):
        if over(budget, account) or time.monotonic() + took * (count / before) ** 2 > budget.deadline:
            break  # it is done, or the next cover would come too late
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
                return Refused(names, cover.states, smallest, question)
            if question.admitted and (together == everybody or len(everybody) == 1):
                answer = Admitted(cover.states)
    return answer


def squared_work(cover: Cover) -> float:
    """Units of work that it takes to build a cover."""
    return SQUARED * sum(len(cells) ** 2 for cells in cover.cells)


def over(budget: Budget, account: Account) -> bool:
    """Whether the budget's work is done, or its time is up."""
    return account.work >= budget.work or time.monotonic() >= budget.deadline


def questions(
    mission: Mission, kernel: Kernel, everybody: frozenset[int]
) -> Iterator[tuple[frozenset[int], tuple[Goal, ...]]]:
    """Who is asked to keep apart, and what is asked: of each alone, of each two of a few, of all.

    Two of whom one has nowhere to be are asked nothing by themselves.
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
    """What the requirements ask of so many of these agents at most by name, whatever others do."""
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
