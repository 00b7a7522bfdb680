"""Exports: found by name, in the manifest, the same bytes from the same flight, and only of what is verified."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from missionc.base.diagnostics.code import EXTRA_MISSING, NOT_EXPORTED
from missionc.base.diagnostics.model import Diagnostic
from missionc.base.source import Source
from missionc.cli.app import main
from missionc.compiler import driver
from missionc.compiler.results import Verified
from missionc.flight.trajectories.crazyflie import Flyable, crazyflie
from missionc.output.export import export_form as form_module
from missionc.output.export.formats import FORMATS, Exported, flight
from tests.support.hand_made_flights import wandered
from tests.support.legal_plans import NOTHING, mission_of, straight
from tests.support.output_folders import content, unlisted
from tests.support.small_missions import SMALL

NAMES = sorted(FORMATS)


@pytest.fixture
def compiled(tmp_path: Path) -> Path:
    (tmp_path / "small.mission").write_text(SMALL)
    words = ["compile", str(tmp_path / "small.mission"), "-o", str(tmp_path / "out"), "--quiet"]
    assert main([*words, "--export", "crazyswarm2,cflib", "--export", "skybrush"]) == 0
    return tmp_path / "out"


def test_what_is_compiled_with_exports_has_them_in_its_manifest_and_is_verified(compiled: Path) -> None:
    manifest = json.loads((compiled / "manifest.json").read_text())
    assert manifest["options"]["export"] == "crazyswarm2,cflib,skybrush"
    exported = {name for name in manifest["files"] if name.startswith("export/")}
    assert exported == {f"export/{name}" for name in content(compiled / "export")}
    assert {name.split("/")[1] for name in exported} == {"crazyswarm2", "cflib", "skybrush"}
    assert main(["verify", str(compiled)]) == 0
    (compiled / "export" / "cflib" / "fly.py").write_text("import os\n")
    assert main(["verify", str(compiled)]) == 5


def test_a_compiled_folder_is_exported_to_the_same_bytes(compiled: Path, tmp_path: Path) -> None:
    assert main(["export", str(compiled), "skybrush", "cflib", "crazyswarm2", "-o", str(tmp_path / "other")]) == 0
    assert unlisted(tmp_path / "other") == content(compiled / "export")
    assert main(["export", str(compiled), "px4"]) == 0
    assert set(unlisted(tmp_path / "out-export")) == {"px4/Drone 1.csv", "px4/Drone 2.csv", "px4/README.md"}


def test_an_export_folder_is_replaced_by_force_only(compiled: Path, tmp_path: Path) -> None:
    assert main(["export", str(compiled), "px4"]) == 0
    assert main(["export", str(compiled), "ros2"]) == 1
    assert main(["export", str(compiled), "ros2", "--force"]) == 0
    assert set(unlisted(tmp_path / "out-export")) == {"ros2/trajectory.yaml"}


def test_what_is_not_verified_is_not_exported(
    compiled: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = compiled / "crazyflie" / "drone0.csv"
    path.write_text(path.read_text().replace("1.", "1.1", 1))
    capsys.readouterr()
    assert main(["export", str(compiled), "px4", "--format", "json"]) == 5
    document = json.loads(capsys.readouterr().out)
    assert [each["code"] for each in document["diagnostics"]] == ["MC709"]
    assert document["output"] is None
    assert not (tmp_path / "out-export").exists()


def test_a_folder_that_cannot_be_read_is_not_exported(tmp_path: Path) -> None:
    assert main(["export", str(tmp_path), "px4"]) == 1


@pytest.mark.parametrize("words", [["export", ".", "crazswarm2"], ["compile", "a.mission", "--export", "crazswarm2"]])
def test_an_unknown_name_is_answered_with_the_nearest(words: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    Path("a.mission").touch() if words[1] == "a.mission" and not Path("a.mission").exists() else None
    try:
        assert main(words) == 2
    finally:
        Path("a.mission").unlink(missing_ok=True)
    assert "unknown export `crazswarm2`; did you mean `crazyswarm2`?" in capsys.readouterr().err


def test_the_list_has_every_name_and_what_it_is(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["export", "--list"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in lines] == list(FORMATS)
    assert all(form.says in line for (_, form), line in zip(FORMATS.items_built_in(), lines, strict=True))


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("dimension", [2, 3])
def test_the_same_flight_gives_the_same_bytes(name: str, dimension: int) -> None:
    made = [FORMATS[name].export(wandered(dimension=dimension)) for _ in range(2)]
    assert isinstance(made[0], Exported)
    assert made[0] == made[1]


def test_a_missing_package_is_said_before_anything_else(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(form_module, "find_spec", lambda name: None)
    finding = FORMATS["mcap"].export(wandered())
    assert isinstance(finding, Diagnostic)
    assert finding.code is EXTRA_MISSING
    assert "missionc[export]" in finding.help
    assert FORMATS["px4"].missing() is None


def test_a_form_that_cannot_hold_the_flight_costs_only_itself() -> None:
    """Two that start one above the other cannot rise from the floor at once; their polynomials are sound."""
    pytest.importorskip("torch")
    tower = """\
mission tower
time step 1 s, horizon 3 s
world (0, 0, 0) to (4, 4, 4)
team drone[2] {
  radius 0.1 m
  dynamics single_integrator(speed <= 2 m/s)
  start at (1, 1, 1), (1, 1, 2)
  finish at (2, 1, 1), (3, 3, 2)
}
solve with clot
"""
    compiled = driver.compile(Source("a.mission", tower), exports=("crazyswarm2", "ros2"))
    assert isinstance(compiled.outcome, Verified)
    names = {name for name in compiled.outcome.files if name.startswith("export/")}
    assert names == {"export/ros2/trajectory.yaml"}
    (finding,) = [each for each in compiled.findings if each.code is NOT_EXPORTED]
    assert "`drone[0]` and `drone[1]` cannot take off together, one above the other" in finding.message


def test_landing_one_above_the_other_is_refused() -> None:
    path = np.array([[[1.0, 1, 1], [2, 2, 1], [3, 3, 1]], [[5.0, 1, 2], [4, 2, 2], [3, 3, 2]]])
    mission, trace = mission_of(path[:, 0].tolist(), 2), straight(path)
    found = crazyflie(mission, NOTHING, trace)
    assert isinstance(found, Flyable)
    for name in ("crazyswarm2", "cflib"):
        finding = FORMATS[name].export(flight(mission, NOTHING, trace, found.files))
        assert isinstance(finding, Diagnostic)
        assert "cannot land together, one above the other" in finding.message
