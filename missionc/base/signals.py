"""Signals: converts Ctrl-C, SIGTERM and SIGHUP to one exception, for cleanup and the right exit status.

Once there is a plan (``hold``), the first one no longer raises: ``asked`` reports it, work on a better plan ends, and
the existing plan is verified and written.

The interpreter delivers a signal between two of its own instructions, and code that suppresses exceptions can lose it.
A thread that receives each signal from the system ends the process if it does not end by itself.
"""

from __future__ import annotations

import os
import select
import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

from missionc.base.deadline import OutOfTime
from missionc.base.supervision import FORWARDED, HANDLED, supervised, tell_held

PATIENCE = 1.5
"""Seconds for cleanup of the process."""


class Stopped(BaseException):
    """Exception for a request to end the process.

    Not an ``Exception``, so that error handlers do not catch it.
    """

    def __init__(self, signal_number: int) -> None:
        super().__init__(signal_number)
        self.status = 128 + signal_number


class _State:
    """State of the process, since its signal handlers are global.

    ``seen`` is a signal's number; ``forwarded`` is added to numbers in a supervised process, and 0 in any other.
    """

    seen = 0
    held = False
    forwarded = 0


_now = _State()


@contextmanager
def stoppable() -> Iterator[None]:
    """Context in which the first signal raises ``Stopped`` (after ``hold``, is recorded).

    A second one ends the process at once.
    """

    def stop(number: int, frame: FrameType | None) -> None:
        number -= _now.forwarded
        if _now.seen:
            os._exit(128 + number)
        _now.seen = number
        if not _now.held:
            raise Stopped(number)

    if threading.current_thread() is not threading.main_thread():
        yield  # only the main thread can install handlers
        return
    _now.seen, _now.held, _now.forwarded = 0, False, FORWARDED if supervised() else 0
    with _ended_by_force(), _lost_in_silence():
        numbers = [number + _now.forwarded for number in HANDLED if not _nobody_hangs_up(number)]
        before = {number: signal.signal(number, stop) for number in numbers}
        try:
            yield
        finally:
            for number, handler in before.items():
                signal.signal(number, handler or signal.SIG_DFL)
            _now.seen, _now.held = 0, False


def _nobody_hangs_up(number: signal.Signals) -> bool:
    """Return whether the process was started to survive the end of its terminal, as with ``nohup``."""
    return number == signal.SIGHUP and signal.getsignal(number) == signal.SIG_IGN


@contextmanager
def _ended_by_force() -> Iterator[None]:
    """Context in which the process ends ``PATIENCE`` after a signal without a plan to save, and at a second one."""
    read_end, write_end = os.pipe()
    os.set_blocking(write_end, False)
    threading.Thread(target=_watch, args=(read_end,), daemon=True).start()
    before = signal.set_wakeup_fd(write_end, warn_on_full_buffer=False)
    try:
        yield
    finally:
        signal.set_wakeup_fd(before)
        os.close(write_end)


def _watch(read_end: int) -> None:
    """End the process if it does not end by itself; return when the pipe is closed."""
    number = _next_signal(read_end)
    if number and (not select.select([read_end], [], [], None if _now.held else PATIENCE)[0] or _next_signal(read_end)):
        os._exit(128 + number)
    os.close(read_end)


def _next_signal(read_end: int) -> int:
    """Number of the next signal that is handled here; 0 if there will be none."""
    while number := os.read(read_end, 1):
        if number[0] - _now.forwarded in HANDLED:
            return number[0] - _now.forwarded
    return 0


@contextmanager
def _lost_in_silence() -> Iterator[None]:
    """Context in which a suppressed interruption, as in a destructor, is not reported, since it is repeated."""
    before = sys.unraisablehook

    def report(unraisable: sys.UnraisableHookArgs) -> None:
        if unraisable.exc_type not in (Stopped, OutOfTime):
            before(unraisable)

    sys.unraisablehook = report
    try:
        yield
    finally:
        sys.unraisablehook = before


def leave_signals() -> None:
    """Leave signals to the parent, in a forked child."""
    signal.set_wakeup_fd(-1)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGHUP, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)


def defer_stop() -> None:
    """Mark that there is a plan to save, from now until the end of ``stoppable``."""
    _now.held = True
    tell_held(True)


def stop_requested() -> bool:
    """Return whether the process should end and save its plan."""
    return bool(_now.seen) and _now.held


def release_stop() -> None:
    """Mark that the plan is saved, and raise the ``Stopped`` of a signal that came in the meantime, if any."""
    _now.held = False
    tell_held(False)
    reraise_stop()


def reraise_stop() -> None:
    """Raise an earlier ``Stopped`` again, if any: a library may have replaced it with its own error."""
    if _now.seen and not _now.held:
        raise Stopped(_now.seen)


def end_with_parent() -> None:
    """Make this child of ``multiprocessing`` end at once when its parent has ended."""
    import multiprocessing  # most processes have no children

    parent = multiprocessing.parent_process()
    assert parent is not None

    def wait() -> None:
        parent.join()
        os._exit(1)

    threading.Thread(target=wait, daemon=True).start()
