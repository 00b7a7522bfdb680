"""Profiles of vehicles: their files, in a mission, and what follows from them."""

from __future__ import annotations

import json
import math
import re
from dataclasses import fields
from pathlib import Path

import pytest

from missionc import ir
from missionc.base.source import Source
from missionc.base.units import Metres
from missionc.cli.app import main
from missionc.compiler.front_end import check
from missionc.frontend.resolve.show_ir import figures_of, show_ir
from missionc.ir import vehicle_profiles as package
from missionc.ir.vehicle_profiles import example, profiles, read_profile
from missionc.tools.replay.reverify import reverify
from tests.support.resolved_missions import codes, demo, mission, only

GENTLE = """\
mission gentle
time step 1 s, horizon 14 s
world (0, 0) to (6, 6)
region goal = box (3, 3) to (5, 5)
team drone[2] { dynamics single_integrator(speed <= 1 m/s)  start at (1, 1), (1, 2.5) }
require visit: some drone: eventually[0, 14 s] goal
"""
"""Slow enough for any vehicle."""

FILES = sorted(Path(package.__file__).parent.glob("*.toml"))
BODY = "dynamics single_integrator(speed <= 0.5 m/s)  start at (1, 1), (3, 1)"


def with_items(items: str) -> str:
    return demo(team=f"team drone[2] {{ {BODY}  {items} }}")


def flown(items: str) -> ir.Vehicle:
    return mission(with_items(items)).agents[0].vehicle


# ------------------------------------------------------------------ profiles


def test_every_figure_of_a_vehicle_is_described() -> None:
    assert ["name", *ir.FIGURES] == [field.name for field in fields(ir.Vehicle)]


def test_every_file_is_a_profile_and_plain_comes_first() -> None:
    assert list(profiles()) == ["plain", *(path.stem for path in FILES)]
    assert {"crazyflie21", "crazyflie21plus", "brushless21"} <= set(profiles())


def test_a_crazyflie_keeps_what_its_file_says() -> None:
    vehicle = profiles()["crazyflie21"]
    assert (vehicle.speed, vehicle.vertical_speed, vehicle.acceleration, vehicle.jerk) == (1.0, 0.5, 2.0, 20.0)
    assert vehicle.tilt == pytest.approx(math.radians(20))
    assert (vehicle.thrust, vehicle.height) == (ir.Band(0.0, 1.58), ir.Band(0.3, 2.0))
    assert (vehicle.start_skew, vehicle.memory) == (0.05, 4096)


def test_a_profile_like_another_has_the_rest_of_it() -> None:
    one, other = profiles()["crazyflie21"], profiles()["brushless21"]
    differing = [field.name for field in fields(one) if getattr(one, field.name) != getattr(other, field.name)]
    assert differing == ["name", "thrust"]


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_every_figure_in_a_file_has_its_source_above_it(path: Path) -> None:
    lines = path.read_text(encoding="utf-8").splitlines()
    for above, line in zip(["", *lines], lines, strict=False):
        if re.match(r"\w+ =", line) and not line.startswith("like"):
            assert above.startswith("#") or re.match(r"downwash_\w+ =", above), line


@pytest.mark.parametrize(
    ("figures", "words"),
    [
        ({"sped": "1 m/s"}, "unknown figure `sped`"),
        ({"speed": 1.0}, '"1 m/s"'),
        ({"speed": "1"}, '"1 m/s"'),
        ({"speed": "1 m"}, '"1 m/s"'),
        ({"speed": "0 m/s"}, "out of range"),
        ({"speed": "-1 m/s"}, "a speed"),
        ({"height": "1 m"}, '"1..2 m"'),
        ({"height": "2..1 m"}, "reversed"),
        ({"memory": "40.5"}, "out of range"),
        ({"thrust": "1..2"}, "must contain 1"),
        ({"like": "crazyflie"}, "unknown profile `crazyflie`"),
    ],
)
def test_a_file_that_says_something_else_is_refused(figures: dict[str, object], words: str) -> None:
    with pytest.raises(ValueError, match=re.escape(words)):
        read_profile("mine", figures, {"plain": ir.PLAIN})


def test_the_example_of_a_figure_is_read(subtests: pytest.Subtests) -> None:
    for name in ir.FIGURES:
        with subtests.test(name=name):
            figure = ir.FIGURES[name]
            value = getattr(read_profile("mine", {name: example(figure)}, {"plain": ir.PLAIN}), name)
            assert value == (
                ir.Band(0.0, 2.0) if figure.around else ir.Band(1.0, 2.0) if figure.relation == ".." else 1.0
            )


