"""Joint problems of the first steps alone, and whole ways that begin with what was found there."""

from __future__ import annotations

from typing import Any

import pytest

import missionc
from missionc.backends.smt.prioritized import prioritized_planning
from missionc.backends.smt.refine.problem import Problem, Setting
from missionc.base.source import Source
from missionc.base.trace import Indices
from missionc.compiler.results import Verified

LINK = """
mission link
time step 1 s, horizon HORIZON
world (0, 0) to (12, 10)
region base = box (0.5, 0.5) to (3, 3)
region post = box (8, 7) to (11, 9.5)
team drone[6] { radius 0.1 m  dynamics unicycle(speed 1..2 m/s)  start in post }
graph radio = proximity 1 m
require link: drone[0]: eventually[0, HORIZON] (drone reach[hops 1..2 on radio] base)
solve with smt { nodes = 90 }
"""


@pytest.fixture
def lasts(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """The last step of each joint problem."""
    found: list[int] = []
    before = Setting.problem

    def problem(self: Setting, *rest: Any) -> Problem:
        found.append(self.mission.steps)
        return before(self, *rest)

    monkeypatch.setattr(Setting, "problem", problem)
    return found


def test_after_what_is_asked_of_several_each_goes_on_by_itself(lasts: list[int]) -> None:
    outcome = missionc.compile(Source("link.mission", LINK.replace("HORIZON", "60 s"))).outcome
    assert isinstance(outcome, Verified)
    assert lasts
    assert max(lasts) < 30


def test_where_nobody_can_go_on_the_whole_horizon_is_asked_about(
    lasts: list[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    def never(*rest: object) -> Indices | None:
        return None

    monkeypatch.setattr(prioritized_planning, "continued", never)
    outcome = missionc.compile(Source("link.mission", LINK.replace("HORIZON", "40 s"))).outcome
    assert isinstance(outcome, Verified)
    assert lasts[-1] == 40


def test_a_short_mission_is_asked_about_at_once(lasts: list[int]) -> None:
    assert isinstance(missionc.compile(Source("link.mission", LINK.replace("HORIZON", "20 s"))).outcome, Verified)
    assert set(lasts) == {20}
