"""Plan requests: one value that the command line or Python passes down to the backend.

Stage log: the attempts of a compilation, recorded by the stages of ``strategy`` as they end.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import field, replace

from missionc.backends.api import Backend, Budget, Outcome, Planned
from missionc.backends.options import Options
from missionc.base.continuous_time import ContinuousTime
from missionc.base.late_dataclass import Record
from missionc.base.trace import StageRun
from missionc.base.units import Seconds
from missionc.compiler.checkpoints import Checkpoints
from missionc.compiler.incumbent import discard
from missionc.compiler.results import Compiled
from missionc.ir.kernel.nodes import Kernel


class StageLog(Record):
    """Attempts of a compilation, in the order in which they ended.

    Args:
        runs: attempts so far, one list for all stages of a compilation.
        stage: stage of the recorded searches.
        attempt: attempt of that stage.
    """

    runs: list[StageRun] = field(default_factory=list)
    stage: str = "search"
    attempt: str = ""

    def within(self, stage: str, attempt: str) -> StageLog:
        """The log for searches that belong to one attempt of another stage."""
        return replace(self, stage=stage, attempt=attempt)

    def add(self, stage: str, engine: str, work: float, outcome: str, attempt: str = "") -> None:
        """Record an attempt with its stage, engine, work in units, and outcome."""
        self.runs.append(StageRun(stage, attempt, engine, round(work, 3), outcome))

    def searched(self, engine: str, outcome: Outcome, attempt: str = "") -> None:
        """Record a search, with a row for each engine of a portfolio that ran."""
        self.runs.extend(self._rows(engine, outcome, attempt))

    def so_far(self, engine: str, planned: Planned) -> tuple[StageRun, ...]:
        """Recorded attempts, followed by the running search of a plan that is still being improved."""
        return (*self.runs, *self._rows(engine, planned, ""))

    def _rows(self, engine: str, outcome: Outcome, attempt: str) -> list[StageRun]:
        report = outcome.report
        tried = ", ".join(filter(None, (self.attempt, attempt)))
        says = "plan found" if isinstance(outcome, Planned) else outcome.statement
        says += f", stopped early ({report.cut_short.value})" if report.cut_short else ""
        of_each = [(each.engine, each.work, each.says) for each in report.tried if each.turns]
        return [
            StageRun(self.stage, tried, name, round(work, 3), what)
            for name, work, what in of_each or [(report.engine or engine, report.work, says)]
        ]


NO_EXPLANATION = Seconds(0.0)


class PlanRequest(Record, eq=False):
    """Request for a plan of a checked mission.

    Args:
        budget: time, memory, work and seed, and the listeners of the run.
        checkpoints: checkpoint of the run, and of the resumed one.
        exports: names of additional flight formats; unsuitable ones are reported.
        continuous_time: whether continuous-time satisfaction is wanted or required.
        explain_limit: seconds for ``Compiled.explained``; 0 for none.
        alternatives: number of different plans; there may be fewer.
        secure: receives each verified plan as soon as it exists, each better than the previous one. The last one is the
            answer, for any result of later stages.
        kernel: stronger kernel to use instead of the mission's own.
        backend: backend to use instead of the chosen engines.
        speed_fraction: fraction of the vehicles' top speeds; below 1, an upper limit for plans.
        log: receives each attempt when it ends.

    Raises:
        ValueError: ``alternatives`` and ``options.stretch`` exclude each other.
    """

    budget: Budget
    options: Options = field(default_factory=Options)
    checkpoints: Checkpoints = field(default_factory=Checkpoints)
    exports: tuple[str, ...] = ()
    continuous_time: ContinuousTime = ContinuousTime.WANTED
    explain_limit: Seconds = NO_EXPLANATION
    alternatives: int = 1
    secure: Callable[[Compiled], object] = discard
    kernel: Kernel | None = None
    backend: Backend | None = None
    speed_fraction: float = 1.0
    log: StageLog = field(default_factory=StageLog)

    def __post_init__(self) -> None:
        if self.alternatives > 1 and self.options.stretch != 1:
            raise ValueError("alternatives have the duration of the mission, and cannot be scaled in time")

    @property
    def further(self) -> PlanRequest:
        """The request for another plan, without checkpoints, explanation and ``secure``."""
        return replace(self, checkpoints=Checkpoints(), explain_limit=NO_EXPLANATION, secure=discard)
