"""Trials as values: what is drawn, what is done with it, and the promise that was broken.

A case is texts and JSON, so that it can be kept in a file and carried out again.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

MISSION = "m.mission"
"""The name of the mission among the files of a case."""


@dataclass(frozen=True, slots=True)
class Case:
    """What one trial is about.

    Args:
        files: texts by name, ``MISSION`` among them where there is one.
        settings: whatever else was drawn; JSON.
    """

    files: dict[str, str] = field(default_factory=dict)
    settings: dict[str, Any] = field(default_factory=dict)

    def with_text(self, text: str) -> Case:
        """The same case of another mission."""
        return replace(self, files={**self.files, MISSION: text})

    def laid(self, folder: Path) -> Path:
        """The mission, with all files of the case in that folder."""
        folder.mkdir(parents=True, exist_ok=True)
        for name, text in self.files.items():
            (folder / name).write_text(text, encoding="utf-8")
        return folder / MISSION


@dataclass(frozen=True, slots=True)
class Kind:
    """A kind of trial.

    Args:
        says: what its trials do, in a line.
        draw: the case of a trial; the same generator gives the same case.
        carry_out: what came of a case, in a word; works in a folder of its own, and raises ``Broken`` or anything else.
        seconds: that a trial may take on the wall.
        of_text: whether its findings are about the text of a mission, which is shrunk.
    """

    name: str
    says: str
    draw: Callable[[np.random.Generator], Case]
    carry_out: Callable[[Case, Path], str]
    seconds: float = 120.0
    of_text: bool = True


class Broken(Exception):
    """A promise does not hold.

    Args:
        referee: what noticed it, in a word or two; with the kind it is what two findings are told apart by.
        promise: what should be so, a sentence.
        seen: what is so instead.
    """

    def __init__(self, referee: str, promise: str, seen: object = "") -> None:
        super().__init__(f"{promise} {seen}")
        self.referee, self.promise, self.seen = referee, promise, str(seen)


@dataclass(frozen=True, slots=True)
class Fault:
    """What a trial found.

    Args:
        signature: the same for the same defect, as far as can be told.
        promise: what should be so, a sentence.
        seen: what is so instead, for whoever mends it.
    """

    signature: str
    promise: str
    seen: str = ""


@dataclass(frozen=True, slots=True)
class Answer:
    """How a trial ended: a word, seconds on the wall, and what it found, if anything."""

    outcome: str
    seconds: float
    fault: Fault | None = None
