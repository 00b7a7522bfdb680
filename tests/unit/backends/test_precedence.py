"""What some wait for others with is given a step, so that each can be planned by itself."""

from __future__ import annotations

import pytest

import missionc
from missionc.backends.smt.prioritized.prioritized_planning import PrioritizedPlanner
from missionc.base.source import Source
from missionc.base.trace import Indices
from missionc.base.units import Seconds
from missionc.compiler.results import Verified

LOCK = """\
mission lock
time step 5 s, horizon 4 min
world (0, 0) to (200, 80)
region chamber = box (90, 30) to (110, 50)
region hut     = box (96, 4) to (104, 12)
obstacle north = box (90, 50) to (110, 80)
obstacle south = box (90, 20) to (110, 30)
team barge[3] { radius 2 m  dynamics single_integrator(speed <= 2 m/s)  start at (40, 20), (40, 40), (160, 40) }
agent keeper  { radius 1 m  dynamics single_integrator(speed <= 1 m/s)  start at (130, 8) }
group up = barge[0..1]
separation 1 m
require up:    every up: eventually[0, end] x >= 150 m
require down:  barge[2]: eventually[0, end] x <= 50 m
require keyed: WAIT
solve with smt
"""
FOR_ALL = "(not (some barge: chamber)) until[0, 2 min] (keeper: hut)"
FOR_ONE = "(barge[0]: not chamber) until[0, 2 min] (keeper: hut)"
LATER = FOR_ALL + "\nrequire busy: keeper: always[0, 80 s] x >= 120 m"


@pytest.fixture
def planners(monkeypatch: pytest.MonkeyPatch) -> list[PrioritizedPlanner]:
    """Those that were asked for a plan."""
    asked: list[PrioritizedPlanner] = []
    before = PrioritizedPlanner.plan

    def plan(self: PrioritizedPlanner) -> Indices | None:
        asked.append(self)
        return before(self)

    monkeypatch.setattr(PrioritizedPlanner, "plan", plan)
    return asked


def compiled(wait: str) -> missionc.Compiled:
    return missionc.compile(Source("lock.mission", LOCK.replace("WAIT", wait)), time_limit=Seconds(3600))


@pytest.mark.parametrize("wait", [FOR_ALL, FOR_ONE])
def test_who_waits_for_another_is_planned_by_itself(planners: list[PrioritizedPlanner], wait: str) -> None:
    assert isinstance(compiled(wait).outcome, Verified)
    assert planners[0].taken == 0
    assert all(len(part.named) == 1 for part in planners[0].requirements.parts)


def test_no_step_that_was_chosen_is_a_reason_to_refuse(planners: list[PrioritizedPlanner]) -> None:
    assert isinstance(compiled(LATER).outcome, Verified)
    assert all(planner.refused is None for planner in planners)
