"""A folder judged from its files alone: what is sound passes, and every change is refused with its reason."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Mapping
from functools import cache
from pathlib import Path

import pytest

from missionc.base.source import Source
from missionc.compiler import driver
from missionc.compiler.front_end import check
from missionc.compiler.results import Verified
from missionc.output.folder.write_folder import write_folder
from missionc.tools.replay.reverify import Reverified, reverify
from tests.support.small_missions import SMALL


@cache
def files() -> Mapping[str, bytes]:
    compiled = driver.compile(Source("a.mission", SMALL), overrides={})
    assert isinstance(compiled.outcome, Verified)
    return compiled.outcome.files


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    assert write_folder(tmp_path / "out", files(), force=False) is None
    return tmp_path / "out"


def failed(replayed: Reverified) -> set[str]:
    assert replayed.certificate is not None
    return {check.name for check in replayed.certificate.failures}


def test_what_was_written_passes(folder: Path) -> None:
    replayed = reverify(folder)
    assert replayed.passed
    assert not replayed.findings


def test_a_mission_that_includes_a_link_is_written_so_that_it_reads_back(tmp_path: Path) -> None:
    home = tmp_path / "home"
    (home / "far" / "parts").mkdir(parents=True)
    (home / "far" / "parts" / "real.mission").write_text('include "more.mission"\n')
    (home / "far" / "parts" / "more.mission").write_text("region more = box (0, 0) to (4, 4)\n")
    (home / "near").symlink_to("far/parts")
    (home / "link.mission").symlink_to("near/real.mission")
    asked = 'include "link.mission"\nrequire inside: every drone: always[0, 6 s] more\n'
    (home / "a.mission").write_text(f"{SMALL}{asked}")
    compiled = driver.compile(home / "a.mission", overrides={})
    assert isinstance(compiled.outcome, Verified)
    assert write_folder(tmp_path / "out", compiled.outcome.files, force=False) is None
    assert reverify(tmp_path / "out").passed
    assert check(tmp_path / "out" / "mission" / "a.mission").ok


def test_a_changed_requirement_is_judged_as_it_stands_now(folder: Path) -> None:
    mission = folder / "mission" / "a.mission"
    mission.write_text(mission.read_text() + "\nrequire corner: drone[0]: eventually[0, 3 s] (x >= 3.9 and y <= 0.1)\n")
    replayed = reverify(folder)
    assert failed(replayed) == {"manifest", "requirement"}
    assert [finding.code.name for finding in replayed.findings] == ["MC709"]


def test_a_plan_moved_by_hand_no_longer_fits_the_flight(folder: Path) -> None:
    plan = json.loads((folder / "plan.json").read_text())
    for position in plan["agents"][0]["position"]:
        position[0] += 0.006
    (folder / "plan.json").write_text(json.dumps(plan))
    assert {"manifest", "waypoints"} <= failed(reverify(folder))


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("manifest.json", "{"),
        ("manifest.json", "[" * 100_000),
        ("manifest.json", "{}"),
        ("manifest.json", '{"schema": "missionc.manifest/1", "inputs": {"../a": "0"}, "files": {"plan.json": "0"}}'),
        (
            "manifest.json",
            '{"schema": "missionc.manifest/1", "inputs": {"a": "0"}, "files": {"/etc/hosts": "0", "plan.json": "0"}}',
        ),
    ],
)
def test_what_is_no_folder_of_ours_is_said(folder: Path, name: str, content: str) -> None:
    (folder / name).write_text(content)
    assert [finding.code.name for finding in reverify(folder).findings] == ["MC708"]


def test_a_missing_file_is_said(folder: Path) -> None:
    (folder / "trajectories.csv").unlink()
    assert [finding.code.name for finding in reverify(folder).findings] == ["MC708"]


def test_nothing_that_plans_or_fits_is_loaded(folder: Path) -> None:
    program = (
        "import sys; from missionc.__main__ import main; sys.argv = ['missionc', 'verify', sys.argv[1]]\n"
        "try: main()\n"
        "except SystemExit as left: assert not left.code, left.code\n"
        "print(sorted({name.split('.')[0] for name in sys.modules} & {'z3', 'torch', 'piqp', 'pysat'}),"
        "[name for name in sys.modules if name.startswith("
        "('missionc.flight.trajectories.', 'missionc.geometry.curves.smooth_splines', "
        "'missionc.backends.smt.backend'))])"
    )
    ran = subprocess.run([sys.executable, "-c", program, str(folder)], capture_output=True, text=True, check=True)
    assert ran.stdout.splitlines()[-1] == "[] []"
