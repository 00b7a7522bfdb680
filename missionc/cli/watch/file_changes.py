"""File polling: changes of a few files, looked for ten times a second, which works on every system.

What counts is what lies under a name, so it does not matter how an editor saves: in place, by
another file renamed into its place, or by deleting it first.
"""

from __future__ import annotations

import os
import time
from collections.abc import Iterable
from typing import TypeAlias

EVERY = 0.1
"""Seconds between two looks."""

REST = 0.15
"""Seconds without a change after which a burst of saves is over."""

ABSENCE = 1.0
"""Seconds for which a file may be gone while an editor puts another into its place."""

Mark: TypeAlias = tuple[int, ...]
"""The mark of a file's content: another one after every save, empty where there is no file."""


class Saves:
    """Since ``watch`` was told of a file, whether it was saved."""

    def __init__(self) -> None:
        self._marks: dict[str, Mark] = {}
        self._moving: dict[str, Mark] = {}
        self._since = 0.0

    def watch(self, names: Iterable[str]) -> bool:
        """From now on watch these files and no others; whether there are new ones among them."""
        before = self._marks
        self._marks = {name: before[name] if name in before else _mark(name) for name in names}
        return not before.keys() >= self._marks.keys()

    def saved(self) -> bool:
        """Whether something was saved since this was last true, and nothing has moved for a moment."""
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
