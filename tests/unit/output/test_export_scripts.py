"""The scripts and settings that fly a swarm: what they call, in which order, and that names stay names in them."""

from __future__ import annotations

import inspect
import re
from collections.abc import Mapping
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from jinja2.exceptions import SecurityError

from missionc.output.export import fill_templates
from missionc.output.export.formats import FORMATS, Exported, Flight, flight
from missionc.output.export.trajectory_memory import raw
from tests.support.flown_scripts import SCRIPTS, World, export, fly, safe, standing
from tests.support.hand_made_flights import cramped, wandered

HOSTILE = 'a"\'`\n]: {{ 7 * 7 }}\\ {% x %} #\u2028\x07é🦊"""'


def exported(name: str, flight: Flight) -> Mapping[str, bytes]:
    made = FORMATS[name].export(flight)
    assert isinstance(made, Exported), made
    return made.files


def renamed(flown: Flight, name: str) -> Flight:
    """The flight with another name for its mission and its first agent."""
    first, *others = flown.mission.agents
    mission = replace(flown.mission, name=name, agents=(replace(first, name=name), *others))
    texts = {agent.name: each.text for agent, each in zip(mission.agents, flown.parts, strict=True)}
    return flight(mission, flown.kernel, flown.trace, texts)


# ------------------------------------------------------------------ flights


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("form", SCRIPTS)
def test_a_script_goes_to_the_first_points_and_starts_all_at_once_absolutely(
    form: str, dimension: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    flown = wandered(3, 6, dimension)
    world = fly(export(form, flown, tmp_path), World(standing(flown)), monkeypatch)
    safe(world)
    lasting = {"arm": 0.0, "start": flown.duration}
    for agent, each in enumerate(flown.parts):
        own = [command for command in world.commands if command.agent == agent]
        sent = [command for command in own if command.name in ("upload", "arm", *IN_THE_AIR)]
        assert [command.name for command in sent] == ["upload", "arm", "takeoff", "go", "start", "land"]
        for command, later in pairwise(sent[1:]):
            assert later.time - command.time >= command.values.get("lasting", lasting.get(command.name))
        told = {command.name: command.values for command in own}
        assert told["takeoff"]["height"] == each.first[2]
        assert told["go"] | {"lasting": 0} == {"goal": each.first, "yaw": 0.0, "lasting": 0, "relative": False}
        assert told["start"] == {"number": 0, "scale": 1.0, "reverse": False, "relative": False}
        assert own[-1].time - sent[-1].time >= told["land"]["lasting"]
        assert 0 < told["land"]["height"] < 0.1
    for name in IN_THE_AIR:
        assert len({command.time for command in world.commands if command.name == name}) == 1


def test_the_crazyswarm_script_uploads_what_was_verified(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    flown = wandered(3, 6, 3)
    world = fly(export("crazyswarm2", flown, tmp_path), World(standing(flown)), monkeypatch)
    uploads = [command for command in world.commands if command.name == "upload"]
    for each, upload in zip(flown.parts, uploads, strict=True):
        assert (upload.values["number"], upload.values["offset"]) == (0, 0)
        table = np.array(upload.values["rows"]).astype(np.float32)
        assert np.array_equal(table[:, 0], each.pieces.duration)
        assert np.array_equal(table[:, 1:].reshape(-1, 4, 8), each.pieces.coefficients)


@pytest.mark.parametrize("flown", [wandered(2), cramped(wandered(2, 12, 3), 2000)], ids=["raw", "compressed"])
def test_the_cflib_script_uploads_its_files(flown: Flight, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    files = exported("cflib", flown)
    world = fly(export("cflib", flown, tmp_path), World(standing(flown)), monkeypatch)
    for agent, each in enumerate(flown.parts):
        own = [command for command in world.commands if command.agent == agent]
        told = {command.name: command.values for command in own}
        assert told["upload"] == {"offset": 0, "content": files[f"{each.file}.bin"]}
        kind = 0 if len(raw(each.pieces)) <= each.agent.vehicle.memory else 1
        assert told["define"] == {"number": 0, "offset": 0, "pieces": each.pieces.duration.size, "kind": kind}
        assert {"parameter": "stabilizer.controller", "value": "2"} in [command.values for command in own]


IN_THE_AIR = ("takeoff", "go", "start", "land")


@pytest.mark.parametrize("form", SCRIPTS)
@pytest.mark.parametrize(
    ("aside", "volts", "silent", "says"),
    [
        (0.5, 4.1, False, "is 0.50 m from"),
        (float("nan"), 4.1, False, "is nan m from"),
        (0.0, 3.6, False, "battery voltage of 3.60 V"),
        (0.0, 4.1, True, "the position of"),
    ],
)
def test_no_vehicle_takes_off_if_one_is_not_ready(
    form: str, aside: float, volts: float, silent: bool, says: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    flown = wandered(2)
    world = World(standing(flown, aside, volts), silent=silent)
    fly(export(form, flown, tmp_path), world, monkeypatch)
    safe(world)
    assert not {"arm", *IN_THE_AIR} & {command.name for command in world.commands}
    assert world.ended.startswith("no vehicle took off")
    assert says in world.ended


def test_in_simulation_positions_that_no_vehicle_reports_are_not_required(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    flown = wandered(2)
    script = export("crazyswarm2", flown, tmp_path)
    world = fly(script, World(standing(flown), silent=True), monkeypatch, "--unseen")
    assert {command.name for command in world.commands} > set(IN_THE_AIR)
    assert world.ended == ""


def test_the_crazyswarm_script_flies_no_vehicle_if_others_are_enabled(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    world = fly(export("crazyswarm2", wandered(2), tmp_path), World(standing(wandered(3))), monkeypatch)
    assert world.commands == []
    assert "drone2" in world.ended


def test_the_settings_name_every_vehicle_where_it_stands() -> None:
    yaml = pytest.importorskip("yaml")
    flown = wandered(3, 6, 3)
    files = exported("crazyswarm2", flown)
    settings = yaml.safe_load(files["crazyflies.yaml"])
    assert settings["fileversion"] == 3
    assert list(settings["robots"]) == [each.robot for each in flown.parts]
    assert len({robot["uri"] for robot in settings["robots"].values()}) == 3
    for each, robot in zip(flown.parts, settings["robots"].values(), strict=True):
        assert robot["enabled"] is True
        assert robot["type"] in settings["robot_types"]
        assert robot["initial_position"] == [each.first[0], each.first[1], 0.0]
        assert all(isinstance(value, float) for value in robot["initial_position"])
        assert files[f"trajectories/{each.file}.csv"].decode() == each.text
    firmware = settings["all"]["firmware_params"]
    assert firmware["stabilizer"] == {"estimator": 2, "controller": 2}
    assert firmware["commander"] == {"enHighLevel": 1}
    assert settings["all"]["broadcasts"] == {"num_repeats": 15, "delay_between_repeats_ms": 1}


# ------------------------------------------------------------------ names


def test_the_scripts_speak_of_what_cflib_has() -> None:
    """The methods and words that the script and its stand-in use are those of the real package."""
    commander = pytest.importorskip("cflib.crazyflie.high_level_commander").HighLevelCommander
    names = ("", ".log", ".mem", ".platformservice", ".localization", ".syncCrazyflie")
    client, logs, memory, platform, places, link = (pytest.importorskip(f"cflib.crazyflie{name}") for name in names)
    reset = pytest.importorskip("cflib.utils.reset_estimator").reset_estimator

    def words(function: Any) -> list[str]:
        return [name for name in inspect.signature(function).parameters if name != "self"]

    assert words(commander.start_trajectory)[:5] == [
        "trajectory_id", "time_scale", "relative_position", "relative_yaw", "reversed",
    ]  # fmt: skip
    assert words(commander.define_trajectory) == ["trajectory_id", "offset", "n_pieces", "type"]
    assert (commander.TRAJECTORY_TYPE_POLY4D, commander.TRAJECTORY_TYPE_POLY4D_COMPRESSED) == (0, 1)
    assert words(commander.go_to)[:6] == ["x", "y", "z", "yaw", "duration_s", "relative"]
    assert words(commander.takeoff)[:2] == ["absolute_height_m", "duration_s"]
    assert words(commander.land)[:2] == ["absolute_height_m", "duration_s"]
    assert "yaw" in words(commander.land)
    assert words(commander.stop) == ["group_mask"]
    assert words(logs.LogConfig) == ["name", "period_in_ms"]
    assert words(logs.LogConfig.add_variable) == ["name", "fetch_as"]
    assert words(logs.LogConfig("some", 200).data_received_cb.add_callback) == ["cb"]
    assert words(memory.TrajectoryMemory.write_data_sync) == ["start_addr"]
    assert words(platform.PlatformService.send_arming_request) == ["do_arm"]
    assert words(places.Localization.send_emergency_stop) == []
    assert words(link.SyncCrazyflie) == ["link_uri", "cf"]
    assert words(link.SyncCrazyflie.open_link) == words(link.SyncCrazyflie.close_link) == []
    assert "rw_cache" in words(client.Crazyflie)
    assert words(reset) == ["crazyflie"]


@pytest.mark.parametrize("name", [HOSTILE, "null", "0x10", "yes", "import os"])
def test_names_stay_names_in_every_language(name: str) -> None:
    yaml = pytest.importorskip("yaml")
    flown = renamed(wandered(2), name)
    for form in ("crazyswarm2", "cflib"):
        files = exported(form, flown)
        space: dict[str, Any] = {"__name__": "read", "__file__": "/nowhere/fly.py"}
        source = re.sub("^(from|import) (crazyflie_py|rclpy|cflib)", "#", files["fly.py"].decode("ascii"), flags=re.M)
        exec(compile(source, "fly.py", "exec"), space)
        assert space["MISSION"] == name
        assert len(space["ROBOTS"]) == 2
        suffix = ".csv" if form == "crazyswarm2" else ".bin"
        assert [file for file, _, _ in space["ROBOTS"].values()] == [each.file + suffix for each in flown.parts]
        assert files["README.md"].decode().count("\n") == exported(form, wandered(2))["README.md"].count(b"\n")
    robots = yaml.safe_load(exported("crazyswarm2", flown)["crazyflies.yaml"])["robots"]
    assert list(robots) == [each.robot for each in flown.parts]
    assert all(robot.isidentifier() and robot.isascii() for robot in robots)
    message = yaml.safe_load(exported("ros2", flown)["trajectory.yaml"])
    assert message["joint_names"] == [name, "drone[1]"]


def test_two_names_that_ros_cannot_tell_apart_are_told_apart() -> None:
    flown = wandered(2)
    agents = tuple(replace(agent, name=name) for agent, name in zip(flown.mission.agents, ("à", "é"), strict=True))
    texts = {agent.name: each.text for agent, each in zip(agents, flown.parts, strict=True)}
    twins = flight(replace(flown.mission, agents=agents), flown.kernel, flown.trace, texts)
    assert [each.robot for each in twins.parts] == ["robot_0", "robot_1"]


def test_a_template_that_quotes_nothing_does_not_render(monkeypatch: pytest.MonkeyPatch) -> None:
    environment = fill_templates._environment()
    with pytest.raises(TypeError, match="not quoted"):
        environment.from_string("{{ name }}").render(name="x")
    with pytest.raises(SecurityError):
        environment.from_string("{{ (name.__class__.__mro__) | python }}").render(name="x")


@pytest.mark.parametrize("value", [1e-5, -1e22, 0.0, 1.5, 3.0e-300, 123456789.125])
def test_numbers_in_yaml_stay_numbers(value: float) -> None:
    yaml = pytest.importorskip("yaml")
    assert yaml.safe_load(fill_templates.yaml(value)) == value
    assert isinstance(yaml.safe_load(fill_templates.yaml(value)), float)
