"""Functions of plan folders: the results of the commands as values, from a folder or from what ``compile`` returned."""

from __future__ import annotations

import sys
from functools import cache
from inspect import signature
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import missionc
from missionc.backends.options import DESCRIBED
from tests.support.small_missions import CONFLICT, SMALL, parked


@cache
def compiled() -> missionc.Compiled:
    return missionc.compile(missionc.Mission.from_text(SMALL), seed=1, margin=0.05)


def test_a_plan_is_arrays_a_mapping_of_robustness_and_files(monkeypatch: pytest.MonkeyPatch) -> None:
    plan = compiled()
    assert plan.times.tolist() == [0, 1, 2, 3, 4, 5, 6]
    assert plan.positions.shape == plan.velocities.shape == (2, 7, 2)
    assert np.array_equal(plan.positions, plan.plan.trace.position)
    assert list(plan.robustness) == ["visit"]
    assert plan.robustness["visit"] >= 0.05
    assert plan.files["plan.json"].startswith(b"{")
    monkeypatch.setitem(sys.modules, "pandas", SimpleNamespace(DataFrame=dict))
    table = plan.to_pandas()
    assert list(table) == ["agent", "t", "x", "y", "vx", "vy"]
    assert table["agent"] == ["drone[0]"] * 7 + ["drone[1]"] * 7
    assert table["t"] == [0, 1, 2, 3, 4, 5, 6] * 2
    assert table["y"].tolist() == [*plan.positions[0, :, 1], *plan.positions[1, :, 1]]


def test_a_mission_without_a_plan_says_so() -> None:
    impossible = missionc.compile(missionc.Source("conflict.mission", CONFLICT))
    with pytest.raises(ValueError, match=r"conflict\.mission has no plan: impossible"):
        impossible.positions  # noqa: B018


def test_a_plan_is_written_verified_drawn_reported_and_exported(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "plan"
    compiled().write(folder)
    with pytest.raises(ValueError, match="MC701"):
        compiled().write(folder)
    compiled().write(folder, force=True)
    assert missionc.verify(folder).passed
    assert missionc.verify(compiled()).passed
    (folder / "plan.json").write_text("{}", encoding="utf-8")
    assert not missionc.verify(folder).passed
    assert b"<html" in missionc.report(compiled())
    assert len(missionc.report(compiled(), compiled())) > len(missionc.report(compiled()))
    assert missionc.plot(compiled(), at=(0, 3)).startswith(b"<?xml")
    with pytest.raises(ValueError, match="MC715"):
        missionc.plot(compiled(), at=(9,))
    exported = missionc.export(compiled(), "crazyswarm2")
    assert exported.findings == ()
    assert "crazyswarm2/crazyflies.yaml" in exported.files
    assert capsys.readouterr() == ("", "")


def test_a_plan_is_simulated_with_the_words_of_the_command_line() -> None:
    simulated = missionc.simulate(compiled(), trials=2, wind=(0.2, 0.1), mass_error=5)
    assert simulated.trials is not None
    assert len(simulated.trials.flights) == 2
    assert simulated.trials.trial.disturbance.mass == 0.05
    with pytest.raises(TypeError, match="`simulate` has no parameter `mass`; it has wind, mass_error"):
        missionc.simulate(compiled(), mass=5)
    with pytest.raises(ValueError, match="`mass_error` must be a number from 0 to 50, not 51"):
        missionc.simulate(compiled(), mass_error=51)
    with pytest.raises(ValueError, match="unknown engine"):
        missionc.simulate(compiled(), engine="kite")


def test_a_flight_that_does_not_fit_the_plan_is_not_replanned(tmp_path: Path) -> None:
    flown = tmp_path / "flown.csv"
    flown.write_text("agent,t,x,y\n" + parked(2).replace("drone[0]", "kite"), encoding="utf-8")
    replanned = missionc.replan(compiled(), flown)
    assert replanned.findings
    assert not replanned.files


@pytest.mark.parametrize("call", [missionc.verify, missionc.simulate, missionc.report, missionc.export])
def test_a_mission_is_no_plan(call: object) -> None:
    with pytest.raises(TypeError, match="compile a mission first"):
        call(missionc.Mission("a"))  # type: ignore[operator]


def test_a_form_that_there_is_not_is_refused() -> None:
    with pytest.raises(ValueError, match="unknown export format `kite`; use one of crazyswarm2"):
        missionc.export(compiled(), "kite")


def test_help_describes_every_option_and_a_wrong_one_is_refused() -> None:
    parameters = signature(missionc.compile).parameters
    for option in DESCRIBED.values():
        assert parameters[option.name].default == option.default
        assert f"{option.name}: {option.help}" in (missionc.compile.__doc__ or "")
    mission = missionc.Source("small.mission", SMALL)
    with pytest.raises(TypeError, match="`compile` has no parameter `margn`; did you mean `margin`"):
        missionc.compile(mission, margn=1)
    for wrong in ({"margin": -1}, {"margin": True}, {"solver": "zz"}, {"processes": 1.5}, {"certify": 1}):
        with pytest.raises(ValueError, match="not"):
            missionc.compile(mission, **wrong)  # type: ignore[arg-type]


def test_a_mission_built_in_python_is_swept(tmp_path: Path) -> None:
    text = SMALL.replace("horizon 6 s", "horizon T") + "param T = 6 s\n"
    result = missionc.sweep(
        missionc.Mission.from_text(text), {"T": ["6 s"]}, jobs=1, output=tmp_path / "sweep", margin=0.05
    )
    assert result.complete
    assert [group.values for group in result.groups] == [(("T", "6 s"),)]
    with pytest.raises(ValueError, match="MC"):
        missionc.sweep(missionc.Mission.from_text(text), {"T": ""})
    with pytest.raises(TypeError, match="no parameter"):
        missionc.sweep(missionc.Mission.from_text(text), {"T": "6 s"}, margn=1)
