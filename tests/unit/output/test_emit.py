"""What is in the output folder, and that the same plan gives the same bytes."""

from __future__ import annotations

import hashlib
import json
import math
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest

from missionc import ir
from missionc.base.diagnostics.model import Diagnostic
from missionc.base.trace import Judgement, Plan
from missionc.output.documents.certificate_json import certificate_json
from missionc.output.documents.plan_json import plan_json
from missionc.output.documents.trajectories_csv import trajectories
from missionc.output.folder.file_names import file_names
from missionc.output.output_files import Output, Provenance, emit
from missionc.verification.verify_plan import Certificate, Check, Figure, verify
from tests.support.legal_plans import NOTHING, SPAN, mission_of, planned, straight

PATH = [[[1.0, 1.0], [2.0, 1.0], [3.0, 1.0]], [[1.0, 2.0], [2.0, 2.9], [3.0, 3.1]]]
MISSION = mission_of([path[0] for path in PATH], 2)
PROVENANCE = Provenance((("made.mission", b"mission made\n"),), (("solver", "z3"), ("-D T", "30 s")))


@cache
def output() -> Output:
    trace = straight(PATH)
    found = emit(MISSION, NOTHING, planned(MISSION, trace), verify(MISSION, NOTHING, trace), PROVENANCE)
    assert isinstance(found, Output)
    return found


def files() -> dict[str, bytes]:
    return dict(output().files)


def loaded(name: str) -> Any:
    return json.loads(files()[name])


def test_the_folder_holds_what_the_reference_lists() -> None:
    assert list(files()) == [
        "plan.json",
        "trajectories.csv",
        "crazyflie/drone0.csv",
        "crazyflie/drone1.csv",
        "mission/made.mission",
        "certificate.json",
        "report.html",
        "manifest.json",
    ]


def test_the_same_plan_gives_the_same_bytes() -> None:
    trace = straight(PATH)
    again = emit(MISSION, NOTHING, planned(MISSION, trace), verify(MISSION, NOTHING, trace), PROVENANCE)
    assert isinstance(again, Output)
    assert again.files == output().files


def test_the_plan_has_the_documented_form() -> None:
    plan = loaded("plan.json")
    assert plan["schema"] == "missionc.plan/1"
    assert (plan["mission"], plan["backend"], plan["seed"]) == ("made", "smt", 0)
    assert (plan["step"], plan["horizon"], plan["times"]) == (1.0, 2.0, [0.0, 1.0, 2.0])
    first = plan["agents"][0]
    assert (first["name"], first["team"], first["radius"]) == ("drone[0]", "drone", 0.1)
    assert first["position"] == PATH[0]
    assert first["velocity"] == [[1.0, 0.0]] * 3
    assert first["yaw"] == [0.0, 0.0, 0.0]


def test_links_are_strictly_closer_than_the_radius() -> None:
    path = [[[1.0, 1.0], [1.0, 1.0], [1.0, 1.0]], [[1.0, 2.9], [1.0, 3.0], [1.0, 3.1]]]
    plan = json.loads(plan_json(MISSION, planned(MISSION, straight(path))))
    assert plan["graphs"] == {"radio": [[[0, 1]], [], []]}


def test_a_robustness_that_nothing_bounds_is_null() -> None:
    judgements = (Judgement("always", True, math.inf), Judgement("near", True, 0.12))
    plan = Plan("made", "smt", 0, straight(PATH), judgements)
    assert json.loads(plan_json(MISSION, plan))["requirements"] == [
        {"name": "always", "satisfied": True, "robustness": None},
        {"name": "near", "satisfied": True, "robustness": 0.12},
    ]


def test_trajectories_fly_a_plane_mission_at_its_altitude() -> None:
    mission = mission_of([path[0] for path in PATH], 2, altitude=1.5)
    lines = trajectories(mission, straight(PATH)).splitlines()
    assert lines[0] == "agent,t,x,y,z,vx,vy,vz,yaw"
    assert lines[2] == "drone[0],1.0,2.0,1.0,1.5,1.0,0.0,0.0,0.0"
    assert len(lines) == 1 + 2 * 3


