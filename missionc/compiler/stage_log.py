"""Stage log: the attempts of a compilation, recorded by the stages of ``strategy`` as they end."""

from __future__ import annotations

from dataclasses import field, replace

from missionc.backends.api import Outcome, Planned
from missionc.base.late_dataclass import Record
from missionc.base.stage_runs import StageRun


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
