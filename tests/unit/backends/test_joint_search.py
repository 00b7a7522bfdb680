"""Two who have to pass each other: the joint search finds the motion, or shows that the roadmap has none."""

from __future__ import annotations

import numpy as np
import pytest

import missionc
from missionc.backends.api import Impossible
from missionc.backends.smt.prioritized.prioritized_planning import PrioritizedPlanner
from missionc.base.source import Source
from missionc.compiler.results import Verified

CORRIDOR = """
mission corridor
time step 1 s, horizon 30 s
world (0, 0) to (8, 2.2)
obstacle wall = box (0, 1) to (8, 2.2)POCKET
region west = box (0, 0) to (1.5, 1)
region east = box (6.5, 0) to (8, 1)
team a[1] { radius 0.3 m  dynamics unicycle(speed 0..1 m/s)  start at (1, 0.5) }
team b[1] { radius 0.3 m  dynamics unicycle(speed 0..1 m/s)  start at (7, 0.5) }
require a_there: every a: always[30 s, end] east
require b_there: every b: always[30 s, end] west
solve with smt { nodes = 40 }
"""


def compiled(pocket: str) -> missionc.Compiled:
    return missionc.compile(Source("corridor.mission", CORRIDOR.replace("POCKET", pocket)))


@pytest.mark.usefixtures("coarse_covers")
def test_two_in_a_corridor_that_fits_one_cannot_change_ends_and_no_clause_is_needed_to_know(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def together(self: PrioritizedPlanner, batch: frozenset[int]) -> bool:
        raise AssertionError(batch)

    monkeypatch.setattr(PrioritizedPlanner, "plan_together", together)
    outcome = compiled("").outcome
    assert isinstance(outcome, Impossible)
    assert set(outcome.conflict) == {"a_there", "b_there"}
    assert "roadmaps of 40, 68 and 116 nodes" in outcome.statement


def test_where_one_can_step_aside_they_can() -> None:
    outcome = compiled(" - box (3.2, 0.9) to (5, 2.1)").outcome
    assert isinstance(outcome, Verified)
    assert outcome.plan.trace.position[..., 1].max() > 0.7  # nobody can be there beside the pocket


def test_the_joint_search_finds_it_too(monkeypatch: pytest.MonkeyPatch) -> None:
    found: list[bool] = []
    jointly = PrioritizedPlanner.plan_jointly

    def alone(self: PrioritizedPlanner, agent: int) -> list[int] | None:
        found.append(jointly(self, (0, 1)))
        return [] if found[-1] else None

    monkeypatch.setattr(PrioritizedPlanner, "plan_single_agent", alone)
    monkeypatch.setattr(PrioritizedPlanner, "failing_alone", lambda self: list(self.requirements.parts))
    outcome = compiled(" - box (3.2, 0.9) to (5, 2.1)").outcome
    assert isinstance(outcome, Verified)
    assert np.isfinite(outcome.plan.trace.position).all()


ALLEY = """
mission alley
time step 1 s, horizon 60 s
world (0, 0) to (14, 6)
obstacle north = box (4, 3.5) to (10, 6)
obstacle south = box (4, 0) to (10, 2.5)
region west = box (0, 0) to (3.8, 6)
region east = box (10.2, 0) to (14, 6)
team a[2] { radius 0.35 m  dynamics unicycle(speed 0..1 m/s, turn <= 90 deg/s)  start at (2, 3), (2, 1) }
agent b { radius 0.35 m  dynamics unicycle(speed 0..1 m/s, turn <= 90 deg/s)  start at (12, 3) }
require a_there: every a: eventually[0, end] always[0, end] east
require b_there: b: eventually[0, end] always[0, end] west
solve with smt
"""


def test_who_comes_out_of_an_alley_does_not_rest_in_front_of_it_where_others_have_to_pass(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def together(self: PrioritizedPlanner, batch: frozenset[int]) -> bool:
        raise AssertionError(batch)

    monkeypatch.setattr(PrioritizedPlanner, "plan_together", together)
    outcome = missionc.compile(Source("alley.mission", ALLEY)).outcome
    assert isinstance(outcome, Verified)
    sizes = dict(outcome.report.sizes)
    assert sizes["turns"] == 0
    assert "nodes" not in sizes  # the roadmap of shortest ways was enough
