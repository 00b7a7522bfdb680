"""Answers of several engines to one mission: nobody's plan is impossible, or better than can be, by another's word.

in   the answers of commands
says Broken
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from itertools import permutations
from pathlib import Path
from typing import Any

from farm.trial import Broken
from missionc.base.diagnostics.code import BEYOND_HORIZON, IMPOSSIBLE, NO_MOTION
from tests.support.exhaustive_lattice import SAY_IMPOSSIBLE

NEAR = 1e-5
"""Metres or seconds: of figures in files."""


@dataclass(frozen=True, slots=True)
class Reply:
    """What an engine answered, by the JSON document of ``compile``, and the folder where it wrote."""

    engine: str
    outcome: str
    codes: frozenset[str]
    folder: Path

    @property
    def planned(self) -> bool:
        return self.outcome == "planned"

    @property
    def no_motion(self) -> bool:
        """It says that nothing satisfies the mission, whatever the roadmap."""
        return self.outcome == "impossible" and NO_MOTION.name in self.codes

    @property
    def no_roadmap(self) -> bool:
        """It says that its roadmaps hold no plan."""
        return self.outcome == "impossible" and IMPOSSIBLE.name in self.codes


def refused_as_impossible(reply: Reply) -> bool:
    """Whether the check refuses a mission because it cannot be; one that looks beyond its end is not read so far."""
    names = {code.name for code in SAY_IMPOSSIBLE}
    return reply.outcome == "refused" and bool(names & reply.codes) and BEYOND_HORIZON.name not in reply.codes


def reply(engine: str, document: dict[str, Any], folder: Path) -> Reply:
    codes = frozenset(each["code"] for each in document["diagnostics"] if each["severity"] == "error")
    return Reply(engine, str(document["outcome"]), codes, folder)


def consistent(replies: list[Reply]) -> None:
    """What all engines say of one mission can be so.

    Raises:
        Broken: it cannot.
    """
    for one, other in permutations(replies, 2):
        if one.no_motion and other.planned:
            promise = "A mission that is reported as impossible for every motion has no verified plan."
            raise Broken("engines", promise, f"{one.engine} reports {NO_MOTION.name}, {other.engine} has a plan")
        if one.planned and other.planned:
            _no_better_than_proven(one, other)


def _no_better_than_proven(one: Reply, other: Reply) -> None:
    proven, value = _proven(one), _proven(other)
    if proven and value and proven["unit"] == value["unit"] and value["value"] < proven["least"] - NEAR:
        promise = "No verified plan is better than the lower bound."
        raise Broken("bounds", promise, f"{one.engine} proves {proven}, {other.engine} has {value}")


def _proven(reply: Reply) -> dict[str, Any] | None:
    plan = json.loads((reply.folder / "plan.json").read_text(encoding="utf-8"))
    found = plan.get("proven")
    return found if isinstance(found, dict) else None
