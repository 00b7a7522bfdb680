"""The journal of the farm: one line of JSON for each trial, flushed before the next one begins.

in   the journal's path, the seed
out  the trials so far; a line for each new one

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
    """Finished trial.

    Args:
        outcome: outcome in one word.
        commit: commit of the tree, as described by git.
        signature: signature of its finding; empty if there is none.
    """

    seed: int
    trial: int
    kind: str
    outcome: str
    seconds: float
    commit: str
    signature: str = ""


class Journal:
    """Journal in a folder, created if necessary."""

    def __init__(self, folder: Path) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        self.path = folder / NAME
        self.lines = list(_lines(self.path))

    @contextmanager
    def at_work(self) -> Iterator[bool]:
        """Context that tells whether this is the only process with this journal, and locks it."""
        with self.path.open("ab") as file:
            try:
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except OSError:
                yield False
            else:
                yield True

    def next_trial(self, seed: int) -> int:
        """Number of the first trial of a seed after all finished ones."""
        return 1 + max((line.trial for line in self.lines if line.seed == seed), default=-1)

    @property
    def signatures(self) -> set[str]:
        """Signatures of earlier findings."""
        return {line.signature for line in self.lines if line.signature}

    @property
    def commit(self) -> str:
        """Commit of the last trial; empty if there was none."""
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
    """Description of the tree by git; empty without git."""
    words = ["git", "-C", str(tree), "describe", "--always", "--dirty", "--tags"]
    try:
        return subprocess.run(words, capture_output=True, text=True, check=True).stdout.strip()
    except (OSError, subprocess.CalledProcessError):
        return ""
