"""``--from``: where vehicles were measured to stand is where they rise and land, and what is no such file is said."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from missionc.base.diagnostics.code import (
    MAP_FEATURE,
    MAP_UNREADABLE,
    PAD_ELSEWHERE,
    PADS_TOO_NEAR,
    UNUSABLE_POSES,
    Code,
)
from missionc.base.limits import Limits
from missionc.base.source import Source
from missionc.cli.app import main
from missionc.compiler.driver import check
from missionc.frontend.resolve.measured_pads import with_measured_pads
from missionc.ir import Mission
from tests.support.hall_flights import HALL, mission
from tests.support.output_folders import unlisted

POSES = "agent,x,y,z\ndrone[0],1.02,3.97,0.01\ndrone[1],2.01,4.03,0.02\n"
PLAIN = HALL.replace(HALL[HALL.index("  flight") : HALL.index("}\nrequire")], "")


def codes(poses: str, name: str = "poses.csv", of: Mission | None = None) -> list[Code]:
    _, findings = with_measured_pads(of or mission(), Source(name, poses), Limits())
    return [finding.code for finding in findings]


def test_pads_are_where_vehicles_were_measured_and_all_else_of_them_stays() -> None:
    placed, findings = with_measured_pads(mission(), Source("poses.csv", POSES), Limits())
    assert findings == []
    assert placed is not None
    pads = [agent.pad for agent in placed.agents]
    assert [pad.point for pad in pads if pad] == [(1.02, 3.97), (2.01, 4.03)]
    assert [(pad.hover, pad.rise) for pad in pads if pad] == [(0.8, 0.3)] * 2


def test_a_list_in_json_says_the_same_as_a_table() -> None:
    rows = [
        {"agent": "drone[1]", "x": 2.01, "y": 4.03, "z": 0.02, "yaw": 0.1},
        {"agent": "drone[0]", "x": 1.02, "y": 3.97, "z": 0},
    ]
    placed, findings = with_measured_pads(mission(), Source("poses.json", json.dumps(rows)), Limits())
    assert findings == []
    assert placed is not None
    assert [agent.pad.point for agent in placed.agents if agent.pad] == [(1.02, 3.97), (2.01, 4.03)]


@pytest.mark.parametrize(
    ("poses", "code"),
    [
        (POSES.replace("drone[1]", "drone[7]"), UNUSABLE_POSES),
        (POSES.replace("drone[1]", "drone[0]"), UNUSABLE_POSES),
        (POSES[: POSES.index("drone[1]")], UNUSABLE_POSES),
        (POSES.replace("0.02", "0.7"), UNUSABLE_POSES),
        (POSES.replace("3.97", "nan"), MAP_FEATURE),
        (POSES.replace("3.97", ""), MAP_FEATURE),
        (POSES.replace("drone[1]", ""), MAP_FEATURE),
        (POSES.replace("agent,x", "agent,w"), MAP_FEATURE),
        (POSES.replace("3.97", "one"), MAP_FEATURE),
        ("agent,x,y,z\n", MAP_FEATURE),
        ("", MAP_UNREADABLE),
    ],
)
def test_a_table_that_does_not_say_where_every_agent_stands_is_refused(poses: str, code: Code) -> None:
    assert code in codes(poses)


@pytest.mark.parametrize(
    ("poses", "code"),
    [
        ("{", MAP_UNREADABLE),
        ("{}", MAP_FEATURE),
        ("[]", MAP_FEATURE),
        ("[1]", MAP_FEATURE),
        ('[{"agent": 3, "x": 1, "y": 1, "z": 0}]', MAP_FEATURE),
        ('[{"agent": "drone[0]", "x": NaN, "y": 1, "z": 0}]', MAP_UNREADABLE),
        ('[{"agent": "drone[0]", "x": 1e999, "y": 1, "z": 0}]', MAP_UNREADABLE),
        ('[{"agent": "drone[0]", "x": true, "y": 1, "z": 0}]', MAP_FEATURE),
        ('[{"agent": "drone[0]", "x": 1, "y": 1, "z": 0, "up": 1}]', MAP_FEATURE),
        ('[{"agent": "drone[0]", "x": 1, "y": 1, "z": 0}]', UNUSABLE_POSES),
    ],
)
def test_a_list_that_does_not_say_it_is_refused(poses: str, code: Code) -> None:
    assert codes(poses, "poses.json") == [code]


def test_another_kind_of_file_is_refused() -> None:
    assert codes(POSES, "poses.yaml") == [MAP_UNREADABLE]


@pytest.mark.parametrize(("y", "warned"), [("3.91", False), ("3.88", True)])
def test_who_stands_further_than_ten_centimetres_from_its_pad_is_named(y: str, warned: bool) -> None:
    assert codes(POSES.replace("3.97", y)) == ([PAD_ELSEWHERE] if warned else [])


def test_without_pads_the_starts_say_where_vehicles_are_expected(tmp_path: Path) -> None:
    checked = check(Source("hall.mission", PLAIN))
    assert checked.mission is not None
    assert codes(POSES, of=checked.mission) == [PAD_ELSEWHERE] * 2
    assert codes(POSES.replace("3.97", "1.03").replace("2.01,4.03", "1.0,2.0"), of=checked.mission) == []


def test_a_file_from_anywhere_is_kept_under_a_name_of_its_own(tmp_path: Path) -> None:
    """Also where the mission has another file of that name."""
    (tmp_path / "hall").mkdir()
    (tmp_path / "today").mkdir()
    pads = HALL.replace("pads at (1, 4, 0), (2, 4, 0)", 'pads from "poses.csv"')
    (tmp_path / "hall" / "hall.mission").write_text(pads)
    (tmp_path / "hall" / "poses.csv").write_text("x,y,z\n1,4,0\n2,4,0\n")
    (tmp_path / "today" / "poses.csv").write_text(POSES)
    folder = tmp_path / "out"
    words = [str(tmp_path / "hall" / "hall.mission"), "-o", str(folder), "--quiet"]
    assert main(["compile", *words, "--from", str(tmp_path / "today" / "poses.csv")]) == 0
    kept = {path.name: path.read_text() for path in (folder / "mission").iterdir()}
    assert kept == {"hall.mission": pads, "poses.csv": "x,y,z\n1,4,0\n2,4,0\n", "measured-poses.csv": POSES}
    assert main(["verify", str(folder)]) == 0


def test_vehicles_that_stand_too_near_each_other_are_found(tmp_path: Path) -> None:
    near = Source("poses.csv", POSES.replace("2.01,4.03", "1.3,3.97"))
    assert PADS_TOO_NEAR in [finding.code for finding in check(Source("hall.mission", HALL), poses=near).findings]


def test_a_folder_keeps_where_they_stood_and_is_verified_from_it(tmp_path: Path) -> None:
    (tmp_path / "hall.mission").write_text(HALL)
    (tmp_path / "poses.csv").write_text(POSES)
    folder = tmp_path / "out"
    words = [str(tmp_path / "hall.mission"), "-o", str(folder), "--quiet"]
    assert main(["compile", *words, "--from", str(tmp_path / "poses.csv")]) == 0
    agents = json.loads((folder / "whole_flight.json").read_text())["agents"]
    assert [each["pad"] for each in agents] == [[1.02, 3.97, 0.0], [2.01, 4.03, 0.0]]
    assert (folder / "mission" / "poses.csv").read_text() == POSES
    assert main(["verify", str(folder)]) == 0
    (folder / "mission" / "poses.csv").write_text(POSES.replace("3.97", "3.98"))
    assert main(["verify", str(folder)]) == 5
    # The same folder from where they stand on another day: the ways alone are planned.
    (tmp_path / "later.csv").write_text(POSES.replace("3.97", "4.05"))
    exported = tmp_path / "later"
    words = ["export", str(folder), "px4", "-o", str(exported)]
    (folder / "mission" / "poses.csv").write_text(POSES)
    assert main([*words, "--from", str(tmp_path / "later.csv")]) == 0
    assert {"whole_flight.json", "whole_flight_certificate.json", "px4/Drone 1.csv"} <= set(unlisted(exported))
    first = (exported / "px4" / "Drone 1.csv").read_text().splitlines()[1].split(",")
    assert [float(value) for value in first[2:5]] == pytest.approx([1.02, -4.05, -0.8], abs=1e-6)
    assert json.loads((exported / "whole_flight_certificate.json").read_text())["passed"] is True
    (tmp_path / "later.csv").write_text(POSES.replace("drone[0]", "drone[4]"))
    assert main([*words, "--force", "--from", str(tmp_path / "later.csv")]) == 1
