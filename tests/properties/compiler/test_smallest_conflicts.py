"""Random small missions that cannot be: a conflict that is called smallest is, on the roadmaps that were tried.

On sampled roadmaps the planner itself is asked anew about all of a conflict but one; on lanes all joint motions are
tried.

``MISSIONC_FUZZ=60`` draws so many missions on lanes, and half as many others, instead of the few of every day.
"""

from __future__ import annotations

import os
import time
from dataclasses import replace
from itertools import islice

import pytest

from missionc.backends.api import Budget, Impossible, Planned, Report
from missionc.backends.options import Options
from missionc.backends.smt.backend import BACKEND
from missionc.backends.smt.subset_questions import SubsetQuestions, Unknown
from missionc.base.source import Source
from missionc.cli.summary import compiled_document
from missionc.compiler import driver
from missionc.compiler.front_end import Checked
from missionc.compiler.no_plan import impossible
from missionc.compiler.plan_request import PlanRequest
from missionc.compiler.results import Blame, Compiled, Explained, Trial
from tests.support.exhaustive_lanes import missions_on_lanes, satisfiable
from tests.support.random_conflicts import can_hold, is_smallest, sound_missions

MISSIONS = int(os.environ.get("MISSIONC_FUZZ", "12"))

LEAVE = """\
mission leave
time step 1 s, horizon 12 s
world (0, 0) to (14, 8)
region d0 = box (6, 3) to (8, 5)
region a = box (0.6, 3) to (1.6, 5)
region b = box (12.4, 3) to (13.4, 5)
region lawn = box (5, 6) to (9, 7.5)
team robot[2] { radius 0.2 m  dynamics single_integrator(speed <= 2 m/s)  start at (6.5, 4), (7.5, 4) }
graph radio = proximity 6 m
require rest: every robot: eventually[0, 12 s] lawn
require linked: always[0, 12 s] connected(radio)
require leave: some robot: eventually[3 s, 9 s] (d0 and eventually[1 s, 2 s] (a or b))
require home: some robot: eventually[11 s, 12 s] y <= 5
"""
"""`d0` is left in two steps of 2 m for a side that is 4.4 m away; the others ask for nothing that cannot be."""

TOGETHER = LEAVE.replace(
    "some robot: eventually[3 s, 9 s] (d0 and eventually[1 s, 2 s] (a or b))",
    "eventually[0, 3 s] ((robot[0]: lawn) and (robot[1]: lawn))\nrequire stay: always[0, 3 s] some robot: y <= 4.5",
)
"""Both are on the lawn, or one of them is not: each of the two can be kept, and not both."""


def planned(text: str, options: Options | None = None) -> Compiled:
    checked = driver.check(Source("drawn.mission", text), backend="smt")
    return planned_of(checked, options or Options())


def planned_of(checked: Checked, options: Options) -> Compiled:
    return driver.plan(checked, PlanRequest(Budget(time.monotonic() + 120), options))


@pytest.mark.usefixtures("roadmaps_alone")
def test_all_of_a_smallest_conflict_but_one_can_hold_on_the_roadmaps_and_all_of_it_cannot() -> None:
    seen = 0
    for seed, checked in islice(sound_missions(), MISSIONS // 2):
        outcome = planned_of(checked, Options()).outcome
        if isinstance(outcome, Impossible) and outcome.smallest:
            seen += 1
            assert checked.mission is not None
            assert checked.kernel is not None
            assert is_smallest(checked, outcome.conflict), f"seed {seed}: {outcome.conflict}"
            assert not can_hold(checked.mission, checked.kernel, outcome.conflict), f"seed {seed}"
    assert seen >= MISSIONS / 6


def test_on_lanes_a_conflict_has_no_joint_motion_and_all_of_it_but_one_has_where_it_is_called_smallest() -> None:
    sizes = set()
    for seed, case in islice(missions_on_lanes(), MISSIONS):
        outcome = BACKEND.plan(case.mission, case.kernel, Options(solver="auto"), Budget(time.monotonic() + 120))
        motions = case.satisfied
        if isinstance(outcome, Planned):
            assert satisfiable([each.name for each in case.mission.requirements], motions), f"seed {seed}"
            continue
        assert isinstance(outcome, Impossible), f"seed {seed}: {outcome}"
        assert not satisfiable(outcome.conflict, motions), f"seed {seed}: {outcome.conflict}"
        assert outcome.smallest, f"seed {seed}"
        sizes.add(len(outcome.conflict))
        for name in outcome.conflict:
            rest = [each for each in outcome.conflict if each != name]
            assert satisfiable(rest, motions), f"seed {seed}: {outcome.conflict} without {name}"
    assert sizes.issuperset({1, 2})


@pytest.mark.usefixtures("roadmaps_alone")
def test_what_nobody_can_satisfy_alone_is_named_without_the_innocent() -> None:
    compiled = planned(LEAVE)
    assert isinstance(compiled.outcome, Impossible)
    assert compiled.outcome.conflict == ("leave",)
    assert compiled.outcome.smallest
    document = compiled_document(compiled, "", [])
    assert (document["conflict"], document["smallest"]) == (["leave"], True)


@pytest.mark.usefixtures("roadmaps_alone")
def test_two_that_exclude_each_other_are_named_and_no_other() -> None:
    outcome = planned(TOGETHER).outcome
    assert isinstance(outcome, Impossible)
    assert outcome.conflict == ("leave", "stay")
    assert outcome.smallest


@pytest.mark.usefixtures("roadmaps_alone")
def test_a_conflict_of_which_that_was_not_found_out_says_that_it_may_not_be_smallest(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(SubsetQuestions, "ask", lambda self, names: Unknown())
    compiled = planned(TOGETHER)
    outcome = compiled.outcome
    assert isinstance(outcome, Impossible)
    assert not outcome.smallest
    assert compiled_document(compiled, "", [])["smallest"] is False
    says = "a smaller conflict may exist among these requirements"
    assert says in compiled.findings[-1].notes
    assert str(outcome).endswith(says)


@pytest.mark.usefixtures("roadmaps_alone")
def test_without_time_or_work_for_questions_the_refusal_is_still_the_answer(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(SubsetQuestions, "affordable", property(lambda self: False))
    outcome = planned(TOGETHER).outcome
    assert isinstance(outcome, Impossible)
    assert {"leave", "stay"} <= set(outcome.conflict)
    assert not outcome.smallest


def test_it_is_said_what_dropping_each_requirement_does() -> None:
    mission = driver.check(Source("leave.mission", LEAVE), backend="smt").mission
    assert mission is not None
    outcome = Impossible(("rest", "leave"), "on roadmaps they cannot hold together", Report())
    trials = (Trial("without `rest`", "impossible"), Trial("without `leave`", "planned"))
    notes = impossible(mission, outcome, Explained(Blame.REQUIREMENTS, trials)).notes
    assert "dropping `leave` gives a plan; dropping `rest` gives no plan" in notes
    nothing_helps = Explained(Blame.UNKNOWN, tuple(replace(trial, outcome="impossible") for trial in trials))
    assert "dropping `rest` or `leave` gives no plan on roadmaps" in impossible(mission, outcome, nothing_helps).notes
