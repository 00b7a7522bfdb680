"""The hybrid backend: what it asks of a roadmap, what it keeps of the answer, and what it answers itself."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("torch")

from missionc.backends.api import Impossible, NotFound, Outcome, Reason, Report
from missionc.backends.hybrid.backend import Clock, discrete, on_clock, positions
from missionc.backends.smt.backend import SmtBackend
from missionc.base.continuous_time import ContinuousTime
from missionc.base.diagnostics.code import IMPOSSIBLE
from missionc.base.source import Source
from missionc.base.trace import Trace
from missionc.base.units import Seconds
from missionc.compiler import driver
from missionc.compiler.results import Compiled, Verified
from missionc.ir import Mission, Objective
from missionc.ir.kernel.analysis import steps_ahead
from missionc.ir.kernel.nodes import Always, At, Goal, Is, Kernel, Until
from missionc.ir.kernel.walk import children
from tests.support.random_runs import SPAN

RELAY = """\
mission relay
time step 0.5 s, horizon 8 s
world (0, 0) to (6, 5)
region base = box (0.3, 0.3) to (2.3, 2.3)
region wreck = box (3.4, 3) to (5, 4.5)
team drone[3] { radius 0.1 m  dynamics single_integrator(speed <= 2 m/s)  start in base }
graph radio = proximity 1.6 m
separation 0.1 m
formation row = line of drone spacing 0.6 m total tolerance 0.15 m
require relay:  every drone: always[0, 8 s] (wreck implies somewhere[hops 0..2 on radio] base)
require rescue: some drone: eventually[0, 5 s] wreck
require show:   eventually[5 s, 7 s] always[0, 1 s] row
"""


def compiled(
    text: str, *, limit: float = 200.0, seed: int = 0, throughout: ContinuousTime = ContinuousTime.WANTED
) -> Compiled:
    return driver.compile(Source("a.mission", text), seed=seed, time_limit=Seconds(limit), continuous_time=throughout)


def meant(text: str) -> tuple[Mission, Kernel]:
    checked = driver.check(Source("a.mission", text))
    assert checked.mission is not None
    assert checked.kernel is not None, checked.findings
    return checked.mission, checked.kernel


def test_hops_and_a_total_tolerance_are_planned_together_by_auto() -> None:
    outcome = compiled(RELAY).outcome
    assert isinstance(outcome, Verified), outcome
    assert outcome.plan.backend == "hybrid"
    assert outcome.certificate.passed
    assert "discrete" in dict(outcome.report.seconds)
    *on_roadmap, last = outcome.plan.solved
    assert {each.by for each in on_roadmap} <= {"z3", "cadical", "search"}
    assert sorted(name for each in on_roadmap for name in each.agents) == sorted(last.agents)
    assert last.by == "polish"


def test_the_same_seed_gives_the_same_bytes() -> None:
    first, again = (compiled(RELAY, seed=5, throughout=ContinuousTime.AT_STEPS).outcome for _ in range(2))
    assert isinstance(first, Verified)
    assert isinstance(again, Verified)
    assert first.files == again.files


def refuse(*asked: object) -> Outcome:
    return Impossible(("relay",), "on roadmaps of 9 nodes `relay` cannot be satisfied", Report())


def test_what_a_roadmap_refuses_is_left_to_the_transport(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(SmtBackend, "plan", refuse)
    outcome = compiled(RELAY.replace("(3.4, 3) to (5, 4.5)", "(2.5, 1) to (3.5, 2)")).outcome
    assert isinstance(outcome, Verified), outcome
    assert any("on roadmaps of 9 nodes `relay` cannot be satisfied" in note for note in outcome.report.notes)


@pytest.mark.usefixtures("coarse_covers")
def test_what_is_not_found_is_undecided_with_what_both_halves_say(monkeypatch: pytest.MonkeyPatch) -> None:
    """A roadmap's refusal is about its nodes, and a candidate that fails is about itself: neither is a proof."""
    monkeypatch.setattr(SmtBackend, "plan", refuse)
    far = "require far: always[0, 7 s] (not row or distance(drone[0], drone[1]) >= 2)\n"
    found = compiled(RELAY + far, limit=6.0)
    assert isinstance(found.outcome, NotFound)
    assert found.outcome.reason in (Reason.TIME, Reason.SOLVER)
    assert "the best candidate violates" in found.outcome.statement
    assert "on roadmaps of 9 nodes `relay` cannot be satisfied" in found.outcome.statement
    assert found.outcome.best is not None
    assert [each.name for each in found.outcome.best.requirements] == ["relay", "rescue", "show", "far"]
    assert IMPOSSIBLE not in {finding.code for finding in found.findings}


