"""The result of one run of a sweep: its outcome, and a value for every column that it has one for."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TypeAlias

ERROR = "error"
"""The outcome of a run that the compiler did not bring to an end: a defect, or a process that did not last."""
OUTCOMES = ("planned", "impossible", "undecided", "unverified", "refused", ERROR)
"""All there are; ``refused`` is input that is wrong."""

Value: TypeAlias = str | int | float | None


@dataclass(frozen=True, slots=True)
class RunResult:
    """What came of a run.

    Args:
        outcome: one of ``OUTCOMES``.
        values: everything else that a table has of it, by the name of the column; None of what there is none of.
        sizes: of what was solved, by name.
        files: of its plan, where they are to be kept.
    """

    outcome: str
    values: Mapping[str, Value]
    sizes: Mapping[str, int] = field(default_factory=dict)
    files: tuple[tuple[str, bytes], ...] = ()
