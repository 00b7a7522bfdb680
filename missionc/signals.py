"""Ctrl-C and SIGTERM as one exception, so that every ``finally`` runs and the exit status is right.

Once there is a plan (``hold``), the first one no longer raises: ``asked`` tells of it, whoever is still at work on a
better plan ends, and the plan that is there is verified and written.
"""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from types import FrameType

HANDLED = (signal.SIGINT, signal.SIGTERM)


class Stopped(BaseException):
    """Someone asked the process to end. Not an ``Exception``: nothing that mends errors may catch it."""

    def __init__(self, signal_number: int) -> None:
        super().__init__(signal_number)
        self.status = 128 + signal_number


@dataclass(slots=True)
class _State:
    """Of the process, as its signal handlers are."""

    seen: bool = False
    held: bool = False


_now = _State()


@contextmanager
def stoppable() -> Iterator[None]:
    """Within, the first signal raises ``Stopped`` (after ``hold``, is noted); a second one ends the process at once."""

    def stop(number: int, frame: FrameType | None) -> None:
        if _now.seen:
            os._exit(128 + number)
        _now.seen = True
        if not _now.held:
            raise Stopped(number)

    if threading.current_thread() is not threading.main_thread():
        yield  # only the main thread may install handlers
        return
    _now.seen = _now.held = False
    before = {number: signal.signal(number, stop) for number in HANDLED}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler or signal.SIG_DFL)
        _now.seen = _now.held = False


def hold() -> None:
    """From now on, to the end of ``stoppable``, there is something to bring home."""
    _now.held = True


def asked() -> bool:
    """Whether someone has asked to end, and what is there is to be brought home."""
    return _now.seen and _now.held


def end_with_parent() -> None:
    """From now on this process, a child of ``multiprocessing``, ends at once when its parent has ended."""
    import multiprocessing  # most processes have no children

    parent = multiprocessing.parent_process()
    assert parent is not None

    def wait() -> None:
        parent.join()
        os._exit(1)

    threading.Thread(target=wait, daemon=True).start()
