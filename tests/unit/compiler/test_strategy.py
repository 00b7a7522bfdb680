"""The strategy: what is printed before a run is what the run does, and each stage leads to stages that there are."""

from __future__ import annotations

import re
import time
from pathlib import Path

import pytest

from missionc.backends.api import Budget, NotFound, Outcome, Reason, Report
from missionc.backends.options import Options
from missionc.base.continuous_time import ContinuousTime
from missionc.base.source import Source
from missionc.base.units import Seconds
from missionc.compiler import driver, plan_with_margin, strategy
from missionc.compiler.plan_request import PlanRequest
from missionc.ir import Mission
from missionc.ir.kernel.nodes import Kernel
from tests.support.small_missions import SMALL

ROOT = Path(__file__).resolve().parents[3]
CRAZYFLIE = (ROOT / "missions" / "crazyflie_corridor.mission").read_text(encoding="utf-8")


class Searching:
    """A backend that finds no plan, and notes what it was asked for."""

    name, refutes = "smt", False

    def __init__(self) -> None:
        self.works: list[float] = []

    def plan(self, mission: Mission, kernel: Kernel, options: Options, budget: Budget) -> Outcome:
        self.works.append(budget.work)
        return NotFound(Reason.SOLVER, "nothing", Report())


def request(**more: object) -> PlanRequest:
    return PlanRequest(Budget(time.monotonic() + 60), **more)  # type: ignore[arg-type]


@pytest.mark.parametrize("text", [SMALL, CRAZYFLIE], ids=["small", "crazyflie"])
def test_the_tries_that_are_printed_are_those_that_a_search_makes(text: str) -> None:
    checked = driver.check(Source("a.mission", text))
    backend, asked = Searching(), request()
    plan_with_margin.plan_with_margin(
        backend,  # type: ignore[arg-type]
        checked.valid_mission,
        checked.valid_kernel,
        asked.options,
        asked.budget,
    )
    search = strategy.stages(checked, asked)[0]
    printed = [float(found[1]) for each in search.tries if (found := re.search(r"; ([0-9.]+) units", each))]
    assert [*printed, asked.budget.work] == backend.works
    assert search.tries[-1] == "speed limits of the mission, no robustness margin; remaining time"


def test_every_stage_leads_to_a_stage_or_to_an_answer() -> None:
    checked = driver.check(Source("a.mission", SMALL))
    asked = request(explain_limit=Seconds(20.0), alternatives=3)
    found = strategy.stages(checked, asked)
    names = {stage.name for stage in found}
    assert names == {"search", "verify", "time scaling", "continuous time", "margins", "alternatives", "explain"}
    ends = "result|next try|undecided"
    assert strategy.NEXT not in {following for stage in found for _, following in stage.then}
    for stage in found:
        for outcome, following in stage.then:
            assert re.search("|".join([ends, *names]), following), (stage.name, outcome, following)


def test_what_is_not_asked_for_has_no_stage() -> None:
    checked = driver.check(Source("a.mission", SMALL))
    asked = request(continuous_time=ContinuousTime.AT_STEPS, options=Options(stretch=2.0))
    search, verify, margins = strategy.stages(checked, asked)
    assert (search.name, verify.name, margins.name) == ("search", "verify", "margins")
    assert dict(verify.then)["passed"] == "margins"


@pytest.mark.parametrize(
    ("text", "options", "widened"),
    [
        (SMALL, Options(), True),
        (SMALL, Options(preset="paper"), False),
        (SMALL, Options(require_solver=True), False),
        (SMALL.replace("solve with smt { nodes = 40 }", "") + "maximize robustness\n", Options(), False),
    ],
    ids=["default", "published", "solver", "robustness"],
)
def test_margins_are_widened_unless_the_method_or_the_objective_decides_them(
    text: str, options: Options, widened: bool
) -> None:
    checked = driver.check(Source("a.mission", text))
    names = [stage.name for stage in strategy.stages(checked, request(options=options))]
    assert ("margins" in names) == widened


def test_a_published_method_plans_once() -> None:
    checked = driver.check(ROOT / "missions" / "strel_goal.mission", backend="smt")
    search, verify = strategy.stages(checked, request(options=Options(preset="paper")))
    assert search.tries == ()
    assert "preset" in search.runs
    assert verify.name == "verify"


def test_attempts_at_continuous_time_begin_with_repairs_of_the_plan() -> None:
    on_roadmaps = strategy.attempts("smt", delays=False, repairable=True)
    assert on_roadmaps == (*strategy.CONTINUOUS_TIME.repairs, *strategy.CONTINUOUS_TIME.on_roadmaps)
    assert strategy.attempts("clot", delays=False, repairable=False) == strategy.CONTINUOUS_TIME.in_space
    assert strategy.attempts("clot", delays=True, repairable=True) == strategy.CONTINUOUS_TIME.delays


def test_several_plans_cannot_be_stretched() -> None:
    with pytest.raises(ValueError, match="scaled in time"):
        request(alternatives=2, options=Options(stretch=2.0))
