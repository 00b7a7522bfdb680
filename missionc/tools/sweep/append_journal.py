"""Append-only journal: a file of lines that are never changed, locked by its user.

in   the file's path, lines
out  the same lines

A killed process may leave half a line at the end, which is ignored, and removed by the next writer.
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
from missionc.output.folder.write_folder import NOT_REGULAR

LARGEST = 1 << 30
"""Maximum size of a journal that is read, bytes."""
FLAGS = os.O_RDWR | os.O_APPEND | os.O_CREAT | os.O_CLOEXEC | os.O_NOFOLLOW | os.O_NONBLOCK
"""Flags for opening the file: links are not followed, and pipes do not block."""
BLOCK = 4096
"""Size in bytes of the blocks in which the end of the last line is searched."""


class Journal:
    """Journal file, open for appending; a line is written in one call."""

    def __init__(self, handle: int) -> None:
        self._handle = handle

    @property
    def size(self) -> int:
        """Size in bytes, including half a line."""
        return os.fstat(self._handle).st_size

    def read(self) -> bytes:
        """Read the complete lines, each with its end, and possibly half a line.

        Raises:
            OSError: the file cannot be read.
        """
        with open(os.dup(self._handle), "rb") as file:
            file.seek(0)
            return file.read()

    def cut(self) -> None:
        """Remove half a line at the end, if there is one."""
        end = self._end()
        if end < self.size:
            os.ftruncate(self._handle, end)

    def add(self, line: bytes) -> None:
        """Append a line and its end.

        Raises:
            OSError: the disk is full.
        """
        if os.write(self._handle, line + b"\n") < len(line) + 1:
            raise OSError(28, "No space left on device")

    def sync(self) -> None:
        os.fsync(self._handle)

    def _end(self) -> int:
        """Offset of the end of the last complete line, in bytes."""
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
    """Yield the journal at a path, created if necessary and locked; otherwise the finding that it is in use.

    Args:
        path: path of the journal.
        of: path in messages.
        another: how to name another one, for a message.
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
