"""Mission templates that ``missionc init`` begins with: one file each, in this folder.

A template is a complete mission. Its first line, after ``# Template `NAME`: ``, describes it, and its comments explain
what a newcomer changes.
"""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path

from missionc.base.late_dataclass import Record

DEFAULT = "relay"

_FIRST = re.compile(r"# Template `(?P<name>[a-z-]+)`: (?P<about>.+)\n")
_MISSION = re.compile(r"^mission (?P<name>\w+)$", re.MULTILINE)


class Template(Record):
    """Mission template; ``about`` is the sentence in its first line.

    ``mission`` is the name of the mission in ``text``.
    """

    name: str
    about: str
    mission: str
    text: str

    def named(self, mission: str) -> str:
        """Text of the template with another name for the mission."""
        return _MISSION.sub(f"mission {mission}", self.text, count=1)


@cache
def templates() -> dict[str, Template]:
    """All templates by name, the default first.

    Raises:
        ValueError: a file lacks the first line of a template, or names no mission.
    """
    found = {}
    for path in sorted(Path(__file__).parent.glob("*.mission"), key=lambda path: (path.stem != DEFAULT, path.stem)):
        text = path.read_text(encoding="utf-8")
        first, mission = _FIRST.match(text), _MISSION.search(text)
        if first is None or mission is None or first["name"] != path.stem:
            raise ValueError(f"{path.name} does not begin with its name and what it is about")
        found[path.stem] = Template(path.stem, first["about"], mission["name"], text)
    return found
