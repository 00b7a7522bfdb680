"""Signals: Ctrl-C, SIGTERM and SIGHUP raise one exception, for cleanup and the right exit status.

After ``defer_stop`` (there is a plan to save), the first signal does not raise: ``stop_requested`` returns true, the
search for a better plan ends, and the existing plan is verified and written.

Python delivers a signal between two of its own instructions, and code that suppresses exceptions can lose it. A thread
that receives each signal from the operating system ends the process if the process does not end by itself.
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
"""Seconds that the process has for cleanup after a signal."""


class Stopped(BaseException):
    """Exception for a signal that requests the end of the process; no ``Exception``, so that error handlers do not
    catch it."""

    def __init__(self, signal_number: int) -> None:
        super().__init__(signal_number)
        self.status = 128 + signal_number


class _State:
    """State of signal handling of this process; global, as signal handlers are.

    ``seen`` is the number of the first signal, 0 before it. ``held`` is true while there is a plan to save.
    ``forwarded`` is the offset of signal numbers in a supervised process, and 0 in any other.
    """

    seen = 0
    held = False
    forwarded = 0


_now = _State()


@contextmanager
def stoppable() -> Iterator[None]:
    """Context in which the first signal raises ``Stopped``, or is only recorded while there is a plan to save.

    A second signal ends the process at once.
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
    """Return true if SIGHUP is ignored in this process because it was started to survive its terminal, as by
    ``nohup``."""
    return number == signal.SIGHUP and signal.getsignal(number) == signal.SIG_IGN


@contextmanager
def _ended_by_force() -> Iterator[None]:
    """Context in which the process is ended ``PATIENCE`` seconds after a signal if there is no plan to save, or at a
    second signal."""
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
    """End the process if it does not end by itself after a signal; return when the pipe of signal numbers is closed."""
    number = _next_signal(read_end)
    if number and (not select.select([read_end], [], [], None if _now.held else PATIENCE)[0] or _next_signal(read_end)):
        os._exit(128 + number)
    os.close(read_end)


def _next_signal(read_end: int) -> int:
    """Number of the next handled signal that arrives in the pipe; 0 when the pipe is closed."""
    while number := os.read(read_end, 1):
        if number[0] - _now.forwarded in HANDLED:
            return number[0] - _now.forwarded
    return 0


@contextmanager
def _lost_in_silence() -> Iterator[None]:
    """Context in which Python does not report an interruption that is discarded (as in a destructor); interruptions are
    repeated."""
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
    """Restore default signal handling in a forked child: the parent handles Ctrl-C and SIGHUP."""
    signal.set_wakeup_fd(-1)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGHUP, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)


def defer_stop() -> None:
    """Record that there is a plan to save: until ``release_stop``, a signal does not raise ``Stopped``."""
    _now.held = True
    tell_held(True)


def stop_requested() -> bool:
    """Return true if a signal arrived while there is a plan to save, so that the search must end."""
    return bool(_now.seen) and _now.held


def release_stop() -> None:
    """Record that the plan is saved, and raise ``Stopped`` if a signal arrived in the meantime.

    Raises:
        Stopped: a signal arrived while the plan was not saved.
    """
    _now.held = False
    tell_held(False)
    reraise_stop()


def reraise_stop() -> None:
    """Raise ``Stopped`` again if a signal arrived earlier, since a library may have replaced the exception with its
    own.

    Raises:
        Stopped: a signal arrived and there is no plan to save.
    """
    if _now.seen and not _now.held:
        raise Stopped(_now.seen)


def end_with_parent() -> None:
    """Start a thread that ends this child process of ``multiprocessing`` as soon as its parent has ended."""
    import multiprocessing  # most processes have no children

    parent = multiprocessing.parent_process()
    assert parent is not None

    def wait() -> None:
        parent.join()
        os._exit(1)

    threading.Thread(target=wait, daemon=True).start()
