"""Planner of the studio: what ``missionc studio`` gives it, for compilations in a process of their own."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Protocol

from missionc import Diagnostic, Source

LOOK_EVERY = 0.1
"""Seconds between two looks at a compilation."""


class Ended(Protocol):
    """The end of a compilation: exit status, findings as text and as values, and the lines of the summary."""

    @property
    def status(self) -> int: ...
    @property
    def says(self) -> str: ...
    @property
    def findings(self) -> Sequence[Diagnostic]: ...
    @property
    def lines(self) -> Sequence[str]: ...


class Planner(Protocol):
    """One compilation at a time; a new one ends the one before."""

    @property
    def progress(self) -> str:
        """Stage of the compilation, in a line; empty if that is not known."""

    def compile(self, source: Source, output: Path, backend: str) -> None:
        """Compile a text into a folder."""

    def ended(self) -> Ended | None:
        """The end of the compilation under way, once it has ended."""

    def stop(self) -> None:
        """End the compilation under way."""


NewPlanner = Callable[[], AbstractContextManager[Planner]]
