"""Stage runs: the attempts of a compilation in order, as plan.json records them and the report shows them."""

from __future__ import annotations

import math
from collections.abc import Sequence

from missionc.base.late_dataclass import Record

LAST = "result"
"""Marker for the end after the last attempt."""


class StageRun(Record):
    """One attempt of a stage.

    Args:
        stage: name, as in ``--emit strategy``.
        attempt: description of the attempt; empty if a stage has only one.
        engine: backend of the attempt; empty if there was none.
        work: units of ``backends.work``, to three decimals; 0 if the attempt is not counted.
        outcome: in words.
    """

    stage: str
    attempt: str
    engine: str
    work: float
    outcome: str


def stage_records(runs: Sequence[StageRun]) -> list[dict[str, object]]:
    """One record for each attempt; ``then`` is the stage that followed."""
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
    """Parse attempts from their records.

    Raises:
        ValueError: these are not records of attempts.
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
