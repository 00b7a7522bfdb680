"""Standard streams, written by commands: a failed write is an error, never silence."""

from __future__ import annotations

import errno
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TextIO, cast

NOT_SAID = 74
"""The exit status where the disk is full, or nobody has opened the stream; that of a system's own programs."""

HUNG_UP = 141
"""The exit status where the reader has gone away: 128 and the number of SIGPIPE."""


class OutputClosed(Exception):
    """A standard stream takes no more; ``status`` is how the process ends."""

    def __init__(self, why: str, status: int = NOT_SAID) -> None:
        super().__init__(why)
        self.status = status


class GuardedStream:
    """A standard stream that raises ``Unsaid`` where it cannot be written to; ``stream`` None is one that is closed."""

    def __init__(self, stream: TextIO | None) -> None:
        self._stream = stream

    def write(self, text: str) -> int:
        with _failing():
            return self._opened().write(text)

    def flush(self) -> None:
        if self._stream is not None:
            with _failing():
                self._stream.flush()

    def isatty(self) -> bool:
        return self._stream is not None and self._stream.isatty()

    def __getattr__(self, name: str) -> object:
        return getattr(self._opened(), name)

    def _opened(self) -> TextIO:
        if self._stream is None:
            raise OutputClosed("it is closed")
        return self._stream


@contextmanager
def speaking() -> Iterator[None]:
    """Within, standard output and standard error are voices."""
    before = sys.stdout, sys.stderr
    sys.stdout, sys.stderr = (cast(TextIO, GuardedStream(stream)) for stream in before)
    try:
        yield
    finally:
        sys.stdout, sys.stderr = before


def hold_numbers() -> None:
    """Give closed standard streams something to be, so that no file of a plan takes their numbers and is written to."""
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # takes the lowest number that is free


def finished(status: int) -> int:
    """The exit status once all that was said has left; what no stream takes is dropped."""
    for stream in (sys.stdout, sys.stderr):
        if stream is None or stream.closed:
            continue
        try:
            GuardedStream(stream).flush()
        except OutputClosed as unsaid:
            status = unsaid.status
            # At its end the interpreter would try once more, and say so.
            os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())
    return status


@contextmanager
def _failing() -> Iterator[None]:
    try:
        yield
    except (OSError, ValueError) as error:
        gone = isinstance(error, OSError) and error.errno == errno.EPIPE
        raise OutputClosed(str(error), HUNG_UP if gone else NOT_SAID) from error
