"""Every file of `missions/` is what the language promises: it checks, plans, verifies, and its files read back.

The missions of `missions/field`, `peers` and `strangers` take minutes each: they are checked here, and planned by
`bench/field.py`, `peers.py` and `strangers.py`; those of `missions/vehicles` by `bench/first_compiles.py`.
"""

from __future__ import annotations

import csv
import io
import json
import time
from functools import cache
from hashlib import sha256
from pathlib import Path

import numpy as np
import pytest

from missionc.backends.api import Budget
from missionc.base.limits import Limits
from missionc.base.source import Source
from missionc.cli import emit_stages, stage_names
from missionc.compiler import driver
from missionc.compiler.front_end import Checked
from missionc.compiler.plan_request import PlanRequest
from missionc.compiler.results import Verified
from missionc.frontend.syntax.parse import parse
from missionc.frontend.syntax.read_file import unread
from missionc.frontend.syntax.show_tree import show
from missionc.frontend.templates import Template, templates
from missionc.ir import Mission
from missionc.verification.monitoring.read_trace import read_trace

ROOT = Path(__file__).resolve().parents[2]
FILES = sorted((ROOT / "missions").glob("*.mission"))
GALLERY = sorted((ROOT / "missions" / "gallery").glob("*.mission"))
FIELD = [
    path for name in ("field", "peers", "strangers") for path in sorted((ROOT / "missions" / name).glob("*.mission"))
]
VEHICLES = sorted((ROOT / "missions" / "vehicles").glob("*.mission"))
LONG = (
    "base_station",
    "battery_rotation",
    "clean_barns",
    "clean_carts",
    "crop_survey",
    "delivery_round",
    "evacuation",
    "greenhouse_rounds",
    "harbour_tugs",
    "lake_sampling",
    "laser_links",
    "mapped_hall",
    "mountain_rescue",
    "museum_guard",
    "network_bringup",
    "perimeter_watch",
    "plant_crossing",
    "pylon_inspection",
    "rack_hall",
    "relay_delay",
    "sample_return",
    "solar_inspection",
    "storm_front",
    "supply_convoy",
    "warehouse_picking",
)
"""Of the gallery, what takes longer than three seconds."""

PLANNED_BY_CLOT = ("clot_visit", "clot_star", "clot_dynamic", "crazyflie_corridor")
"""The quick ones; the others are slow."""

WHOLE = ("wildfire", "wildfire_flight")
"""Without a number of agents to choose."""

PLANNED_BY_SMT = (
    *WHOLE,
    "strel_deliver",
    "strel_threat",
    "strel_escape",
    "strel_goal",
    "strel_avoid",
    "strel_avoid_all",
    "strel_avoid_one",
)


def title(path: Path) -> str:
    return path.stem


@cache
def checked_once(path: Path) -> Checked:
    return driver.check(path)


def test_a_mission_checks_without_errors(subtests: pytest.Subtests) -> None:
    assert all((FILES, GALLERY, FIELD, VEHICLES))
    for path in FILES + FIELD + VEHICLES:
        with subtests.test(title(path)):
            checked = checked_once(path)
            assert [f"{each.code.name}: {each.message}" for each in checked.findings if not each.code.warning] == []


def test_every_stage_of_a_mission_can_be_printed(subtests: pytest.Subtests) -> None:
    for path in FILES + GALLERY:
        with subtests.test(title(path)):
            checked = checked_once(path)
            texts = emit_stages.of_checked(checked, stage_names.BEFORE_PLANNING, PlanRequest(Budget(0.0)))
            assert [stage for stage, text in texts if text.strip()] == list(stage_names.BEFORE_PLANNING)


def test_a_mission_printed_and_read_again_is_the_same_mission(subtests: pytest.Subtests) -> None:
    for path in FILES + GALLERY + FIELD:
        with subtests.test(title(path)):
            checked = checked_once(path)
            assert checked.program is not None
            text = show(checked.program)
            again, findings = parse(Source("again.mission", text), Limits(), unread)
            assert findings == []
            assert again is not None
            assert show(again) == text


@pytest.mark.parametrize("path", [path for path in FILES if path.stem not in PLANNED_BY_SMT], ids=title)
def test_a_mission_for_transport_chooses_clot(path: Path) -> None:
    checked = checked_once(path)
    assert checked.choice is not None
    assert checked.choice.backend in ("clot", "hybrid")


@pytest.mark.parametrize("name", PLANNED_BY_SMT)
def test_a_mission_plans_verifies_and_reads_back_for_three_agents(name: str) -> None:
    compiled_and_read_back(ROOT / "missions" / f"{name}.mission", {} if name in WHOLE else {"N": "3"})


