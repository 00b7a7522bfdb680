"""No bound on the best plan is above what some plan comes to: motions at random, and all motions on a few lanes."""

from __future__ import annotations

import math
import time
from itertools import islice, pairwise
from unittest.mock import patch

import pytest
from hypothesis import HealthCheck, event, given, settings

from missionc.backends.api import Budget
from missionc.backends.cover import refute as module
from missionc.backends.cover.refute import least_duration
from missionc.backends.run_account import Account
from missionc.frontend.checks.lower_bounds import lower_bounds
from missionc.ir import Mission
from missionc.ir.kernel.nodes import Kernel
from tests import reference
from tests.support.exhaustive_lanes import OnLanes, joint_motions, missions_on_lanes
from tests.support.motions_with_missions import Planned, on_a_grid, under_way

FEW = settings(
    max_examples=40, suppress_health_check=[HealthCheck.too_slow, HealthCheck.filter_too_much], deadline=None
)

MISSIONS = 40


def by_covers(mission: Mission, kernel: Kernel, cells: tuple[int, ...]) -> int:
    """The steps that covers of so many cells show, where nothing else is known."""
    with patch.object(module, "CELLS", cells):
        budget = Budget(time.monotonic() + 60, work=20.0)
        return least_duration(mission, kernel, 0, mission.steps, budget, Account())


def no_more(planned: Planned, cells: tuple[int, ...]) -> None:
    mission, kernel, trace = planned.mission, planned.kernel, planned.trace
    bounds = lower_bounds(mission, kernel, bent=True)
    covered = by_covers(mission, kernel, cells)
    event(f"covers show {'something' if covered else 'nothing'}")
    assert max(covered, bounds.steps) <= trace.lasts
    assert bounds.metres <= trace.metres


@FEW
@given(on_a_grid())
def test_a_motion_on_a_grid_comes_to_no_less_than_what_is_proven(planned: Planned) -> None:
    no_more(planned, (6, 30))


@FEW
@given(under_way())
def test_a_motion_at_its_bounds_comes_to_no_less_than_what_is_proven(planned: Planned) -> None:
    no_more(planned, (5, 25))


def best_of(case: OnLanes) -> tuple[float, float]:
    """Steps and metres of the best joint motions; infinite where none is a plan."""
    steps = metres = math.inf
    for run in joint_motions(case.mission):
        if all(reference.truth(each.formula, run, 0, 0) for each in case.mission.requirements):
            pairs = [list(pairwise(way)) for way in run.position]
            lasts = max(
                (step + 1 for way in pairs for step, (here, there) in enumerate(way) if here != there), default=0
            )
            steps = min(steps, lasts)
            metres = min(metres, sum(math.dist(here, there) for way in pairs for here, there in way))
    return steps, metres


@pytest.mark.slow
def test_no_bound_is_above_the_best_of_all_motions_on_lanes() -> None:
    shown = 0
    for seed, case in islice(missions_on_lanes(), MISSIONS):
        steps, metres = best_of(case)
        if math.isinf(steps):
            continue
        bounds = lower_bounds(case.mission, case.kernel, bent=True)
        covered = by_covers(case.mission, case.kernel, (8, 40))
        assert max(covered, bounds.steps) <= steps, seed
        assert bounds.metres <= metres, seed
        shown += covered > 0
    assert shown
