"""Deadlines: an exception interrupts code that runs past its deadline.

A search checks the clock itself and ends with its best result. All other code (a loop in a lowering, a table, a fit)
ignores the clock and is interrupted.
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
"""Default time limit of a compilation, seconds."""

GRACE, SHARE = 0.1, 0.02
"""Time between the deadline of a search and its interruption: constant seconds, and a fraction of the time limit."""

IMPORTING = 0.05
"""Seconds before the interruption is retried if it would hit an import and leave a module half loaded."""

AGAIN = 1.0
"""Seconds before the interruption is repeated, because Python discards an exception that is raised in a destructor."""

SOON = 1e-3


class OutOfTime(BaseException):
    """Error that interrupts work after its deadline. The class is no ``Exception``, so that error handlers do not catch
    it."""


def last_call(deadline: float) -> float:
    """Time at which work with the given ``deadline`` is interrupted; both in seconds on the clock of
    ``time.monotonic``."""
    return deadline + GRACE + SHARE * max(0.0, deadline - time.monotonic())


class interrupted_at:  # noqa: N801 (it is used as a statement)
    """Context manager that raises ``OutOfTime`` in its block at the time ``moment``.

    Contexts can be nested; the earliest time applies. Only the main thread can be interrupted: in other threads, and on
    systems without timers, the context has no effect. Any error that the block raises after the interruption is
    replaced by ``OutOfTime``, because libraries convert exceptions (numpy raises a ``TypeError`` if a comparison is
    interrupted). The parent of a supervised process receives the time too, and kills the process if the interruption
    has no effect.

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
