"""File polling: checks a few files for changes ten times a second, on every system.

Files are compared by name, so an editor may save to the same file, rename another file, or delete the file first.
"""

from __future__ import annotations

import os
import time
from collections.abc import Iterable
from typing import TypeAlias

EVERY = 0.1
"""Seconds between two polls of the files."""

REST = 0.15
"""Seconds without a change after which a series of saves is complete."""

ABSENCE = 1.0
"""Maximum seconds for which a file may be missing while an editor replaces it."""

Mark: TypeAlias = tuple[int, ...]
"""Fingerprint of a file's status, which changes with every save; empty for a missing file."""


class Saves:
    """Detector of saves of watched files."""

    def __init__(self) -> None:
        self._marks: dict[str, Mark] = {}
        self._moving: dict[str, Mark] = {}
        self._since = 0.0

    def watch(self, names: Iterable[str]) -> bool:
        """Watch exactly these files from now on; return whether some of them were not watched before."""
        before = self._marks
        self._marks = {name: before[name] if name in before else _mark(name) for name in names}
        return not before.keys() >= self._marks.keys()

    def saved(self) -> bool:
        """Return whether a file was saved since the last call that returned True, and no save is in progress."""
        marks = {name: _mark(name) for name in self._marks}
        if marks == self._marks:
            self._moving = {}
            return False
        if marks != self._moving:
            self._moving, self._since = marks, time.monotonic()
            return False
        if time.monotonic() - self._since < (REST if all(marks.values()) else ABSENCE):
            return False
        self._marks, self._moving = marks, {}
        return True


def _mark(name: str) -> Mark:
    try:
        status = os.stat(name)
    except (OSError, ValueError):
        return ()
    return status.st_dev, status.st_ino, status.st_size, status.st_mtime_ns
