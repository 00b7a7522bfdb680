"""The workplace that the pages of a studio share: its folder for plans, reports and planner."""

from __future__ import annotations

import secrets
from dataclasses import dataclass, field
from itertools import count
from pathlib import Path

from missionc.tools.studio.planner import NewPlanner
from missionc.tools.studio.text_file import TextFile


@dataclass(slots=True)
class Workplace:
    """State shared by the pages of a studio.

    Args:
        home: the only folder for opening and saving missions.
        first: initial text of a page.
        plans: folder of the studio for its compilations.
        planner: context whose value compiles texts, one at a time.
    """

    home: Path
    first: TextFile
    plans: Path
    planner: NewPlanner
    reports: dict[str, bytes] = field(default_factory=dict)
    """Pages by a random name."""
    _numbers: count[int] = field(default_factory=count)

    def folder(self) -> Path:
        """Unused path of a folder for another plan."""
        return self.plans / f"plan-{next(self._numbers)}"

    def publish(self, page: bytes) -> str:
        """Make a page available, and return its name."""
        name = f"report/{secrets.token_urlsafe(12)}.html"
        self.reports[name] = page
        return name

    def withdraw(self, name: str) -> None:
        self.reports.pop(name, None)
