"""Verdicts on a mission in flight."""

from __future__ import annotations

from enum import Enum

from missionc.base.late_dataclass import Record


class LiveVerdict(Enum):
    """Present verdict on a goal; ``SATISFIED`` and ``VIOLATED`` are final."""

    SATISFIED = "satisfied"
    VIOLATED = "violated"
    OPEN = "open"


class Standing(Record):
    """Verdict on one goal after a step, with bounds on its robustness.

    Args:
        verdict: ``SATISFIED`` or ``VIOLATED`` if this holds for every continuation within top speeds.
        least, most: bounds on its robustness over all continuations, metres for spatial formulas. They are equal if the
            robustness is final.
        at_risk: it is open, and if every agent keeps its present velocity for one more step, no continuation within the
            top speeds satisfies it.
        decided_by: latest step at which it is decided.
    """

    name: str
    verdict: LiveVerdict
    least: float
    most: float
    at_risk: bool
    decided_by: int
