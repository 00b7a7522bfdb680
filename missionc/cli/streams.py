"""Standard streams for output of commands: a failed write raises an exception, so that it is reported."""

from __future__ import annotations

import errno
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TextIO, cast

NOT_SAID = 74
"""Exit status if output fails, as on a full disk or a closed stream; the same as in system programs."""

HUNG_UP = 141
"""Exit status if the reader of the output has ended: 128 plus the number of SIGPIPE."""


class OutputClosed(Exception):
    """Error: a standard stream cannot be written; ``status`` is the exit status of the process."""

    def __init__(self, why: str, status: int = NOT_SAID) -> None:
        super().__init__(why)
        self.status = status


class GuardedStream:
    """Standard stream that raises ``OutputClosed`` if it cannot be written.

    Args:
        stream: stream to write to; None for a closed one.
    """

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
    """Context manager during which standard output and standard error are ``GuardedStream`` objects."""
    before = sys.stdout, sys.stderr
    sys.stdout, sys.stderr = (cast(TextIO, GuardedStream(stream)) for stream in before)
    try:
        yield
    finally:
        sys.stdout, sys.stderr = before


def hold_numbers() -> None:
    """Open substitutes for closed standard streams.

    Otherwise a file of the plan would get the number of one, and be overwritten by output.
    """
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # takes the lowest free number


def finished(status: int) -> int:
    """Exit status after all output is flushed; output that cannot be written is discarded."""
    for stream in (sys.stdout, sys.stderr):
        if stream is None or stream.closed:
            continue
        try:
            GuardedStream(stream).flush()
        except OutputClosed as unsaid:
            status = unsaid.status
            # Otherwise the interpreter would try again at its end and report an error.
            os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())
    return status


@contextmanager
def _failing() -> Iterator[None]:
    try:
        yield
    except (OSError, ValueError) as error:
        gone = isinstance(error, OSError) and error.errno == errno.EPIPE
        raise OutputClosed(str(error), HUNG_UP if gone else NOT_SAID) from error
