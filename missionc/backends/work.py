"""Work, counted: what a search does, in units that are the same on any machine and under any load.

A unit is about what one core does in a second. Limits that choose between strategies are counted in units, so that one
seed gives one plan; seconds are only for the time limit. The costs below were fitted to the seconds of the stages of
some missions of the field corpus: most are right within a factor of two, which is enough to take turns.
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
"""Units of a clause: to build it, and to hand it to a solver."""

QUESTION = 1 / 300_000
"""Units of a question to a SAT solver, for each clause it has: it is read, and simplified."""

CLAUSE_CONFLICT = 1 / 500_000_000
"""Units of a conflict of a SAT solver, for each clause it has: it propagates through more where there are more."""

MOVE_STEP = 1 / 2_000_000
"""Units of a move of a roadmap at one step, in the search for one agent's way."""

SKETCH, SKETCHED = 0.05, 1e-3
"""Units of a schedule, its key frames and their sketch, and for each agent and step of it."""

ITERATION, ITERATED = 1e-2, 3e-5
"""Units of an iteration of a polish, and for each agent and step of the motion."""

SEEN = 1e-2
"""Units of an iteration of a polish, for each shape that lines of sight go past: of every link the place nearest to it
is looked for."""

SEARCH = 10
"""A search agent by agent takes so many times the units of a sketch."""


def run_to_end(turns: Turns, budget: Budget, meanwhile: Iterable[tuple[float, Another]] = ()) -> Outcome:
    """The outcome of all turns; that nothing was found, where the budget's work is done before.

    Args:
        meanwhile: after so many units, who is asked for another outcome: no turn is taken after one.
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
    """Units of the sketch of a motion of so many agents times steps."""
    return SKETCH + SKETCHED * agent_steps


def polish_work(mission: Mission, iterations: int) -> float:
    """Units of so many iterations of a polish of a joint motion."""
    seen = sum(len(graph.shapes) for graph in mission.graphs if isinstance(graph, Sight))
    return iterations * (ITERATION + ITERATED * len(mission.agents) * mission.steps + SEEN * seen)


def question_work(clauses: int, conflicts: int) -> float:
    """Units of a question about so many clauses that met so many conflicts."""
    return clauses * (QUESTION + CLAUSE_CONFLICT * conflicts)


def conflicts_of(work: float, clauses: int) -> int | None:
    """The conflicts that so many units allow with so many clauses; None for as many as it takes."""
    return None if math.isinf(work) else max(1, round(work / (CLAUSE_CONFLICT * max(1, clauses))))
