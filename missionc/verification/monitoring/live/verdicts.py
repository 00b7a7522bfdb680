"""Verdicts on a mission that is being flown."""

from __future__ import annotations

from enum import Enum

from missionc.base.late_dataclass import Record


class LiveVerdict(Enum):
    """What can be said of a goal by now; the first two are for good."""

    SATISFIED = "satisfied"
    VIOLATED = "violated"
    OPEN = "open"


class Standing(Record):
    """How one goal stands after a step.

    Args:
        verdict: ``SATISFIED`` or ``VIOLATED`` where every continuation within the agents' top speeds makes it so.
        least, most: its robustness is between these, whatever the continuation: metres for everything spatial. Both are
            the robustness itself where all that it hangs on has been seen.
        at_risk: it is open, and where every agent keeps its present velocity for one more step, no continuation
            within the top speeds satisfies it.
        decided_by: the step by which it is decided at the latest.
    """

    name: str
    verdict: LiveVerdict
    least: float
    most: float
    at_risk: bool
    decided_by: int
