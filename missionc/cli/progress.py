"""Progress line on a terminal: elapsed time, stage, and progress."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from shutil import get_terminal_size
from typing import TYPE_CHECKING, TextIO

from missionc.base.diagnostics.render import plain_line
from missionc.cli.streams import OutputClosed

if TYPE_CHECKING:
    from missionc.backends.api import Progress

EVERY = 0.2
"""Seconds between two updates of the line, also while a stage reports no progress."""


class ProgressLine:
    """Context manager during which a progress line is updated; it is erased at the end."""

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream
        self._begin = time.monotonic()
        self._says = "reading files"
        self._done = threading.Event()
        self._drawer = threading.Thread(target=self._draw, daemon=True)

    def listen(self, progress: Progress) -> None:
        """Show the progress of a backend from the next update on."""
        self._says = words(progress)

    def say(self, stage: str) -> None:
        self._says = stage

    def __enter__(self) -> ProgressLine:
        self._drawer.start()
        return self

    def __exit__(self, *exception: object) -> None:
        self._done.set()
        self._drawer.join()
        self._show("")

    def _draw(self) -> None:
        while not self._done.wait(EVERY):
            line = f"{time.monotonic() - self._begin:5.1f} s  {self._says}"
            # A line that wraps could not be erased completely.
            self._show(plain_line(line)[: get_terminal_size().columns - 1])

    def _show(self, line: str) -> None:
        # A missing progress line is no problem.
        with suppress(OutputClosed):
            self._stream.write(f"\r\x1b[K{line}")
            self._stream.flush()


def words(progress: Progress) -> str:
    """Progress of a backend in one line: the stage, and details such as iterations and planned agents."""
    iteration = f", iteration {progress.iteration}" if progress.iteration else ""
    planned = "{}/{} agents".format(*progress.planned) if progress.planned else ""
    margin = "" if progress.margin is None else f"best margin {progress.margin:.3g} m"
    details = ", ".join(filter(None, (planned, margin, progress.detail)))
    return plain_line(f"{progress.activity}{iteration}" + (f": {details}" if details else ""))


@contextmanager
def shown(silent: bool) -> Iterator[Callable[[Progress], None]]:
    """Yield a function that shows progress on a terminal, and does nothing elsewhere or if ``silent``."""
    if silent or not sys.stderr.isatty():
        yield lambda progress: None
        return
    with ProgressLine(sys.stderr) as line:
        yield line.listen
