"""Trials as values: a case, its execution, and the violated promise.

A case is texts and JSON, so that it can be kept in a file and carried out again.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

MISSION = "m.mission"
"""Name of the mission among the files of a case."""


@dataclass(frozen=True, slots=True)
class Case:
    """Case of one trial.

    Args:
        files: texts by name, with ``MISSION`` if there is one.
        settings: other random values; JSON.
    """

    files: dict[str, str] = field(default_factory=dict)
    settings: dict[str, Any] = field(default_factory=dict)

    def with_text(self, text: str) -> Case:
        """Same case with another mission."""
        return replace(self, files={**self.files, MISSION: text})

    def laid(self, folder: Path) -> Path:
        """Write all files of the case to a folder; returns the path of the mission."""
        folder.mkdir(parents=True, exist_ok=True)
        for name, text in self.files.items():
            (folder / name).write_text(text, encoding="utf-8")
        return folder / MISSION


@dataclass(frozen=True, slots=True)
class Kind:
    """Kind of trial.

    Args:
        says: description of its trials in one line.
        draw: function that draws the case of a trial, reproducibly.
        carry_out: function that returns the result of a case in one word; works in a folder of its own, and raises
            ``Broken`` or another error.
        seconds: time limit of a trial, wall-clock seconds.
        of_text: True if its findings are about the text of a mission, which is shrunk.
    """

    name: str
    says: str
    draw: Callable[[np.random.Generator], Case]
    carry_out: Callable[[Case, Path], str]
    seconds: float = 120.0
    of_text: bool = True


class Broken(Exception):
    """Exception for a violated promise.

    Args:
        referee: its detector, in a word or two; with the kind it identifies a finding.
        promise: expected behaviour, a sentence.
        seen: actual behaviour.
    """

    def __init__(self, referee: str, promise: str, seen: object = "") -> None:
        super().__init__(f"{promise} {seen}")
        self.referee, self.promise, self.seen = referee, promise, str(seen)


@dataclass(frozen=True, slots=True)
class Fault:
    """Fault found by a trial.

    Args:
        signature: equal for equal defects, as far as possible.
        promise: expected behaviour, a sentence.
        seen: actual behaviour, for the developer.
    """

    signature: str
    promise: str
    seen: str = ""


@dataclass(frozen=True, slots=True)
class Answer:
    """End of a trial: a word, wall-clock seconds, and its finding, if any."""

    outcome: str
    seconds: float
    fault: Fault | None = None
