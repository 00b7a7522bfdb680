"""Stage runs: attempts of a compilation in order, as plan.json records them and the report displays them."""

from __future__ import annotations

import math
from collections.abc import Sequence

from missionc.base.late_dataclass import Record

LAST = "result"
"""Value of ``then`` in the record of the last attempt."""


class StageRun(Record):
    """One attempt of a stage of the compilation.

    Args:
        stage: name of the stage, as in ``--emit strategy``.
        attempt: description of the attempt; empty if the stage has only one attempt.
        engine: backend of the attempt; empty if no backend ran.
        work: counted work, in units of ``backends.work``, to three decimals; 0 if the attempt is not counted.
        outcome: outcome of the attempt, as a phrase.
    """

    stage: str
    attempt: str
    engine: str
    work: float
    outcome: str


def stage_records(runs: Sequence[StageRun]) -> list[dict[str, object]]:
    """JSON records of the attempts; ``then`` names the stage that followed."""
    following = [*(each.stage for each in runs[1:]), LAST]
    return [
        {
            "stage": run.stage,
            "attempt": run.attempt,
            "engine": run.engine,
            "work": run.work,
            "outcome": run.outcome,
            "then": then,
        }
        for run, then in zip(runs, following, strict=False)
    ]


def read_stage_runs(records: object) -> tuple[StageRun, ...]:
    """Parse attempts from their JSON records.

    Raises:
        ValueError: the records are not records of attempts.
    """
    found = []
    for record in records if isinstance(records, list) else [None]:
        match record:
            case {
                "stage": str(stage),
                "attempt": str(attempt),
                "engine": str(engine),
                "work": int() | float() as work,
                "outcome": str(outcome),
            } if 0 <= work < math.inf:
                found.append(StageRun(stage, attempt, engine, work, outcome))
            case _:
                raise ValueError("no record of an attempt")
    return tuple(found)