def test_no_time_is_an_answer() -> None:
    found = compiled(RELAY, limit=0.0)
    assert isinstance(found.outcome, NotFound)
    assert found.outcome.reason is Reason.TIME


def test_only_what_is_measured_is_left_out_for_the_roadmap() -> None:
    mission, kernel = meant(RELAY)
    asked = discrete(kernel, mission.steps, mission.steps)
    assert [goal.name for goal in asked.kernel.requirements] == ["relay", "rescue"]
    assert asked.whole == {"relay", "rescue"}


def test_a_requirement_keeps_the_part_that_is_not_measured() -> None:
    mission, kernel = meant(RELAY.replace("] row", "] (row and some drone: base)"))
    asked = discrete(kernel, mission.steps, mission.steps)
    assert [goal.name for goal in asked.kernel.requirements] == ["relay", "rescue", "show"]
    assert "show" not in asked.whole


def test_a_formation_that_must_not_be_is_no_obstacle_either() -> None:
    mission, kernel = meant(RELAY.replace("eventually[5 s, 7 s] always[0, 1 s] row", "always[0, 7 s] not row"))
    assert [goal.name for goal in discrete(kernel, mission.steps, mission.steps).kernel.requirements] == [
        "relay",
        "rescue",
    ]


@pytest.mark.parametrize(
    ("low", "high", "every", "expected"),
    [
        (5, 11, True, (1, 3)),
        (5, 11, False, (2, 2)),
        (0, 16, True, (0, 4)),
        (5, 7, False, (1, 1)),
        (4, None, True, (1, None)),
    ],
)
def test_windows_grow_for_every_step_and_shrink_for_some(
    low: int, high: int | None, every: bool, expected: tuple[int, int | None]
) -> None:
    """Sixteen steps, four ticks."""
    assert Clock(16, 4).window(low, high, every) == expected


def test_windows_never_look_beyond_the_last_tick() -> None:
    _, kernel = meant(RELAY.replace("always[0, 8 s] (wreck", "always[0, 4 s] always[0, 4 s] (wreck"))
    for ticks in range(1, 16):
        for goal in discrete(kernel, 16, ticks).kernel.requirements:
            assert steps_ahead([goal.formula])[goal.formula] <= ticks


def test_what_is_held_until_then_is_asked_one_step_less_far() -> None:
    base, field = Is(frozenset((0,))), Is(frozenset((1,)))
    formula = Until(Always(base, 0, 9), field, 0, 8)
    kernel = Kernel((Goal("hold", At(0, formula), SPAN),), ())
    (goal,) = discrete(kernel, 16, 4).kernel.requirements
    (until,) = children(goal.formula)
    assert isinstance(until, Until)
    assert isinstance(until.hold, Always)
    assert (until.hold.high, until.high) == (3, 2), "no narrower, since both end with the fourth tick"


def test_a_motion_on_a_coarse_clock_is_read_between_its_ticks() -> None:
    text = RELAY.replace(
        "single_integrator(speed <= 2 m/s)", "double_integrator(speed <= 2 m/s, acceleration <= 1 m/s^2)"
    )
    for mission, half in ((meant(RELAY)[0], 0.5), (meant(text)[0], 0.25)):
        place = np.zeros((3, 5, 2))
        place[:, 1:, 0] = 1.0, 3.0, 5.0, 7.0
        speed = np.zeros_like(place)
        speed[:, 1:, 0] = 1.0  # from rest, evenly faster: half way in time is a quarter of the way
        found = positions(mission, Trace(Seconds(2.0), place, speed, np.zeros((3, 5))))
        assert found.shape == (3, 17, 2)
        assert found[0, 2, 0] == pytest.approx(half)
        assert np.array_equal(found[:, ::4], place)


def test_nothing_is_preferred_or_made_least_on_the_roadmap() -> None:
    mission, _ = meant(RELAY + "minimize energy\n")
    asked = on_clock(mission, 4)
    assert (asked.step, asked.steps, asked.objective) == (2.0, 4, Objective.NONE)
    assert asked.horizon == mission.horizon
