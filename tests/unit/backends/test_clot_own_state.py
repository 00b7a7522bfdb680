"""Resources and flags as the transport backend plans them: stops that a schedule gets, stays that are kept, plans."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("torch")

from missionc.backends.api import Budget, NotFound
from missionc.backends.clot.backend import BACKEND, TransportRun
from missionc.backends.clot.optimise.active_set import Demand
from missionc.backends.clot.optimise.control_points import splines, trace
from missionc.backends.clot.optimise.own_state_stays import with_stays
from missionc.backends.clot.schedule.draft import WarmStart
from missionc.backends.options import Options
from missionc.base.source import Source
from missionc.base.trace import Trace
from missionc.base.units import Seconds
from missionc.compiler import driver
from missionc.compiler.results import Verified
from missionc.ir.kernel.nodes import At, Atom
from missionc.ir.language.margins.resources import flag_truths, levels
from tests.support.transport_missions import checked

DYNAMICS = {
    "single_integrator": "single_integrator(speed <= 1 m/s)",
    "double_integrator": "double_integrator(speed <= 1 m/s, acceleration <= 1 m/s^2)",
    "unicycle": "unicycle(speed 0..1 m/s)",
}
USES = {
    "a resource that lasts": "every drone: always[0, 40 s] battery >= distance(dock) / (1 m)",
    "a resource that has to be filled": "every drone: (always[0, 40 s] battery >= 2)"
    " and (eventually[0, 15 s] depot) and eventually[32 s, 40 s] depot",
    "a flag that is set": "every drone: eventually[0, 39 s] (loaded and next pack)",
    "a flag that is never set": "drone[0]: (always[0, 40 s] not loaded) and eventually[0, 40 s] pack",
    "a flag before a place": "every drone: (always[0, 40 s] (pack implies seen)) and eventually[0, 40 s] pack",
    "a flag that has to be cleared": "drone[0]: (eventually[0, 15 s] loaded)"
    " and eventually[15 s, 40 s] (dock and not loaded)",
    "both": "every drone: (always[0, 40 s] battery >= 2) and eventually[0, 40 s] (loaded and dock)",
}
OFTEN = {("single_integrator", "clot", use) for use in USES} | {("unicycle", "hybrid", "a flag that is set")}
"""Dynamics, backends and uses that are planned whenever the tests run; the others take longer together."""

CASES = [
    pytest.param(
        dynamics,
        backend,
        use,
        marks=() if (dynamics, backend, use) in OFTEN else pytest.mark.slow,
        id=f"{use} {dynamics} {backend}",
    )
    for dynamics in DYNAMICS
    for backend in ("clot", "hybrid")
    for use in USES
]


def text(require: str, dynamics: str = DYNAMICS["single_integrator"]) -> str:
    return f"""\
mission errands
time step 1 s, horizon 40 s
world (0, 0) to (8, 6)
region dock  = box (0.5, 0.5) to (2.5, 2.5)
region depot = box (5.5, 3.5) to (7.5, 5.5)
region pack  = box (5.5, 0.5) to (7.5, 2.5)
region lab   = box (0.5, 3.5) to (2.5, 5.5)
team drone[2] {{ radius 0.1 m  dynamics {dynamics}  start in dock }}
resource battery of drone {{ start 20, drain 0.5 per s, drain 1 per m, refill 4 per s in dock }}
flag loaded of drone {{ set in depot, cleared in pack }}
flag seen of drone {{ set in lab }}
require asked: {require}
"""


def begun(require: str) -> tuple[TransportRun, WarmStart]:
    """What the first attempt of a mission begins with."""
    mission, kernel = checked(text(require))
    run = TransportRun(mission, kernel, Options(), Budget(deadline=math.inf))
    return run, run.begun(0, np.random.default_rng(0))


def stops(start: WarmStart) -> list[tuple[int, str]]:
    """Whom a schedule sends where without that anything asks for it, in the order of time."""
    visits = sorted(start.schedule.appointments, key=lambda each: each.step)
    atoms = [(each.visit.event.agent, each.visit.event.chooser) for each in visits]
    return [
        (agent, atom.predicate.region.name)
        for agent, atom in atoms
        if isinstance(atom, Atom) and atom.predicate.region is not None
    ]


def trace_of(run: TransportRun, start: WarmStart) -> Trace:
    made = splines(run.mission)
    return trace(run.mission, made, made.through(start.motion))


@pytest.mark.parametrize(("dynamics", "backend", "use"), CASES)
def test_own_states_are_planned_and_verified(dynamics: str, backend: str, use: str) -> None:
    source = Source("errands.mission", text(USES[use], DYNAMICS[dynamics]))
    found = driver.compile(source, backend=backend, time_limit=Seconds(3600))
    assert isinstance(found.outcome, Verified), found.outcome


def test_whom_a_resource_lasts_makes_no_stop() -> None:
    _, start = begun("every drone: (always[0, 40 s] battery >= 1) and eventually[0, 40 s] lab")
    assert stops(start) == []


def test_whom_a_resource_does_not_last_is_sent_where_it_is_filled() -> None:
    run, start = begun(USES["a resource that has to be filled"].replace("every drone", "drone[0]"))
    assert set(stops(start)) == {(0, "dock")}
    assert levels(run.mission.resources[0], trace_of(run, start))[0].min() >= 2


def test_whom_a_flag_is_asked_of_is_sent_where_it_is_set_first() -> None:
    run, start = begun("drone[1]: eventually[0, 39 s] (loaded and next pack)")
    assert stops(start) == [(1, "depot")]
    assert flag_truths(run.mission.flags[0], trace_of(run, start))[1].any()


def test_a_stop_may_need_another_one_before_it() -> None:
    """Who may be at the depot only after the lab, and has to bring something from there, goes to both."""
    _, start = begun("drone[0]: (always[0, 40 s] (depot implies seen)) and eventually[0, 39 s] (loaded and next pack)")
    assert stops(start) == [(0, "lab"), (0, "depot")]


def test_a_flag_that_must_not_be_set_any_more_is_cleared_on_the_way() -> None:
    _, start = begun(USES["a flag that has to be cleared"])
    assert (0, "pack") in stops(start)


def test_refills_of_a_first_motion_are_kept_and_nothing_of_resources_that_nobody_asks_for() -> None:
    run, start = begun(USES["a resource that has to be filled"].replace("every drone", "drone[0]"))
    roots = tuple(goal.formula for goal in run.graph.requirements)
    demand = Demand.of(run.mission, roots, start.schedule.choices, run.mission.steps)
    made = splines(run.mission)
    kept = with_stays(demand, *made.states(made.through(start.motion))).roots[len(roots) :]
    assert any(isinstance(each, At) and each.agent == 0 for each in kept)
    run, start = begun("every drone: eventually[0, 40 s] lab")
    demand = Demand.of(run.mission, (), {}, run.mission.steps)
    assert with_stays(demand, *made.states(made.through(start.motion))) is demand


def test_a_stop_that_is_too_late_for_the_mission_is_a_late_one_and_nothing_worse() -> None:
    """Carts at a third of a metre per second are nowhere in time, and are to clean their wheels on the way."""
    path = Path(__file__).resolve().parents[3] / "missions" / "gallery" / "clean_carts.mission"
    slow = driver.check(Source("slow.mission", path.read_text().replace("speed 0..1.5 m/s", "speed 0..0.6 m/s")))
    assert slow.mission is not None
    assert slow.kernel is not None
    outcome = BACKEND.plan(slow.mission, slow.kernel, Options(), Budget(math.inf, work=0.5))
    assert isinstance(outcome, NotFound)
