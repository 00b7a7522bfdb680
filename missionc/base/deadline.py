"""Deadlines: an exception interrupts work that exceeds one, anywhere in the code.

A search checks the clock itself and ends with its best result. All other code (a loop in a lowering, a table, a fit)
ignores time and is interrupted.
"""

from __future__ import annotations

import math
import signal
import threading
import time
from types import FrameType, TracebackType

from missionc.base.supervision import tell_deadline
from missionc.base.units import Seconds

DEFAULT_TIME_LIMIT = Seconds(600.0)
"""Default time limit of a compilation."""

GRACE, SHARE = 0.1, 0.02
"""Extra time of a search after its deadline: in seconds, and as a ratio of its total time."""

IMPORTING = 0.05
"""Delay in seconds before the next attempt if the interruption would hit an import and leave half a module."""

AGAIN = 1.0
"""Seconds until the interruption is repeated, since one in a destructor is lost."""

SOON = 1e-3


class OutOfTime(BaseException):
    """Error after the deadline. Not an ``Exception``, so that error handlers do not catch it."""


def last_call(deadline: float) -> float:
    """Time of the interruption of work that should end at ``deadline``, both on the clock of ``time.monotonic``."""
    return deadline + GRACE + SHARE * max(0.0, deadline - time.monotonic())


class interrupted_at:  # noqa: N801 (it is used as a statement)
    """Context manager that raises ``OutOfTime`` inside it at ``moment``.

    Contexts can be nested: the earlier moment comes first. Only the main thread can be interrupted; in other threads,
    and on systems without timers, it has no effect. Any error after the interruption counts as the interruption: numpy
    raises a ``TypeError`` if it is interrupted in a comparison. The parent of a supervised process learns of the moment
    too, and ends the process if nothing within it can.

    Args:
        moment: time on the clock of ``time.monotonic``, seconds.
    """

    def __init__(self, moment: float) -> None:
        self.moment = moment
        self.able = hasattr(signal, "setitimer") and threading.current_thread() is threading.main_thread()
        self.over = self.raised = False

    def __enter__(self) -> None:
        if not self.able:
            return
        self.begin = time.perf_counter()
        self.outer = signal.getitimer(signal.ITIMER_REAL)
        self.handler = signal.getsignal(signal.SIGALRM)
        left = self.moment - time.monotonic()
        if self.outer[0] and self.outer[0] < left:
            self.able = False
            return
        tell_deadline(self.moment)
        signal.signal(signal.SIGALRM, self._interrupt)
        signal.setitimer(signal.ITIMER_REAL, max(SOON, left), AGAIN)

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self.over = True
        if not self.able:
            return
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, self.handler)
        left, interval = self.outer
        tell_deadline(time.monotonic() + left if left else math.inf)
        if left:
            signal.setitimer(signal.ITIMER_REAL, max(SOON, left - (time.perf_counter() - self.begin)), interval)
        if self.raised and isinstance(error, Exception):
            raise OutOfTime from error

    def _interrupt(self, number: int, frame: FrameType | None) -> None:
        if self.over:
            return
        if _importing(frame):
            signal.setitimer(signal.ITIMER_REAL, IMPORTING, AGAIN)
            return
        self.raised = True
        raise OutOfTime


def _importing(frame: FrameType | None) -> bool:
    while frame is not None:
        if frame.f_code.co_filename == "<frozen importlib._bootstrap>":
            return True
        frame = frame.f_back
    return False