def test_trajectories_of_a_volume_have_their_own_heights() -> None:
    path = [[[1.0, 1.0, 1.0], [2.0, 1.0, 1.5]]]
    lines = trajectories(mission_of([path[0][0]], 1), straight(path)).splitlines()
    assert lines[2] == "drone[0],1.0,2.0,1.0,1.5,1.0,0.0,0.5,0.0"


def test_the_manifest_knows_every_file_and_input() -> None:
    manifest = loaded("manifest.json")
    others = {name: content for name, content in files().items() if name != "manifest.json"}
    assert manifest["files"] == {name: hashlib.sha256(content).hexdigest() for name, content in others.items()}
    assert manifest["inputs"] == {"made.mission": hashlib.sha256(b"mission made\n").hexdigest()}
    assert manifest["options"] == {"solver": "z3", "-D T": "30 s"}
    assert {"missionc", "python", "numpy", "scipy", "piqp"} <= set(manifest["versions"])


def test_the_certificate_says_of_which_plan_it_speaks_and_holds_the_polynomials_too() -> None:
    certificate = loaded("certificate.json")
    assert certificate["passed"] is True
    assert certificate["plan_sha256"] == hashlib.sha256(files()["plan.json"]).hexdigest()
    names = [check["name"] for check in certificate["checks"]]
    assert {"shape", "speed", "separation", "tube", "joints", "flown separation"} <= set(names)
    assert {figure["name"] for figure in certificate["figures"]} == {"peak speed", "peak acceleration"}
    assert len(output().certificate.checks) == len(names)


def test_a_margin_is_never_rounded_towards_passing() -> None:
    check = Check("separation", "all pairs", 0.1234567891239, "m", 1e-9, True)
    bad = Check("world", "world", -1e-16, "m", 0.0, False)
    text = certificate_json(Certificate("made", (check, bad), (Figure("x", "y", 1.5, "m"),), ("careful",)), "0" * 64)
    found = json.loads(text)
    assert found["checks"][0]["margin"] == 0.123456789123
    assert found["checks"][1]["margin"] == -1e-12
    assert found["passed"] is False
    assert found["warnings"] == ["careful"]


def test_a_plan_that_cannot_be_flown_gives_no_output() -> None:
    collision = straight([[[1.0, 1.0], [2.0, 1.0], [3.0, 1.0]], [[3.0, 1.0], [2.0, 1.0], [1.0, 1.0]]])
    found = emit(MISSION, NOTHING, planned(MISSION, collision), Certificate("made", ()), PROVENANCE)
    assert isinstance(found, Diagnostic)


def test_names_of_files_drop_the_bracket_and_never_meet() -> None:
    def named(*names: str) -> tuple[ir.Agent, ...]:
        base = MISSION.agents[0]
        return tuple(replace(base, index=index, name=name) for index, name in enumerate(names))

    assert file_names(named("drone[0]", "drone[12]", "truck")) == {
        "drone[0]": "drone0",
        "drone[12]": "drone12",
        "truck": "truck",
    }
    clashing = file_names(named("drone[0]", "drone0", "Drone[0]", "drone[1]"))
    assert len({name.casefold() for name in clashing.values()}) == 4
    assert clashing["drone[1]"] == "drone1"


@pytest.mark.parametrize("name", ["plan.json", "certificate.json", "manifest.json"])
def test_documents_are_strict_json_with_an_end_of_line(name: str) -> None:
    def strange(word: str) -> None:
        raise AssertionError(word)

    json.loads(files()[name], parse_constant=strange)
    assert files()[name].endswith(b"}\n")


def test_every_double_survives_the_text() -> None:
    position = np.random.default_rng(0).uniform(0, 10, (2, 3, 2))
    text = plan_json(MISSION, planned(MISSION, straight(position)))
    assert [agent["position"] for agent in json.loads(text)["agents"]] == position.tolist()


def test_a_mission_without_graphs_has_none_in_its_plan() -> None:
    plan = json.loads(plan_json(replace(MISSION, graphs=()), planned(MISSION, straight(PATH))))
    assert plan["graphs"] == {}
    cover = ir.BeaconCover("cell", MISSION.graphs[0].radius, ((1.0, 1.5),), (0, 1), SPAN)
    plan = json.loads(plan_json(replace(MISSION, graphs=(cover,)), planned(MISSION, straight(PATH))))
    assert plan["graphs"] == {"cell": [[[0, 1]], [[0, 1]], []]}
