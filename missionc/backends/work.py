"""Counted work: the cost of a search in units that are equal on any machine and under any load.

A unit is about one second of one core. Limits between strategies are in units, so that one seed gives one plan; seconds
are only for the time limit. The costs were fitted to the seconds of stages of some missions of the field corpus. Most
are right within a factor of two, which is enough for turns.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from missionc.backends.api import NotFound, Outcome, Reason, Report, Turns
from missionc.ir import Sight

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from missionc.backends.api import Budget
    from missionc.ir import Mission

    Another = Callable[[float], Outcome | None]

CLAUSE = 1 / 400_000
"""Units per clause: to build it, and to pass it to a solver."""

QUESTION = 1 / 300_000
"""Units per clause of a question to a SAT solver: reading and simplification."""

CLAUSE_CONFLICT = 1 / 500_000_000
"""Units of a conflict of a SAT solver per clause, for propagation."""

MOVE_STEP = 1 / 2_000_000
"""Units of a roadmap's move at one step in single-agent search."""

SKETCH, SKETCHED = 0.05, 1e-3
"""Units of a schedule with its key frames and sketch, and units per agent and step."""

ITERATION, ITERATED = 1e-2, 3e-5
"""Units of a polish iteration, and units per agent and step."""

SEEN = 1e-2
"""Units of a polish iteration for each shape near lines of sight, for the nearest point of every link."""

SEARCH = 10
"""Work of a search agent by agent, as a multiple of a sketch."""


def run_to_end(turns: Turns, budget: Budget, meanwhile: Iterable[tuple[float, Another]] = ()) -> Outcome:
    """Outcome of all turns; not found if the budget's work ends before.

    Args:
        meanwhile: pairs of work units and a function for another outcome then, which ends the turns.
    """
    try:
        done = next(turns)
        for units, another in meanwhile:
            while done < min(units, budget.work):
                done = turns.send(min(units, budget.work))
            if done < budget.work and (instead := another(done)) is not None:
                return instead
        while done < budget.work:
            done = turns.send(budget.work)
    except StopIteration as ended:
        outcome: Outcome = ended.value
        return outcome
    finally:
        turns.close()
    return NotFound(Reason.SOLVER, f"no plan within {budget.work:g} units of work", Report(work=done))


def sketch_work(agent_steps: int) -> float:
    """Units of the sketch of a motion with ``agent_steps`` agents times steps."""
    return SKETCH + SKETCHED * agent_steps


def polish_work(mission: Mission, iterations: int) -> float:
    """Units of ``iterations`` polish iterations of a joint motion."""
    seen = sum(len(graph.shapes) for graph in mission.graphs if isinstance(graph, Sight))
    return iterations * (ITERATION + ITERATED * len(mission.agents) * mission.steps + SEEN * seen)


def question_work(clauses: int, conflicts: int) -> float:
    """Units of a question with these numbers of clauses and conflicts."""
    return clauses * (QUESTION + CLAUSE_CONFLICT * conflicts)


def conflicts_of(work: float, clauses: int) -> int | None:
    """Conflicts that ``work`` units allow for this number of clauses; None for no limit."""
    return None if math.isinf(work) else max(1, round(work / (CLAUSE_CONFLICT * max(1, clauses))))
