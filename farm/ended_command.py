"""A command that a signal ends in the middle of its work: at a moment, or before its nth change of a file.

in   the words of a command line, a folder, the moment of the signal
out  its status, its output, and its remaining child processes

The command runs in a copy of this process that leads a session of its own, as from a shell. It forks once
more for the process that does the work, whose changes are counted; signals go to the one that the shell would know.
"""

from __future__ import annotations

import json
import os
import signal
import sys
import tempfile
import threading
import time
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any, NoReturn

from farm.own_process import session
from missionc.base.supervision import supervised

WRITES = os.O_WRONLY | os.O_RDWR | os.O_CREAT
CHANGES = ("os.mkdir", "os.rename", "os.remove", "os.rmdir", "os.truncate", "os.chmod", "os.utime", "os.link")
PATIENCE = 10.0
"""Seconds for the processes of a command to end after it."""
SECONDS = 100.0


@dataclass(frozen=True, slots=True)
class Moment:
    """Moment of the end: before the nth change of a file, or after some seconds if n is 0."""

    signal: str
    change: int = 0
    seconds: float = 0.0


@dataclass(frozen=True, slots=True)
class Ended:
    """End of a command.

    Args:
        status: as in a shell: 128 plus the number of a signal.
        changes: number of file changes in the folder until then.
        seconds: wall-clock seconds until then.
        left: remaining processes that it started.
    """

    status: int
    said: str
    changes: int
    seconds: float
    left: tuple[int, ...]


def run(words: list[str], folder: Path, moment: Moment | None = None) -> Ended:
    """Run a command to its end or to a moment.

    Args:
        folder: folder whose changes are counted.
    """
    with tempfile.TemporaryFile("w+") as said, tempfile.TemporaryFile("w+") as count:
        begin = time.monotonic()
        process = os.fork()
        if process == 0:
            _run(words, folder, moment, said, count)
        status = _status(_ended(process, moment))
        seconds = time.monotonic() - begin
        left = _gone(process)
        said.seek(0)
        count.seek(0)
        return Ended(status, said.read(), len(count.read()), seconds, left)


def document(ended: Ended) -> dict[str, Any]:
    """JSON document from a command."""
    found = json.loads(ended.said)
    assert isinstance(found, dict)
    return found


# ------------------------------------------------------------------ the parent


def _ended(process: int, moment: Moment | None) -> int:
    begin, sent = time.monotonic(), False
    while True:
        done, status = os.waitpid(process, os.WNOHANG)
        if done:
            return status
        passed = time.monotonic() - begin
        if moment and not moment.change and passed > moment.seconds and not sent:
            os.kill(process, signal.Signals[moment.signal])
            sent = True
        if passed > SECONDS:
            for each in session(process):
                os.kill(each, signal.SIGKILL)
        time.sleep(0.002)


def _gone(leader: int) -> tuple[int, ...]:
    """Processes that are still running after a while; they are ended."""
    end = time.monotonic() + PATIENCE
    while (left := session(leader)) and time.monotonic() < end:
        time.sleep(0.02)
    for each in left:
        os.kill(each, signal.SIGKILL)
    return tuple(left)


def _status(status: int) -> int:
    return 128 + os.WTERMSIG(status) if os.WIFSIGNALED(status) else os.WEXITSTATUS(status)


# ------------------------------------------------------------------- the child


def _run(words: list[str], folder: Path, moment: Moment | None, said: IO[str], count: IO[str]) -> NoReturn:
    status = 70
    try:
        os.setsid()
        os.dup2(said.fileno(), 1)
        os.dup2(said.fileno(), 2)
        sys.stdout = open(1, "w", closefd=False)  # noqa: SIM115
        sys.stderr = sys.stdout
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
            signal.signal(number, signal.SIG_DFL)
        _end_at_change(folder, moment, count.fileno())
        sys.argv = ["missionc", *words]
        from missionc.__main__ import main

        status = main()
        sys.stdout.flush()
    finally:
        os._exit(status)


def _end_at_change(folder: Path, moment: Moment | None, count: int) -> None:
    within, own, lock, changes = os.path.realpath(folder), os.getpid(), threading.Lock(), 0

    def hear(event: str, arguments: tuple[object, ...]) -> None:
        nonlocal changes
        if event != "open" and event not in CHANGES:
            return
        if event == "open" and not (isinstance(arguments[2], int) and arguments[2] & WRITES):
            return
        path = arguments[0]
        name = os.fsdecode(path) if isinstance(path, str | bytes | os.PathLike) else ""
        if name.startswith("/") and not name.startswith(within):
            return
        if os.getpid() != own and not supervised():
            return
        with lock:
            changes += 1
            os.write(count, b".")
        if moment and changes == moment.change:
            os.kill(own, signal.Signals[moment.signal])
            if moment.signal == "SIGKILL":
                os.kill(os.getpid(), signal.SIGKILL)  # the worker would end with its parent, a moment later

    sys.addaudithook(hear)
