"""An append-only journal: lines that are never changed, in a file that is locked by who is at work on it.

in   the file's path, lines
out  the same lines

A process that is killed may leave half a line at its end: nobody believes it, and whoever writes next cuts it off.
"""

from __future__ import annotations

import fcntl
import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from missionc.base.diagnostics.code import SWEEP_AT_WORK
from missionc.base.diagnostics.model import Diagnostic
from missionc.output.folder.ownership import cannot_write, reason, shown
from missionc.output.folder.write_file import NOT_REGULAR

LARGEST = 1 << 30
"""Bytes of a journal that is read."""
FLAGS = os.O_RDWR | os.O_APPEND | os.O_CREAT | os.O_CLOEXEC | os.O_NOFOLLOW | os.O_NONBLOCK
"""How it is opened: no link is followed, and no pipe is waited for."""
BLOCK = 4096
"""Bytes that are looked at together for the end of the last line."""


class Journal:
    """The journal, open to be added to. Each line is on its way to the disk before the next one is written."""

    def __init__(self, handle: int) -> None:
        self._handle = handle

    @property
    def size(self) -> int:
        """Bytes, those of half a line included."""
        return os.fstat(self._handle).st_size

    def read(self) -> bytes:
        """All that is there: lines, each with its end, and perhaps half of one.

        Raises:
            OSError: it cannot be read.
        """
        with open(os.dup(self._handle), "rb") as file:
            file.seek(0)
            return file.read()

    def cut(self) -> None:
        """Cut off half a line at the end."""
        end = self._end()
        if end < self.size:
            os.ftruncate(self._handle, end)

    def add(self, line: bytes) -> None:
        """Add a line; its end is written with it.

        Raises:
            OSError: there is no room for it.
        """
        if os.write(self._handle, line + b"\n") < len(line) + 1:
            raise OSError(28, "No space left on device")

    def sync(self) -> None:
        os.fsync(self._handle)

    def _end(self) -> int:
        """Where the last whole line ends."""
        end = self.size
        while end:
            begin = max(0, end - BLOCK)
            place = os.pread(self._handle, end - begin, begin).rfind(b"\n")
            if place >= 0:
                return begin + place + 1
            end = begin
        return 0


@contextmanager
def locked(path: Path, of: Path, another: str) -> Iterator[Journal | Diagnostic]:
    """The journal at a path for whoever is the only one at work on it, made where there is none; else why not.

    Args:
        of: what messages say that somebody is at work in.
        another: how another one is named, in words.
    """
    try:
        handle = os.open(path, FLAGS, 0o666)
    except OSError as error:
        yield cannot_write(path, reason(error))
        return
    try:
        if not stat.S_ISREG(os.fstat(handle).st_mode):
            yield cannot_write(path, NOT_REGULAR)
            return
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            help_ = "wait until the other command has ended"
            message = f"`{shown(of)}` is in use by another command"
            yield Diagnostic(SWEEP_AT_WORK, message, None, help=help_)
            return
        yield Journal(handle)
    finally:
        with suppress(OSError):
            os.close(handle)