# ---------------------------------------------------------------- in a mission


def test_a_team_without_a_vehicle_is_plain_and_shown_as_before() -> None:
    text = mission(with_items(""))
    assert [agent.vehicle for agent in text.agents] == [ir.PLAIN] * 2
    assert [agent.yaw for agent in text.agents] == [ir.Fixed(0.0)] * 2
    assert "vehicle" not in show_ir(text)
    assert "yaw" not in show_ir(text)


def test_a_profile_gives_the_radius_unless_the_team_does() -> None:
    assert mission(with_items("vehicle plain { radius 7 cm }")).agents[0].radius == 0.07
    assert mission(with_items("vehicle plain { radius 7 cm }  radius 0.2 m")).agents[0].radius == 0.2


def test_every_figure_can_be_the_missions_own(subtests: pytest.Subtests) -> None:
    for name in ir.FIGURES:
        with subtests.test(name=name):
            figure = ir.FIGURES[name]
            written = f"{name} {figure.relation if figure.relation == '<=' else ''} {example(figure)}"
            vehicle = flown(f"vehicle crazyflie21 {{ {written} }}")
            assert getattr(vehicle, name) == (
                ir.Band(0.0, 2.0) if figure.around else ir.Band(1.0, 2.0) if figure.relation == ".." else 1.0
            )
            others = [other for other in ir.FIGURES if other != name]
            assert [getattr(vehicle, other) for other in others] == [
                getattr(profiles()["crazyflie21"], other) for other in others
            ]


def test_several_figures_stand_side_by_side() -> None:
    vehicle = flown("vehicle crazyflie21 { speed <= 0.8 m/s  tracking 3 cm  height 20..190 cm  memory 8192 }")
    assert (vehicle.speed, vehicle.tracking, vehicle.height, vehicle.memory) == (0.8, 0.03, ir.Band(0.2, 1.9), 8192)


def test_what_is_shown_of_a_vehicle_is_read_back() -> None:
    vehicle = profiles()["crazyflie21"]
    shown = "  ".join(f"{name} {text}" for name, text in figures_of(vehicle))
    again = flown(f"vehicle plain {{ {shown} }}")
    for name in ir.FIGURES:
        assert getattr(again, name) == (pytest.approx(vehicle.tilt) if name == "tilt" else getattr(vehicle, name))


@pytest.mark.parametrize(
    ("written", "yaw"),
    [
        ("yaw 90 deg", ir.Fixed(math.pi / 2)),
        ("yaw -1", ir.Fixed(-1.0)),
        ("yaw along path", ir.AlongPath()),
    ],
)
def test_a_team_says_where_its_noses_point(written: str, yaw: ir.Yaw) -> None:
    assert mission(with_items(written)).agents[1].yaw == yaw


def test_what_a_vehicle_cannot_be_is_said(subtests: pytest.Subtests) -> None:
    for items, code in [
        ("vehicle crazyfly21", "MC206"),
        ("vehicle crazyflie21 { sped <= 1 m/s }", "MC206"),
        ("vehicle crazyflie21 { speed 1 m/s }", "MC206"),
        ("vehicle crazyflie21 { height <= 2 m }", "MC206"),
        ("vehicle crazyflie21 { tracking 1..2 m }", "MC206"),
        ("vehicle crazyflie21 { speed <= 1 m }", "MC201"),
        ("vehicle crazyflie21 { jerk <= 1 m/s^2 }", "MC201"),
        ("vehicle crazyflie21 { speed <= 0 m/s }", "MC210"),
        ("vehicle crazyflie21 { tracking -1 cm }", "MC210"),
        ("vehicle crazyflie21 { height 2..1 m }", "MC210"),
        ("vehicle crazyflie21 { height -1..1 m }", "MC210"),
        ("vehicle crazyflie21 { memory 40.5 }", "MC209"),
        ("vehicle crazyflie21 { memory 0 }", "MC210"),
        ("vehicle crazyflie21 { speed <= 1 m/s  speed <= 2 m/s }", "MC013"),
        ("vehicle plain  vehicle plain", "MC013"),
        ("yaw 1  yaw 2", "MC013"),
        ("yaw 1 m", "MC201"),
    ]:
        with subtests.test(items=items, code=code):
            assert codes(with_items(items)) == [code]


def test_the_profile_that_was_meant_is_named() -> None:
    assert only(with_items("vehicle crazyfly21"), "MC206").help == "did you mean `crazyflie21`?"


