"""State that the pages of a studio share: the folder for plans, the reports and the planner."""

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
        home: the only folder in which missions are opened and saved.
        first: initial text of a page.
        plans: folder of the studio for its compilations.
        planner: function that returns a context manager with a planner.
    """

    home: Path
    first: TextFile
    plans: Path
    planner: NewPlanner
    reports: dict[str, bytes] = field(default_factory=dict)
    """Report pages by request path, which contains a random name."""
    _numbers: count[int] = field(default_factory=count)

    def folder(self) -> Path:
        """Path of a new folder for a plan, which does not exist yet."""
        return self.plans / f"plan-{next(self._numbers)}"

    def publish(self, page: bytes) -> str:
        """Serve a report page; return its request path."""
        name = f"report/{secrets.token_urlsafe(12)}.html"
        self.reports[name] = page
        return name

    def withdraw(self, name: str) -> None:
        self.reports.pop(name, None)
