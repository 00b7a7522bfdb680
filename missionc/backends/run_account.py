"""Account of a search: seconds by stage, sizes and notes.

Counted work: the cost of a search in units that are equal on any machine and under any load.

A unit is about one second of one core. Limits between strategies are in units, so that one seed gives one plan; seconds
are used only for the time limit. The costs were fitted to the seconds of stages of some missions of the field corpus.
Most are accurate within a factor of two, which is enough for turns.
"""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from missionc.backends.api import CutShort, NotFound, Outcome, Reason, Report, Turns
from missionc.base.signals import stop_requested
from missionc.base.trace import Solved
from missionc.base.units import Seconds
from missionc.ir import Sight

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from missionc.backends.api import Budget
    from missionc.ir import Mission

    Another = Callable[[float], Outcome | None]


@dataclass(slots=True)
class Account:
    seconds: dict[str, float] = field(default_factory=dict)
    sizes: dict[str, int] = field(default_factory=dict)
    texts: dict[str, str] = field(default_factory=dict)
    files: dict[str, bytes] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    cut_short: CutShort | None = None
    work: float = 0.0
    """Work done, in units of ``work``."""
    solved: tuple[Solved, ...] = ()

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Context whose duration is added to the seconds of the stage ``name``, also after an exception."""
        begin = time.perf_counter()
        try:
            yield
        finally:
            self.seconds[name] = self.seconds.get(name, 0.0) + time.perf_counter() - begin

    def cut(self) -> None:
        """Record that the best plan so far is returned because the time limit was reached or a signal arrived."""
        self.cut_short = CutShort.SIGNAL if stop_requested() else CutShort.TIME
        self.notes.append(self.cut_short.note)

    def add(self, other: Account) -> None:
        """Add another account: seconds, work and iterations are summed, other sizes are replaced."""
        for stage, spent in other.seconds.items():
            self.seconds[stage] = self.seconds.get(stage, 0.0) + spent
        iterations = self.sizes.get("iterations", 0) + other.sizes.get("iterations", 0)
        self.sizes |= other.sizes | {"iterations": iterations}
        self.notes.extend(other.notes)
        self.work += other.work

    def spend(self, report: Report) -> None:
        """Add the seconds and the work of another search's report, without its notes."""
        for stage, spent in report.seconds:
            self.seconds[stage] = self.seconds.get(stage, 0.0) + spent
        self.work += report.work

    def report(self) -> Report:
        return Report(
            seconds=tuple((stage, Seconds(spent)) for stage, spent in self.seconds.items()),
            sizes=tuple(self.sizes.items()),
            texts=tuple(self.texts.items()),
            files=tuple(self.files.items()),
            notes=tuple(self.notes),
            cut_short=self.cut_short,
            work=self.work,
            solved=self.solved,
        )


CLAUSE = 1 / 400_000
"""Work units per clause: to build the clause, and to pass it to a solver."""

QUESTION = 1 / 300_000
"""Work units per clause of a SAT query: reading and simplification."""

CLAUSE_CONFLICT = 1 / 500_000_000
"""Work units per conflict and clause of a SAT query, for propagation."""

MOVE_STEP = 1 / 2_000_000
"""Work units per roadmap move and step in single-agent search."""

SKETCH, SKETCHED = 0.05, 1e-3
"""Work units of a schedule with its waypoints and initial trajectory: a constant, and units per agent and step."""

ITERATION, ITERATED = 1e-2, 3e-5
"""Work units of one optimiser iteration: a constant, and units per agent and step."""

SEEN = 1e-2
"""Work units of one optimiser iteration for each shape near lines of sight (nearest points of all links)."""

SEARCH = 10
"""Work of a search that plans agents one by one, as a multiple of the work of an initial trajectory."""


def run_to_end(turns: Turns, budget: Budget, meanwhile: Iterable[tuple[float, Another]] = ()) -> Outcome:
    """Outcome of a search in turns; ``NotFound`` if the budget's work ends before.

    Args:
        meanwhile: pairs of work units and a function that is called when they are done; an outcome that the function
            returns ends the search.
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
    """Work units of an initial trajectory with ``agent_steps`` (number of agents times steps)."""
    return SKETCH + SKETCHED * agent_steps


def polish_work(mission: Mission, iterations: int) -> float:
    """Work units of ``iterations`` optimiser iterations on a joint trajectory."""
    seen = sum(len(graph.shapes) for graph in mission.graphs if isinstance(graph, Sight))
    return iterations * (ITERATION + ITERATED * len(mission.agents) * mission.steps + SEEN * seen)


def question_work(clauses: int, conflicts: int) -> float:
    """Work units of a SAT query with these numbers of clauses and conflicts."""
    return clauses * (QUESTION + CLAUSE_CONFLICT * conflicts)


def conflicts_of(work: float, clauses: int) -> int | None:
    """Number of conflicts that ``work`` units allow for this number of clauses; None for no limit."""
    return None if math.isinf(work) else max(1, round(work / (CLAUSE_CONFLICT * max(1, clauses))))
