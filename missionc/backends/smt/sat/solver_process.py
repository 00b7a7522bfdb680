"""Process of a solver: messages, waiting, memory, and termination together with the run."""

from __future__ import annotations

import os
import queue
import re
import select
import signal
import subprocess
import threading
import time
from collections.abc import Sequence
from pathlib import Path
from typing import IO, Protocol, TypeVar

from missionc.base.signals import stop_requested


class Process:
    """Process of a command that reads from one pipe and answers on another."""

    def __init__(self, command: list[str]) -> None:
        self.peak_bytes = 0
        # In its own session, Ctrl-C on the terminal reaches only the parent.
        self.process = subprocess.Popen(  # noqa: S603
            command,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            bufsize=0,
            start_new_session=True,
        )
        assert self.process.stdin is not None
        self.outbox = Outbox(self.process.stdin)

    def fileno(self) -> int:
        """File descriptor of the answer pipe."""
        assert self.process.stdout is not None
        return self.process.stdout.fileno()

    def read(self) -> bytes:
        """Available output of the process, after waiting for some; empty at its end."""
        return os.read(self.fileno(), 1 << 20)

    def weigh(self) -> None:
        """Record the peak memory of the running process, if the system reports it."""
        try:
            status = Path(f"/proc/{self.process.pid}/status").read_text()
        except OSError:
            return
        if match := re.search(r"VmHWM:\s+(\d+) kB", status):
            self.peak_bytes = max(self.peak_bytes, int(match[1]) * 1024)

    def close(self) -> None:
        """Kill the process, if it still runs, and wait for its end."""
        if self.process.returncode is None:
            self.weigh()
            os.kill(self.process.pid, signal.SIGKILL)  # no other waiter exists, so the process number is still its own
            self.process.returncode = os.waitstatus_to_exitcode(os.waitpid(self.process.pid, 0)[1])
        self.outbox.end()
        assert self.process.stdout is not None
        self.process.stdout.close()


class Outbox:
    """Ordered writer to a pipe; data for a dead process is dropped.

    A thread writes, so that a busy process does not block the caller.
    """

    def __init__(self, pipe: IO[bytes]) -> None:
        self._pipe = pipe
        self._waiting: queue.SimpleQueue[bytes | None] = queue.SimpleQueue()
        self._thread = threading.Thread(target=self._pump, daemon=True)
        self._thread.start()

    def put(self, message: bytes) -> None:
        self._waiting.put(message)

    def end(self) -> None:
        """Close the pipe after all data is written."""
        self._waiting.put(None)

    def _pump(self) -> None:
        try:
            with self._pipe:
                while (waiting := self._waiting.get()) is not None:
                    left = memoryview(waiting)
                    while left:
                        left = left[self._pipe.write(left) :]
        except (OSError, ValueError):  # the process is gone
            return


class HasFileno(Protocol):
    def fileno(self) -> int: ...


Stream = TypeVar("Stream", bound=HasFileno)


def wait(streams: Sequence[Stream], deadline: float) -> list[Stream]:
    """Streams with available data; empty when time is up, or after a signal.

    Args:
        deadline: end of the wait on the clock of ``time.monotonic``, seconds.
    """
    patience = 0.1  # seconds between two checks for a signal
    while not is_over(deadline):
        left = max(0.0, deadline - time.monotonic())
        ready = select.select(streams, [], [], min(left, patience))[0]
        if ready:
            return ready
    return []


def is_over(deadline: float) -> bool:
    """Return true if time is up, or a signal arrived."""
    return stop_requested() or time.monotonic() >= deadline
