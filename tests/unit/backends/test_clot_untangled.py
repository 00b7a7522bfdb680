"""A motion on the border between a margin and its opposite: one of them is given up, the one that is dearer."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("torch")

from missionc.backends.api import Budget, Planned
from missionc.backends.clot.backend import BACKEND
from missionc.backends.clot.cost_graph.cost_graph import build
from missionc.backends.clot.optimise.active_set import Demand
from missionc.backends.clot.schedule.geodesics import Geodesics
from missionc.backends.clot.schedule.schedule import Scheduler
from missionc.backends.clot.schedule.tasks import outline
from missionc.backends.options import Options
from missionc.base.trace import Array
from missionc.compiler import driver
from missionc.ir import Inside
from tests.support import transport_missions

TORN = """\
mission torn
time step 0.5 s, horizon 1 s
world (0, 0) to (20, 10)
region park = box (8, 2) to (12, 8)
region near = box (8, 8.5) to (12, 9.5)
region far  = box (0, 2) to (1, 8)
team cart[1] { radius 0.1 m  dynamics single_integrator(speed <= 3 m/s)  start in park }
require inside:  every cart: always[0, 1 s] (park or OTHER)
require outside: every cart: always[0, 1 s] (ANOTHER or not park)
"""


def demand(other: str, another: str) -> Demand:
    return transport_missions.costs_and_demand(TORN.replace("ANOTHER", another).replace("OTHER", other))[1]


def asked(made: Demand, position: Array) -> set[tuple[str, bool]]:
    active = made.active(position, np.zeros_like(position)).margins
    signed = [each for each, mask in active.items() if mask.any()]
    return {(what.region.name, holds) for what, holds in signed if isinstance(what, Inside)}


def at(x: float, y: float) -> Array:
    """The only robot, at one place for all steps."""
    return np.full((1, 3, 2), (x, y))


@pytest.mark.parametrize(
    ("other", "another", "kept"),
    [
        ("far", "near", {("park", True), ("near", True)}),
        ("near", "far", {("near", True), ("park", False)}),
    ],
)
def test_of_the_two_sides_the_one_that_costs_less_is_kept(
    other: str, another: str, kept: set[tuple[str, bool]]
) -> None:
    border = at(10.0, 8.0)
    made = demand(other, another)
    assert {("park", True), ("park", False)} <= asked(made, border)
    untangled = made.untangled(border, np.zeros_like(border))
    assert untangled is not None
    assert asked(untangled, border) == kept
    assert untangled.untangled(border, np.zeros_like(border)) is None


def test_nothing_is_given_up_where_nothing_contradicts() -> None:
    inside = at(10.0, 8.9)
    assert demand("near", "near").untangled(inside, np.zeros_like(inside)) is None


def test_a_mission_whose_robots_get_stuck_on_a_border_is_planned_at_once() -> None:
    found = driver.check(Path(__file__).resolve().parents[3] / "missions" / "clot_star.mission")
    assert found.mission is not None
    assert found.kernel is not None
    for seed in (5, 7):
        outcome = BACKEND.plan(found.mission, found.kernel, Options(), Budget(time.monotonic() + 120, seed=seed))
        assert isinstance(outcome, Planned)
        assert dict(outcome.report.sizes)["attempts"] == 1


def test_what_is_scheduled_rules_out_its_opposite_at_each_step_that_names_it() -> None:
    visit = "require visit: every cart: eventually[0, 0.5 s] (park and next park)\n"
    text = TORN.replace("start in park", "start at (10, 5)").replace("ANOTHER", "near").replace("OTHER", "far") + visit
    mission, kernel = transport_missions.checked(text)
    graph = build(kernel)
    scheduler = Scheduler(mission, outline(graph, mission.steps), Geodesics(mission), np.random.default_rng(0))
    choices = scheduler.schedule(0.0).choices
    made = Demand.of(mission, tuple(each.formula for each in graph.requirements), choices, mission.steps)
    (denied,) = (mask for (what, holds), mask in made.ruled_out.items() if isinstance(what, Inside) and not holds)
    assert denied.sum() == 2
