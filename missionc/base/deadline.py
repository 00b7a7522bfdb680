"""Deadlines: work that runs past one is interrupted by an exception, wherever it is.

A search looks at the clock itself and ends with the best that it has. Everything else (a loop of a lowering, a table,
a fit) knows nothing of time; it is interrupted.
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
"""Time limit of a compilation."""

GRACE, SHARE = 0.1, 0.02
"""Seconds after its deadline, and a share of the time it had, that a search has to end by itself."""

IMPORTING = 0.05
"""Seconds until the next try where the interruption would meet an import: half a module would stay behind."""

AGAIN = 1.0
"""Seconds after which the interruption comes once more: one that meets a destructor is lost."""

SOON = 1e-3


class OutOfTime(BaseException):
    """The deadline is over. It is no ``Exception``: nothing that mends errors may catch it."""


def last_call(deadline: float) -> float:
    """When work is interrupted that was to end by itself at ``deadline``, both on the clock of ``time.monotonic``."""
    return deadline + GRACE + SHARE * max(0.0, deadline - time.monotonic())


class interrupted_at:  # noqa: N801 (it is used as a statement)
    """``with interrupted_at(moment):`` raises ``OutOfTime`` within once ``moment`` has come.

    It may stand within another: the earlier one comes first. Only the main thread can be interrupted; in any other,
    and where the system has no timers, nothing is done. An error that comes out after the interruption is taken for
    it: numpy, where it is interrupted while it compares, raises a ``TypeError`` instead. The parent of a supervised
    process learns of the moment too, and ends the process if nothing within it can.

    Args:
        moment: on the clock of ``time.monotonic``, seconds.
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
