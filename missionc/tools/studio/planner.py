"""Interface of the studio's planner, which ``missionc studio`` implements with a separate process."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Protocol

from missionc import Diagnostic, Source

LOOK_EVERY = 0.1
"""Seconds between two polls of a compilation."""


class Ended(Protocol):
    """Result of a compilation: exit status, findings as text and as values, and the lines of the summary."""

    @property
    def status(self) -> int: ...
    @property
    def says(self) -> str: ...
    @property
    def findings(self) -> Sequence[Diagnostic]: ...
    @property
    def lines(self) -> Sequence[str]: ...


class Planner(Protocol):
    """Planner for one compilation at a time; a new one stops the current one."""

    @property
    def progress(self) -> str:
        """Current stage of the compilation in one line; empty if unknown."""

    def compile(self, source: Source, output: Path, backend: str) -> None:
        """Start compiling a text.

        Args:
            source: text of the mission.
            output: path of the plan folder.
            backend: name of a backend, or ``auto``.
        """

    def ended(self) -> Ended | None:
        """Result of the current compilation; None until it has ended."""

    def stop(self) -> None:
        """Stop the current compilation."""


NewPlanner = Callable[[], AbstractContextManager[Planner]]
