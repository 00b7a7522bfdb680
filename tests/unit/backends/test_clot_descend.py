"""From a plan to a shorter one: what is gained, that nothing is broken, and where it ends."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("torch")

from missionc.backends.acceptance import attempt
from missionc.backends.api import Budget, Planned, Report
from missionc.backends.clot.backend import BACKEND
from missionc.backends.clot.cost_weights import METRES, SHORT, longest_step
from missionc.backends.clot.optimise.active_set import Demand
from missionc.backends.clot.optimise.candidate import System
from missionc.backends.clot.optimise.control_points import splines, trace
from missionc.backends.clot.optimise.convex_descent import _Program, descend
from missionc.backends.clot.optimise.improve import effort, travelled
from missionc.backends.clot.optimise.motion_residuals import Costs
from missionc.backends.clot.optimise.residuals import Rows
from missionc.backends.clot.settings import Spare, Weights
from missionc.backends.options import Options
from missionc.base.trace import Array, Trace
from missionc.ir import Mission
from missionc.ir.kernel.nodes import Kernel
from tests.support.transport_missions import checked

VISIT = (Path(__file__).resolve().parents[3] / "missions" / "clot_visit.mission").read_text(encoding="utf-8")

ROUND = """\
mission round
time step 0.25 s, horizon 6 s
world (0, 0) to (10, 6)
region goal = box (7, 1) to (9, 3)
obstacle wall = box (4, 0) to (5, 4)
team cart[2] { radius 0.2 m  dynamics double_integrator(speed <= 4 m/s, acceleration <= 4 m/s^2)
  start at (1, 1), (1, 2) }
require visit: eventually[0, 6 s] every cart: goal
require apart: always[0, 6 s] distance(cart[0], cart[1]) >= 0.8
"""


def enlarged(times: int) -> str:
    """``ROUND`` with all lengths and speeds so many times as large."""
    return f"""\
mission enlarged
time step 0.25 s, horizon 6 s
world (0, 0) to ({10 * times}, {6 * times})
region goal = box ({7 * times}, {times}) to ({9 * times}, {3 * times})
obstacle wall = box ({4 * times}, 0) to ({5 * times}, {4 * times})
team cart[2] {{ radius {0.2 * times} m
  dynamics double_integrator(speed <= {4 * times} m/s, acceleration <= {4 * times} m/s^2)
  start at ({times}, {times}), ({times}, {2 * times}) }}
