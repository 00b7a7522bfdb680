"""Supervision: the work runs in a child process, which its parent ends if the worker itself cannot.

in   reports of the worker: its deadline, and whether it has a plan to save
out  in the worker nothing; in its parent how the worker ended

Python interrupts a process between two of its own instructions. A call of a C library may last for minutes, use up all
memory, or abort. The parent only waits: it forwards signals, kills a worker that exceeds its deadline by a grace
period, and reports how the worker ended. Only Linux supports this; elsewhere there is one process.
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
"""Offset of the number of a forwarded signal. The worker ignores the original, which a terminal sends to both, so each
counts once."""

STOPPING = (*HANDLED, *(FORWARDED + number for number in HANDLED))
"""Signals that end a process or its work, in original and in forwarded form."""

GRACE, SHARE = 5.0, 0.05
"""Extra time of the worker after its deadline: in seconds, and as a ratio of its total time."""

PATIENCE = 3.0
"""Seconds that the worker has after a signal without a plan to save, and after any second one."""

NO_THREAD_DATA = 127
"""Exit status from the C library of Linux for a process whose thread gets no memory; no command uses it."""

_DEADLINE, _HELD, _KEPT = b"d", b"h", b"k"
_RECORD = struct.Struct("<cd")


class Cause(Enum):
    """Reason why a worker did not end by itself."""

    TIME = "time"
    MEMORY = "memory"
    CRASH = "crash"


class Ended(NamedTuple):
    """End of the worker: its exit status, or its cause and signal, and whether it had written a plan."""

    status: int
    cause: Cause | None = None
    kept: bool = False


class _Worker:
    """Link of this process to its parent, if ``process`` is its own number."""

    process = 0
    pipe = -1


def supervised() -> bool:
    """Return whether this process is a worker; its forked children are not."""
    return _Worker.process == os.getpid()


def tell_deadline(moment: float) -> None:
    """Report the deadline of the work to the parent, on the clock of ``time.monotonic``."""
    _tell(_DEADLINE, moment)


def tell_held(held: bool) -> None:
    """Report to the parent whether there is a plan to save after a signal."""
    _tell(_HELD, held)


def tell_kept() -> None:
    """Report to the parent that a verified plan is written."""
    _tell(_KEPT, True)


def _tell(kind: bytes, value: float) -> None:
    if supervised():
        os.write(_Worker.pipe, _RECORD.pack(kind, value))


def supervise() -> Ended | None:
    """Continue in a child process: returns None there, and in the parent how the child ended."""
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
    """Do nothing: the parent reads the number from its pipe, and the worker waits for the forwarded signal."""


def _end_when_closed(pipe: int) -> None:
    """Let the system end this process when no process can write to a pipe any more: its parent has ended."""
    import fcntl  # not on every system

    fcntl.fcntl(pipe, fcntl.F_SETOWN, os.getpid())
    fcntl.fcntl(pipe, fcntl.F_SETFL, os.O_ASYNC | os.O_NONBLOCK)
    if select.select([pipe], [], [], 0)[0]:
        os._exit(1)


class _Supervisor:
    """Parent of a worker, until the worker has ended."""

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
