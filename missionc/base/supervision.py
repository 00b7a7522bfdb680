"""Supervision: the work runs in a child process (worker), which the parent kills if the worker does not end by itself.

    in   reports of the worker: its deadline, and whether it has a plan to save
    out  in the worker nothing; in the parent the outcome of the worker

Python handles a signal between two of its own instructions only. A call of a C library may last for minutes, use up all
memory, or abort. The parent only waits: it forwards signals, kills a worker that exceeds its deadline by a grace
period, and reports how the worker ended. Only Linux supports this; on other systems there is one process.
"""

from __future__ import annotations

import math
import os
import select
import signal
import struct
import sys
import time
from enum import Enum
from types import FrameType
from typing import NamedTuple

HANDLED = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)

FORWARDED = getattr(signal, "SIGRTMIN", 0)
"""Offset of the number of a forwarded signal. A terminal sends a signal to parent and worker; the worker ignores the
original signal, so that each signal counts once."""

STOPPING = (*HANDLED, *(FORWARDED + number for number in HANDLED))
"""Signals that end a process or its work, in original and in forwarded form."""

GRACE, SHARE = 5.0, 0.05
"""Grace period of the worker after its deadline: a constant in seconds, and a fraction of its time limit."""

PATIENCE = 3.0
"""Seconds that the worker has to end after a signal if it has no plan to save, and after any second signal."""

NO_THREAD_DATA = 127
"""Exit status of a process on Linux whose new thread gets no memory; no command of the compiler uses it."""

_DEADLINE, _HELD, _KEPT = b"d", b"h", b"k"
_RECORD = struct.Struct("<cd")


class Cause(Enum):
    """Reason for which the parent or the system ended a worker."""

    TIME = "time"
    MEMORY = "memory"
    CRASH = "crash"


class Ended(NamedTuple):
    """End of a worker: its exit status, or the cause of its end; ``kept`` is true if it had written a plan."""

    status: int
    cause: Cause | None = None
    kept: bool = False


class _Worker:
    """Connection of this process to its parent; valid only if ``process`` is the number of this process."""

    process = 0
    pipe = -1


def supervised() -> bool:
    """Return true if this process is a supervised worker; its forked children are not."""
    return _Worker.process == os.getpid()


def tell_deadline(moment: float) -> None:
    """Report the deadline of the work to the parent process.

    Args:
        moment: time on the clock of ``time.monotonic``, seconds.
    """
    _tell(_DEADLINE, moment)


def tell_held(held: bool) -> None:
    """Report to the parent process whether there is a plan to save after a signal."""
    _tell(_HELD, held)


def tell_kept() -> None:
    """Report to the parent process that a verified plan is written."""
    _tell(_KEPT, True)


def _tell(kind: bytes, value: float) -> None:
    if supervised():
        os.write(_Worker.pipe, _RECORD.pack(kind, value))


def supervise() -> Ended | None:
    """Continue in a child process: return None in the child, and the child's end in the parent.

    On systems other than Linux, return None without a child process.
    """
    if sys.platform != "linux":
        return None
    reports, told = os.pipe()
    alive, parent = os.pipe()
    woken, wake = os.pipe()
    os.set_blocking(wake, False)
    signal.set_wakeup_fd(wake)
    for number in (signal.SIGCHLD, *HANDLED):
        if signal.getsignal(number) != signal.SIG_IGN:  # as with ``nohup``
            signal.signal(number, _note)
    process = os.fork()
    if process:
        os.close(told)
        os.close(alive)
        return _Supervisor(process, reports, woken).wait()
    signal.set_wakeup_fd(-1)
    signal.signal(signal.SIGCHLD, signal.SIG_DFL)
    for each in (reports, parent, woken, wake):
        os.close(each)
    _end_when_closed(alive)
    _Worker.process, _Worker.pipe = os.getpid(), told
    return None


def _note(number: int, frame: FrameType | None) -> None:
    """Signal handler without effect: the parent reads signal numbers from a pipe, and the worker waits for forwarded
    signals."""


def _end_when_closed(pipe: int) -> None:
    """Make the system end this process when the other end of a pipe is closed, which means that its parent has
    ended."""
    import fcntl  # not on every system

    fcntl.fcntl(pipe, fcntl.F_SETOWN, os.getpid())
    fcntl.fcntl(pipe, fcntl.F_SETFL, os.O_ASYNC | os.O_NONBLOCK)
    if select.select([pipe], [], [], 0)[0]:
        os._exit(1)


class _Supervisor:
    """Parent of a worker process, while the worker runs."""

    def __init__(self, process: int, reports: int, woken: int) -> None:
        self.process, self.reports, self.woken = process, reports, woken
        self.deadline = self.patience = math.inf
        self.held = self.kept = False
        self.seen = 0
        self.killed = False

    def wait(self) -> Ended:
        while True:
            moment = math.inf if self.killed else min(self.deadline, self.patience)
            left = None if moment == math.inf else max(0.0, moment - time.monotonic())
            ready = select.select([self.reports, self.woken], [], [], left)[0]
            if self.reports in ready:
                self._hear()
            if self.woken in ready:
                for number in os.read(self.woken, 1 << 10):
                    self._forward(number)
                done, status = os.waitpid(self.process, os.WNOHANG)
                if done:
                    if select.select([self.reports], [], [], 0)[0]:
                        self._hear()
                    return self._ended(os.waitstatus_to_exitcode(status))
            elif not ready and time.monotonic() - moment > GRACE:
                self.deadline = time.monotonic() + GRACE  # both were stopped for some time, as by a shell
            elif not ready:
                self.killed = True
                os.kill(self.process, signal.SIGKILL)

    def _hear(self) -> None:
        for kind, value in _RECORD.iter_unpack(os.read(self.reports, 100 * _RECORD.size)):
            if kind == _DEADLINE:
                self.deadline = value + GRACE + SHARE * max(0.0, value - time.monotonic())
            elif kind == _HELD:
                self.held = bool(value)
            else:
                self.kept = True

    def _forward(self, number: int) -> None:
        if number not in HANDLED:
            return
        if self.seen or not self.held:
            self.patience = time.monotonic() + PATIENCE
        self.seen = self.seen or number
        os.kill(self.process, FORWARDED + number)

    def _ended(self, code: int) -> Ended:
        number = -code
        if code >= 0:
            return Ended(code, Cause.MEMORY if code == NO_THREAD_DATA else None, self.kept)
        if self.seen or number - FORWARDED in HANDLED:
            return Ended(128 + (self.seen or number - FORWARDED))
        if self.killed:
            return Ended(number, Cause.TIME, self.kept)
        # The system kills processes that use too much memory, and libraries abort without memory.
        short = number in (signal.SIGKILL, signal.SIGABRT, signal.SIGBUS)
        return Ended(number, Cause.MEMORY if short else Cause.CRASH, self.kept)