# ------------------------------------------------------------------- spacing


def test_plain_agents_keep_their_bodies_and_the_separation_apart() -> None:
    text = demo(team=f"team drone[2] {{ {BODY}  radius 0.15 m }}", more="separation 0.2 m")
    assert mission(text).spacing(0, 1) == ir.Spacing(Metres(0.15 + 0.15 + 0.2), Metres(0.15 + 0.15 + 0.2))


@pytest.mark.parametrize(
    ("figures", "metres"),
    [
        ("pair_distance 0.5 m", 0.5),
        ("pair_distance 0.5 m  tracking 0.1 m", 0.7),
        ("downwash_radius 0.4 m  downwash_height 0.6 m  tracking 0.1 m", 1.0),
        ("downwash_radius 0.4 m  tracking 0.1 m", 0.4),
        ("pair_distance 0.1 m", 0.2),
        ("pair_distance 0.1 m  tracking 0.1 m", 0.4),
        ("downwash_height 3 m", 0.2),
    ],
)
def test_vehicles_keep_what_the_flight_has_to_keep(figures: str, metres: float) -> None:
    kept = mission(with_items(f"vehicle plain {{ {figures} }}")).spacing(0, 1)
    assert kept.sideways == pytest.approx(metres)
    assert kept.height == kept.sideways, "in a plane nobody is above another"


def test_of_two_vehicles_the_larger_distance_is_kept() -> None:
    one = "vehicle plain { pair_distance 0.5 m  tracking 0.1 m }"
    text = demo(team=f"team drone[1] {{ {BODY.partition(', (3')[0]}  {one} }}").replace(
        "require", "agent scout { dynamics single_integrator(speed <= 1 m/s)  start at (5, 5) }\nrequire", 1
    )
    assert mission(text).spacing(0, 1) == mission(text).spacing(1, 0)
    assert mission(text).spacing(0, 1).sideways == pytest.approx(0.6)


# ---------------------------------------------------------------- the command


def test_teams_that_name_no_vehicle_are_flown_by_the_one_that_is_asked_for() -> None:
    own = "agent own { vehicle plain  dynamics single_integrator(speed <= 1 m/s)  start at (3, 1) }\n"
    text = GENTLE.replace("team drone", own + "team drone")
    found = check(Source("a.mission", text), vehicle="crazyflie21")
    assert found.mission is not None
    assert {agent.team: agent.vehicle.name for agent in found.mission.agents} == {
        "drone": "crazyflie21",
        "own": "plain",
    }
    assert found.vehicle == "crazyflie21"
    with pytest.raises(ValueError, match="unknown vehicle `nimbus`"):
        check(Source("a.mission", text), vehicle="nimbus")


def test_a_folder_is_judged_by_the_vehicle_it_was_planned_for(tmp_path: Path) -> None:
    (tmp_path / "a.mission").write_text(GENTLE)
    folder = tmp_path / "out"
    words = ["compile", str(tmp_path / "a.mission"), "--vehicle", "crazyflie21", "-o", str(folder)]
    assert main(words) == 0
    replayed = reverify(folder)
    assert replayed.passed
    assert replayed.certificate is not None
    assert {"flown acceleration", "flown downwash"} <= {check.name for check in replayed.certificate.checks}
    manifest = folder / "manifest.json"
    manifest.write_text(manifest.read_text().replace('"crazyflie21"', '"nimbus"'))
    assert "unknown to this version" in reverify(folder).findings[0].message


def test_the_vehicles_are_listed_one_a_line(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["vehicles"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in lines] == list(profiles())
    assert lines[0] == "plain  radius 0.1 m  memory 4096"


def test_one_vehicle_is_a_table_of_every_figure(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["vehicles", "crazyflie21plus"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in lines] == list(ir.FIGURES)
    assert "speed            <= 1 m/s               horizontal speed" in lines


def test_vehicles_are_a_document_too(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["vehicles", "--format", "json"]) == 0
    listed = {each["name"]: each["figures"] for each in json.loads(capsys.readouterr().out)["vehicles"]}
    assert list(listed) == list(profiles())
    assert listed["crazyflie21"]["height"] == {"value": [0.3, 2.0], "unit": "m"}
    assert listed["plain"]["speed"] == {"value": None, "unit": "m/s"}
    assert all(list(figures) == list(ir.FIGURES) for figures in listed.values())


def test_a_vehicle_that_is_not_there_is_said_with_the_nearest(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["vehicles", "crazyfly21"]) == 2
    assert "did you mean `crazyflie21`?" in capsys.readouterr().err
