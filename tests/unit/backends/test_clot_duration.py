"""``minimize duration`` for the transport backend: motions that rest, and plans that are over sooner."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("torch")

from missionc.backends.clot.optimise.control_points import trace
from missionc.backends.clot.optimise.improve import duration, shorten
from missionc.backends.clot.optimise.levenberg_marquardt import polish
from missionc.backends.clot.optimise.motion_residuals import Costs
from missionc.base.source import Source
from missionc.base.trace import Array, Trace
from missionc.base.units import Seconds
from missionc.compiler import driver
from missionc.compiler.results import Verified
from tests.support.transport_missions import costs_and_demand

pytestmark = pytest.mark.usefixtures("coarse_covers")

ERRAND = """\
mission errand
time step 0.5 s, horizon 6 s
world (0, 0) to (8, 6)
region base = box (0.5, 0.5) to (2.5, 2.5)
region goal = box (5, 3) to (7.5, 5.5)
team drone[2] { radius 0.1 m  dynamics single_integrator(speed <= 2 m/s)  start at (1, 1), (2, 1) }
require visit: every drone: eventually[0, 6 s] goal
"""

SMOOTH = ERRAND.replace(
    "single_integrator(speed <= 2 m/s)", "double_integrator(speed <= 2 m/s, acceleration <= 2 m/s^2)"
)

BACK = ERRAND.replace("(2, 1) }", "(2, 1)  finish at (1, 2), (2, 2) }")


def verified(text: str, *, seed: int = 0, backend: str = "clot") -> Verified:
    found = driver.compile(Source("a.mission", text), backend=backend, seed=seed, time_limit=Seconds(3600))
    assert isinstance(found.outcome, Verified), found.outcome
    return found.outcome


def motion(costs: Costs, seed: int = 0) -> Array:
    """Anywhere but where starts and finishes are."""
    shape = len(costs.mission.agents), costs.splines.steps + 1, 2
    position = np.random.default_rng(seed).uniform((1, 1), (5, 4), shape)
    for agent in costs.mission.agents:
        for place, step in ((agent.start, 0), (agent.finish, -1)):
            if place is not None and place.point is not None:
                position[agent.index, step] = place.point
    return costs.splines.through(position)


# -------------------------------------------------------------------- at rest


@pytest.mark.parametrize("text", [ERRAND, SMOOTH, BACK])
@pytest.mark.parametrize("rest", [1, 4, 11])
def test_whoever_is_put_to_rest_stays_at_rest_while_polished(text: str, rest: int) -> None:
    costs, demand = costs_and_demand(text)
    made = replace(costs.splines, rest=rest)
    resting = replace(costs, splines=made)
    control = made.at_rest(motion(costs))
    for points in (control, polish(control, resting, demand, 5).control):
        assert duration(trace(costs.mission, made, points)) <= rest
        assert np.array_equal(points[costs.splines.fixed], control[costs.splines.fixed])


@pytest.mark.parametrize("text", [ERRAND, SMOOTH, BACK])
def test_points_at_rest_are_one_unknown_and_fixed_points_are_none(text: str) -> None:
    costs, _ = costs_and_demand(text)
    moved = costs.splines.unknowns()
    assert np.array_equal(moved >= 0, ~costs.splines.fixed)
    assert len(np.unique(moved[moved >= 0])) == (moved >= 0).sum()
    number = replace(costs.splines, rest=5).unknowns()
    for agent, row in enumerate(number):
        last = costs.splines.steps + int(costs.splines.smooth[agent])
        assert len(set(row[5 : last + 1].tolist())) == 1
        assert (row[5] == -1) == (text is BACK)
    assert set(number[number >= 0].tolist()) == set(range(number.max() + 1))


def test_a_motion_lasts_as_long_as_anybody_moves() -> None:
    position = np.zeros((2, 6, 2))
    velocity = np.zeros_like(position)
    assert duration(Trace(Seconds(1.0), position, velocity, np.zeros((2, 6)))) == 0
    position[1, 3:, 0] = 0.1
    assert duration(Trace(Seconds(1.0), position, velocity, np.zeros((2, 6)))) == 3
    velocity[0, 4, 1] = 1.0
    assert duration(Trace(Seconds(1.0), position, velocity, np.zeros((2, 6)))) == 5


# ------------------------------------------------------------------- shorter


@pytest.mark.parametrize("text", [ERRAND, SMOOTH, BACK])
def test_a_plan_is_over_sooner_than_without_the_objective(text: str) -> None:
    found = verified(text + "minimize duration\n")
    lasts = duration(found.plan.trace)
    assert lasts <= duration(verified(text).plan.trace)
    assert any(note.startswith(f"duration {lasts} steps (first plan: ") for note in found.report.notes)
    # From (1, 1) it is 4.5 m to `goal`: 5 steps at 2 m/s, and as many back.
    assert lasts >= (10 if text is BACK else 5)


def test_what_has_a_time_keeps_it() -> None:
    late = ERRAND + "require late: drone[0]: eventually[5 s, 6 s] base\nminimize duration\n"
    found = verified(late + "require there: drone[0]: always[3 s, 4 s] goal\n")
    # From `goal` at 4 s it is 2.5 m and more to `base`.
    assert duration(found.plan.trace) > 10


def test_a_preference_that_is_kept_stays_kept() -> None:
    found = verified(ERRAND + "prefer home: drone[0]: eventually[5 s, 6 s] x <= 4\nminimize duration\n")
    assert "preference `home` satisfied" in found.report.notes
    position = found.plan.trace.position[0, 10:]
    assert (position[:, 0] <= 4).any()


def test_the_hybrid_makes_plans_shorter_too() -> None:
    text = ERRAND + "graph radio = proximity 3 m\nrequire near: drone[0]: always[0, 6 s] somewhere[hops 1..1] drone\n"
    found = verified(text + "minimize duration\n", backend="hybrid")
    assert duration(found.plan.trace) < 12
    assert any(note.startswith("duration ") for note in found.report.notes)


def test_a_plan_that_cannot_be_made_shorter_is_not_lost() -> None:
    costs, demand = costs_and_demand(ERRAND)
    control = motion(costs)
    made = trace(costs.mission, costs.splines, control)
    tried: list[Array] = []

    def refuse(points: Array) -> None:
        tried.append(points)

    kept = shorten(control, made, demand, costs, refuse, lambda: True)
    assert kept.control is control
    assert kept.trace is made
    assert "no plan of 11 steps found" in kept.note
    assert tried


def test_where_the_time_is_up_nothing_is_tried() -> None:
    costs, demand = costs_and_demand(ERRAND)
    control = motion(costs)
    made = trace(costs.mission, costs.splines, control)
    kept = shorten(control, made, demand, costs, lambda points: made, lambda: False)
    assert kept.trace is made
    assert kept.note == "duration 12 steps (first plan: 12); the search ended early"


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("backend", ["clot", "hybrid"])
@pytest.mark.parametrize("text", [ERRAND, SMOOTH, BACK])
def test_a_plan_is_over_sooner_with_any_seed(text: str, backend: str, seed: int) -> None:
    found = verified(text + "minimize duration\n", seed=seed, backend=backend)
    assert duration(found.plan.trace) <= duration(verified(text, seed=seed, backend=backend).plan.trace)
