"""A command in watch mode, in a process of its own, with its output."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PATIENCE = 120.0
"""Timeout in seconds, far more than needed on a busy machine."""


def until(true: Callable[[], bool], what: str) -> None:
    end = time.monotonic() + PATIENCE
    while not true():
        assert time.monotonic() < end, f"waited in vain for {what}"
        time.sleep(0.05)


class Watching:
    """Process in watch mode; ``said`` is the output on both streams."""

    def __init__(self, folder: Path, words: list[str]) -> None:
        self.folder = folder
        self.said = ""
        self.process = subprocess.Popen(
            [sys.executable, "-m", "missionc", *words],
            cwd=folder,
            env={**os.environ, "PYTHONPATH": str(ROOT)},
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self) -> None:
        assert self.process.stdout is not None
        for line in self.process.stdout:
            self.said += line

    def says(self, words: str, times: int = 1) -> None:
        """Wait until the output has the words this many times."""
        ended = self.process.poll
        until(lambda: self.said.count(words) >= times or ended() is not None, f"`{words}` in\n{self.said}")
        assert self.said.count(words) >= times, self.said

    def address(self) -> str:
        self.says("Ctrl-C stops")
        found = re.search(r"http://127\.0\.0\.1:\d+/[\w-]*/?", self.said)
        assert found, self.said
        return found[0]

    def end(self, number: int) -> int:
        self.process.send_signal(number)
        status = self.process.wait(PATIENCE)
        self._reader.join(PATIENCE)
        return status


@contextmanager
def watching(folder: Path, *words: str) -> Iterator[Watching]:
    started = Watching(folder, list(words))
    try:
        yield started
    finally:
        started.process.kill()
        started.process.wait()


def save_by_rename(path: Path, text: str) -> None:
    """Save a file by renaming, as editors do that never leave half a file."""
    beside = path.with_name(f".{path.name}.swp")
    beside.write_text(text)
    beside.replace(path)