@pytest.mark.parametrize("name", PLANNED_BY_CLOT)
def test_a_mission_for_transport_plans_verifies_and_reads_back(name: str) -> None:
    pytest.importorskip("torch")
    compiled_and_read_back(ROOT / "missions" / f"{name}.mission", {})


def test_a_mission_that_needs_both_halves_plans_verifies_and_reads_back() -> None:
    """Hops and a total tolerance: neither roadmaps nor transport offer both."""
    pytest.importorskip("torch")
    path = Path(__file__).parent / "relay.mission"
    checked = driver.check(path)
    assert checked.choice is not None
    assert checked.choice.backend == "hybrid"
    compiled_and_read_back(path, {})


@pytest.mark.parametrize(
    "path",
    [pytest.param(path, marks=pytest.mark.slow) if path.stem in LONG else path for path in GALLERY],
    ids=title,
)
def test_a_mission_of_the_gallery_plans_verifies_and_reads_back(path: Path) -> None:
    compiled_and_read_back(path, {})


@pytest.mark.parametrize("template", templates().values(), ids=lambda template: template.name)
def test_a_template_plans_verifies_and_reads_back_under_another_name(template: Template, tmp_path: Path) -> None:
    path = tmp_path / "mine.mission"
    path.write_text(template.named("mine"), encoding="utf-8")
    compiled_and_read_back(path, {})


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.parametrize("path", GALLERY, ids=title)
def test_a_mission_of_the_gallery_plans_for_other_seeds(path: Path, seed: int) -> None:
    compiled_and_read_back(path, {}, seed)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("path", [path for path in FILES if path.stem not in PLANNED_BY_SMT], ids=title)
def test_a_mission_for_transport_plans_for_several_seeds(path: Path, seed: int) -> None:
    pytest.importorskip("torch")
    compiled_and_read_back(path, {}, seed)


@pytest.mark.slow
@pytest.mark.parametrize("agents", [5, 8, 10])
@pytest.mark.parametrize("name", PLANNED_BY_SMT[len(WHOLE) :])
def test_a_mission_plans_verifies_and_reads_back_for_more_agents(name: str, agents: int) -> None:
    compiled_and_read_back(ROOT / "missions" / f"{name}.mission", {"N": str(agents)})


def compiled_and_read_back(path: Path, overrides: dict[str, str], seed: int = 0) -> None:
    checked = driver.check(path, overrides=overrides)
    assert checked.mission is not None
    assert checked.choice is not None
    if checked.choice.backend != "smt":
        pytest.importorskip("torch")
    compiled = driver.plan(checked, PlanRequest(Budget(time.monotonic() + 240, seed=seed)))
    assert isinstance(compiled.outcome, Verified), [finding.message for finding in compiled.findings]
    assert compiled.outcome.certificate.passed
    files = dict(compiled.outcome.files)
    plan_reads_back(files["plan.json"].decode(), checked.mission, compiled.outcome)
    trajectories_read_back(files["trajectories.csv"].decode(), checked.mission)
    for path, content in files.items():
        if path.startswith("crazyflie/"):
            polynomials_read_back(content.decode(), checked.mission)
    certificate = json.loads(files["certificate.json"])
    assert certificate["passed"] is True
    assert all(check["passed"] for check in certificate["checks"])
    listed = json.loads(files["manifest.json"])["files"]
    assert listed == {path: sha256(content).hexdigest() for path, content in files.items() if path != "manifest.json"}


def plan_reads_back(text: str, mission: Mission, outcome: Verified) -> None:
    """To the very same numbers, and to a trace that the monitor is content with."""
    trace, findings = read_trace(Source("plan.json", text), mission)
    assert findings == []
    assert trace is not None
    assert np.array_equal(trace.position, outcome.plan.trace.position)
    assert all(requirement["satisfied"] for requirement in json.loads(text)["requirements"])


def trajectories_read_back(text: str, mission: Mission) -> None:
    rows = list(csv.DictReader(io.StringIO(text)))
    assert len(rows) == len(mission.agents) * (mission.steps + 1)
    assert all(np.isfinite([float(value) for key, value in row.items() if key != "agent"]).all() for row in rows)
    read, findings = read_trace(Source("trajectories.csv", text), mission)
    assert findings == []
    assert read is not None


def polynomials_read_back(text: str, mission: Mission) -> None:
    rows = list(csv.reader(io.StringIO(text)))
    header, pieces = rows[0], np.array([[float(word) for word in row if word] for row in rows[1:]])
    assert header[0].strip().lower() == "duration"
    assert pieces.shape[1] == 33
    assert pieces[:, 0].sum() == pytest.approx(mission.horizon, abs=1e-3)
