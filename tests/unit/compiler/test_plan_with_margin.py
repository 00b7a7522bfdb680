"""What a backend is asked for, in which order, and what is said of the plan that comes of it."""

from __future__ import annotations

import time
from dataclasses import dataclass, field

import numpy as np
import pytest

from missionc.backends.api import Budget, CutShort, Impossible, NotFound, Outcome, Planned, Reason, Report, Scope
from missionc.backends.load import load_engines
from missionc.backends.options import Options
from missionc.base.diagnostics.model import Diagnostic
from missionc.base.source import Source
from missionc.base.trace import Trace
from missionc.base.units import Seconds
from missionc.compiler.front_end import check
from missionc.compiler.plan_with_margin import plan_with_margin
from missionc.ir import Mission
from missionc.ir.kernel.nodes import Kernel
from missionc.ir.lower.expand import expand
from missionc.ir.lower.tighten import with_flyable_speeds
from missionc.verification.monitoring.monitor import monitor
from tests.support.small_missions import SMALL

STILL = np.zeros((2, 7, 2))
PLAN = Planned(Trace(Seconds(1.0), STILL, STILL, STILL[..., 0]), Report())
LATE = NotFound(Reason.TIME, "", Report())
REFUSED = Impossible(("visit",), "", Report())


@dataclass
class Told:
    """A backend that answers what it is told to, and remembers what it was asked."""

    answers: list[Outcome]
    asked: list[float] = field(default_factory=list)
    missions: list[Mission] = field(default_factory=list)
    name: str = "told"

    def plan(self, mission: Mission, kernel: Kernel, options: Options, budget: Budget) -> Outcome:
        self.asked.append(budget.deadline)
        self.missions.append(mission)
        return self.answers[len(self.asked) - 1]


@pytest.mark.parametrize(
    ("answers", "cut_short"),
    [
        ([PLAN], None),
        ([REFUSED, PLAN], None),
        ([REFUSED, REFUSED, PLAN], None),
        ([LATE, PLAN], CutShort.TIME),
        ([LATE, REFUSED, PLAN], CutShort.TIME),
        ([REFUSED, LATE, PLAN], CutShort.TIME),
    ],
)
def test_a_plan_after_a_try_that_time_ended_is_cut_short(answers: list[Outcome], cut_short: CutShort | None) -> None:
    checked = check(Source("small.mission", SMALL))
    assert checked.mission is not None
    assert checked.kernel is not None
    bisections = [REFUSED] * (3 if len(answers) > 1 else 0)
    backend = Told([*answers, *bisections])
    found = plan_with_margin(backend, checked.mission, checked.kernel, Options(margin=0.05), Budget(deadline=1e9))
    assert isinstance(found, Planned)
    assert found.report.cut_short is cut_short
    assert len(backend.asked) == len(answers) + len(bisections)
    assert backend.asked[len(answers) - 1] == 1e9 or len(answers) < 3


@pytest.mark.parametrize(
    ("answers", "share"),
    [
        ([PLAN], 1.0),
        ([REFUSED, PLAN, PLAN, REFUSED, PLAN], 0.8125),
        ([REFUSED, PLAN, REFUSED, REFUSED, REFUSED], 0.5),
        ([REFUSED, REFUSED, PLAN, PLAN, PLAN, REFUSED], 0.375),
        ([REFUSED, REFUSED, PLAN, REFUSED, LATE, REFUSED], 0.0),
    ],
)
def test_the_largest_part_of_a_margin_is_found_by_bisection(answers: list[Outcome], share: float) -> None:
    checked = check(Source("small.mission", SMALL))
    assert checked.mission is not None
    assert checked.kernel is not None
    backend = Told(answers)
    found = plan_with_margin(backend, checked.mission, checked.kernel, Options(margin=0.05), Budget(deadline=1e9))
    assert isinstance(found, Planned)
    assert found.report.kept == share
    assert len(backend.asked) == len(answers)


LATE_ONES = """mission yard
time  step 1 s, horizon 30 s
world (0, 0) to (40, 10)
region gate = box (15, 1) to (19, 5)
team cart[2] {
  vehicle  crazyflie21
  dynamics single_integrator(speed <= 3 m/s)
  start    at (2, 2), (2, 8)
}
require there: cart[0]: eventually[0, 28 s] gate
tolerate delay 2 s of cart
"""


def test_room_for_delays_is_of_the_speeds_that_vehicles_fly_before_it_is_of_those_of_the_dynamics() -> None:
    checked = check(Source("yard.mission", LATE_ONES))
    assert checked.mission is not None
    assert checked.kernel is not None
    backend = Told([REFUSED] * 60)
    plan_with_margin(backend, checked.mission, checked.kernel, Options(), Budget(deadline=1e9))
    fastest = [max(agent.dynamics.top_speed for agent in mission.agents) for mission in backend.missions]
    room = [mission.separation - checked.mission.separation for mission in backend.missions]
    flown = with_flyable_speeds(checked.mission, 1.0).agents[0].dynamics.top_speed
    assert room[0] <= 2 * flown * (1 + 1e-9)
    assert fastest[0] <= flown
    beyond = next(at for at, speed in enumerate(fastest) if speed > flown)
    assert min(room[:beyond]) == 0.0, "all shares of that room come first"
    assert max(room) > 2 * flown


CONSTANT = """mission constant
time step 1 s, horizon 3 s
world (0, 0) to (5, 5)
region base = disc at (2, 3.6) radius 0.7 m
team drone[2] { radius 0.1 m dynamics single_integrator(speed <= 1 m/s) start at (1, 1.2), (1, 0.7) }
require g: FORMULA
"""


@pytest.mark.parametrize(
    "formula", ["(every drone: not base) or false", "(every drone: x > 0.5) or (once[1 s, 1 s] some drone: base)"]
)
def test_a_backend_is_given_no_constant_beside_what_it_plans(formula: str) -> None:
    checked = check(Source("constant.mission", CONSTANT.replace("FORMULA", formula)), backend="smt")
    assert checked.mission is not None
    assert checked.kernel is not None
    backend = load_engines(("smt",), Options())
    assert not isinstance(backend, Diagnostic)
    found = plan_with_margin(backend, checked.mission, checked.kernel, Options(), Budget(time.monotonic() + 60))
    assert isinstance(found, Planned)
    assert monitor(checked.mission, checked.kernel, found.trace).requirements[0].satisfied


def test_a_requirement_that_is_constantly_false_is_impossible_for_every_backend_at_once() -> None:
    mission = check(Source("constant.mission", CONSTANT.replace("FORMULA", "(some drone: base) and false"))).mission
    assert mission is not None
    kernel, _ = expand(mission)
    assert kernel is not None
    backend = Told([])
    found = plan_with_margin(backend, mission, kernel, Options(), Budget(deadline=1e9))
    assert isinstance(found, Impossible)
    assert (found.conflict, found.scope, found.smallest) == (("g",), Scope.MISSION, True)
    assert not backend.asked


@pytest.mark.parametrize(
    ("margin", "notes"),
    [(0.3, ()), (0.5, ("robustness margin 40 cm for `goal`, not 50 cm: sizes and ranges shrink by at most half",))],
)
def test_a_margin_beyond_half_of_a_region_is_noted(margin: float, notes: tuple[str, ...]) -> None:
    checked = check(Source("small.mission", SMALL))
    planned = plan_with_margin(
        Told([PLAN]),  # type: ignore[arg-type]
        checked.valid_mission,
        checked.valid_kernel,
        Options(margin=margin),
        Budget(time.monotonic() + 60),
    )
    assert planned.report.notes == notes
