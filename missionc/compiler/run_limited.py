"""Execution of a function within the limits of a compilation, which ends with its result or at the first limit.

in   the time of interruption, the work
out  its result, or Ended
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

from missionc.backends.api import Reason
from missionc.base.deadline import OutOfTime, interrupted_at
from missionc.base.late_dataclass import Record
from missionc.base.memory import exhausted

Result = TypeVar("Result")


class Ended(Record):
    """Limit that ended a computation; ``detail`` has additional information, if any."""

    reason: Reason
    detail: str = ""

    def during(self, activity: str) -> str:
        """A sentence that states the limit and the activity that it ended."""
        if self.reason is Reason.TIME:
            return f"time limit reached while {activity}"
        return f"memory limit reached while {activity}{f': {self.detail}' if self.detail else ''}"


def within(moment: float, work: Callable[[], Result]) -> Result | Ended:
    """Result of the computation ``work``, or the limit that ended it.

    Args:
        moment: time of interruption, on the clock of ``time.monotonic``.
    """
    try:
        with interrupted_at(moment):
            return work()
    except OutOfTime:
        return Ended(Reason.TIME)
    except Exception as error:
        if not exhausted(error):
            raise
        return Ended(Reason.MEMORY, str(error))
