"""The journal of the farm: one line of JSON for each trial, on the disk before the next one begins.

in   the journal's path, the seed
out  what is known of trials so far; a line more for each

A line that was cut off, as by a process that was killed, is no line.
"""

from __future__ import annotations

import fcntl
import json
import os
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path

NAME = "journal.jsonl"


@dataclass(frozen=True, slots=True)
class Line:
    """One trial that is over.

    Args:
        outcome: in a word.
        commit: of the tree, as git describes it.
        signature: of what it found; empty where it found nothing.
    """

    seed: int
    trial: int
    kind: str
    outcome: str
    seconds: float
    commit: str
    signature: str = ""


class Journal:
    """The journal in a folder, which is made where there is none."""

    def __init__(self, folder: Path) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        self.path = folder / NAME
        self.lines = list(_lines(self.path))

    @contextmanager
    def at_work(self) -> Iterator[bool]:
        """Whether nobody else is at work on this journal; nobody else is told so within."""
        with self.path.open("ab") as file:
            try:
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except OSError:
                yield False
            else:
                yield True

    def next_trial(self, seed: int) -> int:
        """The number of the first trial of a seed that comes after all that are over."""
        return 1 + max((line.trial for line in self.lines if line.seed == seed), default=-1)

    @property
    def signatures(self) -> set[str]:
        """What was found before."""
        return {line.signature for line in self.lines if line.signature}

    @property
    def commit(self) -> str:
        """The commit of the tree that the last trial was carried out on; empty where there was none."""
        return self.lines[-1].commit if self.lines else ""

    def add(self, line: Line) -> None:
        text = json.dumps(asdict(line), ensure_ascii=False) + "\n"
        with self.path.open("ab+") as file:
            if file.tell():
                file.seek(-1, os.SEEK_END)
                text = text if file.read(1) == b"\n" else "\n" + text
            file.write(text.encode())
            file.flush()
            os.fsync(file.fileno())
        self.lines.append(line)


def _lines(path: Path) -> Iterator[Line]:
    for text in path.read_text(encoding="utf-8", errors="replace").splitlines() if path.exists() else ():
        try:
            yield Line(**json.loads(text))
        except (ValueError, TypeError):
            continue


def described(tree: Path) -> str:
    """The tree as git describes it; empty where it is none of git's."""
    words = ["git", "-C", str(tree), "describe", "--always", "--dirty", "--tags"]
    try:
        return subprocess.run(words, capture_output=True, text=True, check=True).stdout.strip()
    except (OSError, subprocess.CalledProcessError):
        return ""
