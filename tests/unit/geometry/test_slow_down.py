"""Plans flown slower: what stays of them, and what the mission says to it."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from missionc import ir
from missionc.backends.options import Options
from missionc.base.diagnostics.code import FOLDER_UNREADABLE, NEEDS_MORE_TIME
from missionc.base.source import Source
from missionc.base.trace import Trace
from missionc.base.units import Steps
from missionc.compiler import driver
from missionc.compiler.results import Compiled, InvalidMission, Verified
from missionc.geometry.slow_down import slowed
from missionc.output.folder.write_folder import write_folder
from missionc.tools.replay.reverify import reverify
from missionc.verification.verify_plan import verify
from tests.support.legal_plans import NOTHING, mission_of, pushed, straight, wandering
from tests.support.small_missions import SMALL


def longer(mission: ir.Mission, steps: int) -> ir.Mission:
    return replace(mission, steps=Steps(steps))


def test_a_whole_stretch_keeps_every_state_and_goes_straight_between_them() -> None:
    path = wandering(2, 3, 5)
    mission = longer(mission_of(path[:, 0].tolist(), 5), 15)
    found = slowed(mission, straight(path))
    assert (found.position[:, ::3] == path).all()
    assert found.position[:, 1] == pytest.approx((2 * path[:, 0] + path[:, 1]) / 3)
    assert verify(mission, NOTHING, found).passed


def test_any_other_stretch_is_at_the_plans_place_at_the_stretched_time() -> None:
    path = wandering(2, 1, 5)
    mission = longer(mission_of(path[:, 0].tolist(), 5), 8)
    found = slowed(mission, straight(path))
    times = np.arange(9) * 5 / 8
    for axis in range(2):
        assert found.position[0, :, axis] == pytest.approx(np.interp(times, np.arange(6), path[0, :, axis]))
    assert verify(mission, NOTHING, found).passed


def test_who_waits_keeps_the_plans_heading_and_who_moves_faces_where_it_goes() -> None:
    path = np.array([[[1.0, 1.0], [1.0, 1.0], [2.0, 2.0], [2.0, 1.0]]])
    plan = straight(path)
    plan = Trace(plan.step, plan.position, plan.velocity, np.array([[2.0, np.pi / 4, -np.pi / 2, -np.pi / 2]]))
    mission = longer(mission_of([[1.0, 1.0]], 3, dynamics=ir.Unicycle(0.0, 2.0, np.inf)), 6)
    found = slowed(mission, plan)
    assert found.heading[0] == pytest.approx([2.0, 2.0, np.pi / 4, np.pi / 4, -np.pi / 2, -np.pi / 2, -np.pi / 2])
    assert verify(mission, NOTHING, found).passed


@pytest.mark.parametrize("steps", [41, 47, 60, 80, 100])
def test_a_double_integrator_slowed_has_constant_accelerations_and_the_same_ends(steps: int) -> None:
    generator = np.random.default_rng(3)
    push = generator.uniform(-1, 1, (2, 40, 3))
    start = np.array([[4.0, 4.0, 4.0], [6.0, 6.0, 6.0]])
    plan = pushed(start, np.zeros((2, 3)), push, 0.1)
    mission = longer(mission_of(start.tolist(), 40, step=0.1, dynamics=ir.DoubleIntegrator(4.0, 1.8)), steps)
    found = slowed(mission, plan)
    assert verify(mission, NOTHING, found).passed
    assert (found.position[:, [0, -1]] == plan.position[:, [0, -1]]).all()
    assert found.velocity[:, -1] == pytest.approx(plan.velocity[:, -1] * 40 / steps)
    fine = np.linspace(0, 1, steps + 1)
    for axis in range(3):
        near = np.interp(fine, np.linspace(0, 1, 41), plan.position[0, :, axis])
        assert found.position[0, :, axis] == pytest.approx(near, abs=5e-3)


# ---------------------------------------------------------------- a mission


def compiled(text: str, stretch: float) -> Compiled:
    return driver.compile(Source("a.mission", text), options=Options(stretch=stretch))


@cache
def files() -> Mapping[str, bytes]:
    found = compiled(SMALL.replace("[0, 6 s]", "[0, end]"), 1.4)
    assert isinstance(found.outcome, Verified), found.findings
    assert found.checked.mission is not None
    # 8.4 steps, and whole ones are flown.
    assert found.checked.mission.steps == 9
    return found.outcome.files


def test_a_stretched_plan_is_of_a_mission_that_lasts_longer() -> None:
    plan = json.loads(dict(files())["plan.json"])
    assert plan["horizon"] == 9.0
    assert len(plan["agents"][0]["position"]) == 10
    rows = dict(files())["trajectories.csv"].decode().splitlines()
    assert rows[-1].startswith("drone[1],9.0,")


def test_a_stretched_folder_is_verified_from_its_files_alone(tmp_path: Path) -> None:
    assert write_folder(tmp_path / "out", files(), force=False) is None
    manifest = json.loads((tmp_path / "out" / "manifest.json").read_text())
    assert manifest["options"]["stretch"] == "1.4"
    assert reverify(tmp_path / "out").passed


@pytest.mark.parametrize("written", ["0.5", "inf", "nan", "much", None])
def test_a_folder_stretched_by_something_else_is_not_read(tmp_path: Path, written: str | None) -> None:
    assert write_folder(tmp_path / "out", files(), force=False) is None
    path = tmp_path / "out" / "manifest.json"
    manifest = json.loads(path.read_text())
    manifest["options"]["stretch"] = written
    path.write_text(json.dumps(manifest))
    assert [finding.code for finding in reverify(tmp_path / "out").findings] == [FOLDER_UNREADABLE]


def test_the_requirement_whose_window_ends_too_early_is_named() -> None:
    text = SMALL.replace("[0, 6 s]", "[0, 3 s]")
    assert isinstance(compiled(text, 1.0).outcome, Verified)
    found = compiled(text, 10.0)
    assert isinstance(found.outcome, InvalidMission)
    (finding,) = found.findings
    assert finding.code is NEEDS_MORE_TIME
    assert finding.message == "flown 10 times slower, the plan violates `visit`"
    assert finding.primary is not None
    assert finding.primary.span.text.startswith("require visit")


def test_dynamics_that_cannot_be_slower_are_named() -> None:
    text = SMALL.replace("[0, 6 s]", "[0, end]").replace(
        "single_integrator(speed <= 2 m/s)", "unicycle(speed 0.5..2 m/s)"
    )
    found = compiled(text, 20.0)
    (finding,) = found.findings
    assert finding.code is NEEDS_MORE_TIME
    assert finding.message == "flown 20 times slower, the plan is not valid"
    assert any(note.startswith("speed of drone[0] fails by") for note in finding.notes)
    assert (finding.help or "").startswith("allow a lower speed in `dynamics`")


def test_more_steps_than_are_allowed_are_refused_as_ever() -> None:
    found = compiled(SMALL, 1e6)
    assert [finding.code.name for finding in found.findings] == ["MC306"]