require visit: eventually[0, 6 s] every cart: goal
require apart: always[0, 6 s] distance(cart[0], cart[1]) >= {0.8 * times}
minimize distance
"""


def planned(text: str, seed: int = 0, settings: dict[str, str] | None = None, **overrides: str) -> tuple[Trace, Report]:
    mission, kernel = checked(text, settings=settings, **overrides)
    outcome = BACKEND.plan(mission, kernel, Options(), Budget(time.monotonic() + 120, seed=seed))
    assert isinstance(outcome, Planned)
    assert attempt(mission, kernel, outcome.trace).is_plan
    return outcome.trace, outcome.report


@pytest.mark.parametrize("seed", range(2))
def test_a_plan_nobody_asked_to_be_short_has_fewer_detours(seed: int) -> None:
    tidy, _ = planned(VISIT, seed, N="5")
    plain, _ = planned(VISIT, seed, settings={"clot.tidy": "0"}, N="5")
    assert travelled(tidy) < 0.95 * travelled(plain)
    assert (
        np.linalg.norm(np.diff(tidy.velocity, axis=1), axis=-1).sum()
        < np.linalg.norm(np.diff(plain.velocity, axis=1), axis=-1).sum()
    )


def test_the_least_distance_is_no_more_than_the_tidied_one_and_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    tidy, _ = planned(VISIT, N="3")
    least, report = planned(VISIT + "minimize distance\n", N="3")
    assert travelled(least) <= travelled(tidy)
    assert [note for note in report.notes if note.startswith(f"distance {travelled(least):.6g} m")]


@pytest.mark.parametrize("times", [10, 100])
def test_in_a_larger_world_the_least_distance_is_as_many_times_as_long(times: int) -> None:
    small, _ = planned(enlarged(1))
    large, _ = planned(enlarged(times))
    assert travelled(large) == pytest.approx(times * travelled(small), rel=0.02)


def test_the_least_energy_has_less_of_it_than_the_least_distance() -> None:
    short, _ = planned(ROUND + "minimize distance\n")
    smooth, report = planned(ROUND + "minimize energy\n")
    assert effort(smooth) < effort(short)
    assert travelled(short) < travelled(smooth)
    assert "m^2/s^3 (first plan" in report.notes[-1]


@dataclass(frozen=True)
class Descent:
    """From the control points of a plan, all for length."""

    mission: Mission
    kernel: Kernel
    control: Array
    costs: Costs
    demand: Demand

    def after(self, steps: int, gain: float = 0.0, go_on: bool = True) -> Array:
        return descend(self.control, self.costs, self.demand, steps, gain, 2, lambda: go_on)

    def cost(self, control: Array) -> float:
        return System(self.costs, control).smoothness(control)


@pytest.fixture
def descent(monkeypatch: pytest.MonkeyPatch) -> Descent:
    seen: list[tuple[Array, Costs, Demand]] = []

    def keep(control: Array, costs: Costs, demand: Demand, *_: object) -> Array:
        seen.append((control, costs, demand))
        return control

    mission, kernel = checked(ROUND)
    with monkeypatch.context() as patched:
        patched.setattr("missionc.backends.clot.optimise.improve.descend", keep)
        assert isinstance(BACKEND.plan(mission, kernel, Options(), Budget(time.monotonic() + 120)), Planned)
    control, costs, demand = seen[0]
    return Descent(mission, kernel, control, replace(costs, weights=replace(Weights(), length=1.0, bend=0.05)), demand)


@pytest.mark.parametrize("steps", [3, 5, 8])
def test_after_every_number_of_steps_there_is_a_plan_and_it_costs_less(steps: int, descent: Descent) -> None:
    after = descent.after(steps)
    assert descent.cost(after) < descent.cost(descent.control)
    assert attempt(descent.mission, descent.kernel, trace(descent.mission, descent.costs.splines, after)).is_plan


def test_without_steps_or_time_nothing_changes(descent: Descent) -> None:
    assert (descent.after(0) == descent.control).all()
    assert (descent.after(5, go_on=False) == descent.control).all()


def test_a_step_that_gains_too_little_is_the_last(descent: Descent) -> None:
    one, all_the_way = descent.after(8, gain=1.0), descent.after(8)
    assert descent.cost(all_the_way) < descent.cost(one) < descent.cost(descent.control)


def test_metres_count_as_a_quadratic_that_touches_them_and_is_nowhere_less(descent: Descent) -> None:
    costs, here = replace(descent.costs, weights=Weights(length=0.0, bend=0.0, metres=1.0)), descent.control
    system = System(costs, here)

    def ways(control: Array) -> Array:
        used = [
            control[agent, : descent.mission.steps + 1 + second] for agent, second in enumerate(costs.splines.smooth)
        ]
        return np.concatenate([np.linalg.norm(np.diff(points, axis=0), axis=1) for points in used])

    scale = np.maximum(ways(here), SHORT * longest_step(descent.mission))
    assert system.smoothness(here) == pytest.approx(0.5 * (ways(here) ** 2 / scale).sum())
    for seed in range(5):
        there = here + 0.1 * np.random.default_rng(seed).standard_normal(here.shape)
        assert system.smoothness(there) + 0.5 * scale.sum() >= ways(there).sum()


def test_metres_are_made_less_than_by_squares_alone(descent: Descent) -> None:
    squares = descent.after(40, gain=1e-3)
    weights = Weights(length=METRES.length, bend=METRES.bend, metres=METRES.metres)
    metres = replace(descent, control=squares, costs=replace(descent.costs, weights=weights)).after(
        40, gain=METRES.gain
    )
    made = [trace(descent.mission, descent.costs.splines, each) for each in (squares, metres)]
    assert attempt(descent.mission, descent.kernel, made[1]).is_plan
    assert travelled(made[1]) < travelled(made[0])


def test_rows_that_contradict_each_other_have_no_answer() -> None:
    mission, _ = checked(ROUND)
    made = splines(mission)
    costs = Costs(mission, made, Weights(), Spare())
    control = made.through(np.zeros((2, mission.steps + 1, 2)))
    system = System(costs, control)
    where = made.position(np.array([0]), np.array([5]), np.zeros(1))
    for sides, answered in (((1.0,), True), ((1.0, -1.0), False)):
        program = _Program(system, system.pull(control), 0.4)
        for side in sides:
            row = Rows("x", 1.0, 0.03, np.array([0.1]), (where,), (np.array([[side, 0.0]]),))
            program.add([row], np.zeros(system.count), {})
        moved = program.solved()
        assert (moved is not None) == answered
        if moved is not None:
            assert where.of(system.moved(moved))[0, 0] == pytest.approx(-0.1, abs=1e-3)
