"""The Python API: typed values, nothing printed, the names promised."""

from __future__ import annotations

from pathlib import Path
from typing import assert_type

import numpy as np
import pytest

import missionc
from missionc.compiler.front_end import Checked
from missionc.compiler.results import Compiled, Monitored
from tests.support.small_missions import CONFLICT, SMALL, WRONG, parked


def source(text: str) -> missionc.Source:
    return missionc.Source("small.mission", text)


def test_check_gives_findings_and_the_mission_as_meant(capsys: pytest.CaptureFixture[str]) -> None:
    checked = assert_type(missionc.check(source(SMALL)), Checked)
    assert checked.ok
    assert checked.findings == ()
    assert checked.mission is not None
    assert checked.mission.name == "small"
    assert capsys.readouterr() == ("", "")


def test_check_of_a_wrong_mission_gives_no_mission() -> None:
    checked = missionc.check(source(WRONG))
    assert not checked.ok
    assert [finding.code.name for finding in checked.findings] == ["MC101"]
    assert checked.mission is None


def test_compile_gives_a_verified_plan_and_its_files(capsys: pytest.CaptureFixture[str]) -> None:
    compiled = assert_type(missionc.compile(source(SMALL)), Compiled)
    assert isinstance(compiled.outcome, missionc.Verified)
    plan = compiled.outcome.plan
    assert plan.trace.position.shape == (2, 7, 2)
    assert [(each.name, each.satisfied) for each in plan.judgements] == [("visit", True)]
    assert compiled.outcome.certificate.passed
    assert "plan.json" in compiled.outcome.files
    assert capsys.readouterr() == ("", "")


def test_compile_of_a_conflict_names_it() -> None:
    compiled = missionc.compile(source(CONFLICT))
    assert isinstance(compiled.outcome, missionc.Impossible)
    assert compiled.outcome.conflict == ("visit", "guard", "link")
    assert compiled.outcome.scope is missionc.Scope.MISSION


def test_compile_of_a_wrong_mission_is_refused() -> None:
    assert isinstance(missionc.compile(source(WRONG)).outcome, missionc.InvalidMission)


def test_compile_tells_a_listener_how_far_it_is() -> None:
    heard: list[missionc.Progress] = []
    missionc.compile(source(SMALL), listen=heard.append)
    assert [progress.stage for progress in heard][-2:] == ["verify", "emit"]


def test_a_seed_decides_the_plan() -> None:
    def positions(seed: int) -> np.ndarray:
        outcome = missionc.compile(source(SMALL), seed=seed).outcome
        assert isinstance(outcome, missionc.Verified)
        return outcome.plan.trace.position

    assert np.array_equal(positions(5), positions(5))
    assert not np.array_equal(positions(5), positions(6))


def test_monitor_judges_a_trace_as_often_as_it_is_asked(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    trace = tmp_path / "parked.csv"
    trace.write_text(parked())
    for _ in range(2):
        judged = assert_type(missionc.monitor(source(SMALL), trace), Monitored)
        assert judged.ok
        assert not judged.satisfied
        assert judged.requirements[0].robustness < 0
    assert capsys.readouterr() == ("", "")


SLOW = """mission slow
time  step 1 s, horizon 3 s
world (0, 0) to (10, 10)
region goal = box (8, 0) to (9, 2)
agent cart { radius 0.2 m  dynamics single_integrator(speed <= 1 m/s)  start at (1, 1) }
require go: cart: eventually[0, 3 s] goal
"""
NEVER = SLOW.replace("eventually[0, 3 s] goal", "always[0, 3 s] goal")
"""Of the first, no plan gets there in time; of the second, no start is in the goal."""


@pytest.mark.parametrize(("text", "satisfied", "code"), [(SLOW, True, "MC509"), (NEVER, False, "MC510")])
def test_a_trace_is_judged_whatever_can_be_planned(text: str, satisfied: bool, code: str, tmp_path: Path) -> None:
    flown = tmp_path / "flown.csv"
    flown.write_text("agent,t,x,y\n" + "".join(f"cart,{t},{x},1\n" for t, x in enumerate((1, 3.5, 6, 8.5))))
    judged = missionc.monitor(source(text), flown)
    assert judged.ok
    assert all(each.satisfied for each in judged.requirements) is satisfied
    # The cart is as fast as the plan that there is not.
    assert [each.name for each in judged.constraints if each.satisfied is False] == ["speed"]
    assert judged.findings[0].code.name == code
    assert {finding.severity for finding in judged.findings} == {missionc.Severity.WARNING}
    assert not missionc.check(source(text)).ok


def test_a_mission_without_a_meaning_judges_no_trace(tmp_path: Path) -> None:
    flown = tmp_path / "flown.csv"
    flown.write_text("agent,t,x,y\ncart,0,1,1\n")
    judged = missionc.monitor(source(SLOW.replace("[0, 3 s]", "[0, 4 s]")), flown)
    assert [finding.code.name for finding in judged.findings] == ["MC301"]
    assert not judged.ok
    assert judged.satisfied is None


BORDER = """mission border
time  step 1 s, horizon 3 s
world (0, 0) to (10, 10)
region dock = box (4, 4) to (5, 5)
agent cart { dynamics single_integrator(speed <= 5 m/s)  start in dock }
require stay: cart: always[0, 3 s] dock
"""


@pytest.mark.parametrize(
    ("places", "satisfied"),
    [
        ([(5, 5)] * 4, True),  # at rest on the border, which belongs to the dock
        ([(5, 4), (5, 4.5), (5, 5), (5, 4)], None),  # along it, where rounding decides
        ([(5, 5), (5, 5), (6, 5), (5, 5)], False),
    ],
)
def test_between_the_steps_there_are_three_answers(
    places: list[tuple[float, float]], satisfied: bool | None, tmp_path: Path
) -> None:
    flown = tmp_path / "flown.csv"
    flown.write_text("agent,t,x,y\n" + "".join(f"cart,{t},{x},{y}\n" for t, (x, y) in enumerate(places)))
    judged = missionc.monitor(source(BORDER), flown, continuous=True)
    assert judged.satisfied is satisfied


def test_every_public_name_is_there_and_no_other() -> None:
    assert all(getattr(missionc, name) is not None for name in missionc.__all__)
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        missionc.nothing  # noqa: B018
