"""The workplace that the pages of a studio share: its folder for plans, the reports that can be had, the planner."""

from __future__ import annotations

import secrets
from dataclasses import dataclass, field
from itertools import count
from pathlib import Path

from missionc.tools.studio.planner import NewPlanner
from missionc.tools.studio.text_file import TextFile


@dataclass(slots=True)
class Workplace:
    """Args:
    home: the one folder that missions are opened from and saved to.
    first: the text that a page begins with.
    plans: a folder of the studio's own, for what it compiles.
    planner: a context whose value compiles texts, one at a time.
    """

    home: Path
    first: TextFile
    plans: Path
    planner: NewPlanner
    reports: dict[str, bytes] = field(default_factory=dict)
    """Pages by a name that nobody guesses."""
    _numbers: count[int] = field(default_factory=count)

    def folder(self) -> Path:
        """A folder for one more plan, which is not there yet."""
        return self.plans / f"plan-{next(self._numbers)}"

    def publish(self, page: bytes) -> str:
        """From now on the page can be had, by this name."""
        name = f"report/{secrets.token_urlsafe(12)}.html"
        self.reports[name] = page
        return name

    def withdraw(self, name: str) -> None:
        self.reports.pop(name, None)
