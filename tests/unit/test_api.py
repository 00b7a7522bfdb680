"""The Python API: typed values, nothing printed, the names promised."""

from __future__ import annotations

from pathlib import Path
from typing import assert_type

import numpy as np
import pytest

import missionc
from missionc.pipeline.checked import Checked
from missionc.pipeline.results import Compiled, Monitored
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
    assert compiled.outcome.files[0][0] == "plan.json"
    assert capsys.readouterr() == ("", "")


def test_compile_of_a_conflict_names_it() -> None:
    compiled = missionc.compile(source(CONFLICT))
    assert isinstance(compiled.outcome, missionc.Impossible)
    assert compiled.outcome.conflict == ("visit", "guard", "link")
    assert compiled.outcome.scope is missionc.Scope.MISSION


def test_compile_of_a_wrong_mission_is_refused() -> None:
    assert isinstance(missionc.compile(source(WRONG)).outcome, missionc.Refused)


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


def test_every_public_name_is_there_and_no_other() -> None:
    assert all(getattr(missionc, name) is not None for name in missionc.__all__)
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        missionc.nothing  # noqa: B018
