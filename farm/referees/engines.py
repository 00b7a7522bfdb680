"""Consistency of several engines' answers to one mission: no plan contradicts another engine's proof or bound.

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
"""Tolerance for values in files, metres or seconds."""


@dataclass(frozen=True, slots=True)
class Reply:
    """Answer of an engine: the JSON document of ``compile``, and its folder."""

    engine: str
    outcome: str
    codes: frozenset[str]
    folder: Path

    @property
    def planned(self) -> bool:
        return self.outcome == "planned"

    @property
    def no_motion(self) -> bool:
        """True if it claims that nothing satisfies the mission, for any roadmap."""
        return self.outcome == "impossible" and NO_MOTION.name in self.codes

    @property
    def no_roadmap(self) -> bool:
        """True if it claims that its roadmaps contain no plan."""
        return self.outcome in ("impossible", "undecided") and IMPOSSIBLE.name in self.codes


def refused_as_impossible(reply: Reply) -> bool:
    """Return whether the check rejects a mission as impossible, rather than for looking beyond its end."""
    names = {code.name for code in SAY_IMPOSSIBLE}
    return reply.outcome == "refused" and bool(names & reply.codes) and BEYOND_HORIZON.name not in reply.codes


def reply(engine: str, document: dict[str, Any], folder: Path) -> Reply:
    codes = frozenset(each["code"] for each in document["diagnostics"] if each["severity"] == "error")
    return Reply(engine, str(document["outcome"]), codes, folder)


def consistent(replies: list[Reply]) -> None:
    """Check that the answers of all engines to one mission are consistent.

    Raises:
        Broken: the answers contradict each other.
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
