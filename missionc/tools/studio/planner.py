"""Interface of the studio's planner: ``missionc studio`` passes one for compilations in a separate process."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Protocol

from missionc import Diagnostic, Source

LOOK_EVERY = 0.1
"""Seconds between two checks of a compilation."""


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
    """Planner for one compilation at a time; a new one ends the one before."""

    @property
    def progress(self) -> str:
        """Stage of the compilation in one line; empty if unknown."""

    def compile(self, source: Source, output: Path, backend: str) -> None:
        """Compile a text into a folder."""

    def ended(self) -> Ended | None:
        """End of the current compilation, once it has ended."""

    def stop(self) -> None:
        """End the current compilation."""


NewPlanner = Callable[[], AbstractContextManager[Planner]]
