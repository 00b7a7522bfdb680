"""The scripts and settings that fly a swarm: what they call, in which order, and that names stay names in them."""

from __future__ import annotations

import runpy
import sys
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any, ClassVar

import numpy as np
import pytest
from jinja2.exceptions import SecurityError

from missionc.output.export import fill_templates
from missionc.output.export.formats import FORMATS, Exported, Flight, flight
from missionc.output.export.trajectory_memory import raw
from tests.support.hand_made_flights import cramped, wandered

HOSTILE = 'a"\'`\n]: {{ 7 * 7 }}\\ {% x %} #\u2028\x07é🦊"""'

Call = tuple[str, str, dict[str, Any]]
Place = tuple[float, float, float]


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


def written(folder: Path, files: Mapping[str, bytes]) -> Path:
    for name, content in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(content)
    return folder


def module(name: str, **contents: object) -> ModuleType:
    made = ModuleType(name)
    made.__dict__.update(contents)
    return made


# ------------------------------------------------------------------ Crazyswarm2


class Recorder:
    """Answers every method with a note of who was called with what, by the real signatures' names."""

    NAMES: ClassVar = {
        "uploadTrajectory": ("trajectoryId", "pieceOffset", "trajectory"),
        "takeoff": ("targetHeight", "duration"),
        "goTo": ("goal", "yaw", "duration", "relative"),
        "startTrajectory": ("trajectoryId", "timescale", "reverse", "relative", "groupMask"),
        "land": ("targetHeight", "duration"),
        "arm": ("arm",),
        "emergency": (),
    }

    def __init__(
        self, who: str, calls: list[Call], place: Place | None = None, volts: float = 4.1, fails: str = ""
    ) -> None:
        self.who, self.calls, self.place, self.volts, self.fails = who, calls, place, volts, fails

    def get_pose(self) -> dict[str, object]:
        return {} if self.place is None else {"position": self.place}

    def get_position(self) -> Place:
        return self.place or (0.0, 0.0, 0.0)

    def get_status(self) -> dict[str, float]:
        return {"battery": self.volts}

    def __getattr__(self, name: str) -> Callable[..., None]:
        def called(*words: object, **named: object) -> None:
            self.calls.append((self.who, name, dict(zip(self.NAMES[name], words, strict=False)) | named))
            if name == self.fails:
                raise RuntimeError(f"{name} failed")

        return called


class Loaded:
    """crazyflie_py's ``Trajectory``: it skips a line and takes columns 0 to 32, of two rows at least."""

    def loadcsv(self, file: str) -> None:
        table = np.loadtxt(file, delimiter=",", skiprows=1, usecols=range(33))
        self.rows = [table[row, :33] for row in range(len(table))]


@pytest.mark.parametrize("dimension", [2, 3])
def test_the_crazyswarm_script_goes_to_the_start_and_starts_all_at_once_absolutely(
    dimension: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    flown = wandered(3, 6, dimension)
    folder = written(tmp_path, exported("crazyswarm2", flown))
    calls = crazyswarm(folder / "fly.py", standing(flown), monkeypatch)
    robots = {each.robot: each for each in flown.parts}
    phases = [name for index, (_, name, _) in enumerate(calls) if index == 0 or calls[index - 1][1] != name]
    assert phases == [
        "uploadTrajectory",
        "sleep",
        "arm",
        "sleep",
        "takeoff",
        "sleep",
        "goTo",
        "sleep",
        "startTrajectory",
        "sleep",
        "land",
        "sleep",
        "arm",
    ]
    assert [(who, given["arm"]) for who, name, given in calls if name == "arm"] == [("all", True), ("all", False)]
    for phase in ("uploadTrajectory", "takeoff", "goTo"):
        assert [who for who, name, _ in calls if name == phase] == list(robots)
    waits: list[float] = []
    lasting = 0.0
    for who, name, given in calls:
        match name:
            case "uploadTrajectory":
                assert (given["trajectoryId"], given["pieceOffset"]) == (0, 0)
                table = np.array(given["trajectory"].rows)
                assert np.array_equal(table[:, 0].astype(np.float32), robots[who].pieces.duration)
                assert np.array_equal(
                    table[:, 1:].astype(np.float32).reshape(-1, 4, 8), robots[who].pieces.coefficients
                )
            case "takeoff":
                assert given["targetHeight"] == robots[who].first[2]
                lasting = given["duration"]
            case "goTo":
                assert given["relative"] is False
                assert tuple(given["goal"]) == robots[who].first
                assert given["yaw"] == 0
                lasting = given["duration"]
            case "startTrajectory":
                assert who == "all"
                assert given == {"trajectoryId": 0, "timescale": 1.0, "reverse": False, "relative": False}
                lasting = flown.duration
            case "land":
                assert who == "all"
                assert 0 < given["targetHeight"] < 0.1
                lasting = given["duration"]
            case "sleep":
                waits.append(given["duration"])
                assert given["duration"] >= lasting
    assert len(waits) == 6


def standing(flown: Flight, aside: float = 0.0) -> dict[str, Place]:
    """Everybody below its first point, the first of them so many metres aside."""
    places = {each.robot: (each.first[0], each.first[1], 0.0) for each in flown.parts}
    (x, y, z), name = places[flown.parts[0].robot], flown.parts[0].robot
    return places | {name: (x + aside, y, z)}


def crazyswarm(
    script: Path,
    places: Mapping[str, Place | None],
    monkeypatch: pytest.MonkeyPatch,
    *words: str,
    volts: float = 4.1,
    fails: str = "",
    calls: list[Call] | None = None,
) -> list[Call]:
    """Run the script where ``crazyflie_py`` is a recorder; one of the calls to all vehicles may fail."""
    calls = [] if calls is None else calls
    swarm = Recorder("all", calls, fails=fails)
    swarm.__dict__["crazyfliesByName"] = {name: Recorder(name, calls, place, volts) for name, place in places.items()}
    monkeypatch.setattr(sys, "argv", [str(script), *words])
    clock = SimpleNamespace(sleep=lambda duration: calls.append(("clock", "sleep", {"duration": duration})))
    package = module("crazyflie_py", Crazyswarm=lambda: SimpleNamespace(allcfs=swarm, timeHelper=clock))
    monkeypatch.setitem(sys.modules, "crazyflie_py", package)
    loader = module("crazyflie_py.uav_trajectory", Trajectory=Loaded)
    monkeypatch.setitem(sys.modules, "crazyflie_py.uav_trajectory", loader)
    runpy.run_path(str(script), run_name="__main__")
    return calls


def test_the_crazyswarm_script_flies_nobody_where_others_are_enabled(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = written(tmp_path, exported("crazyswarm2", wandered()))
    with pytest.raises(SystemExit, match="cf9"):
        crazyswarm(folder / "fly.py", {"drone0": None, "cf9": None}, monkeypatch)


IN_THE_AIR = frozenset({"arm", "takeoff", "goTo", "startTrajectory", "land"})


@pytest.mark.parametrize(
    ("aside", "volts", "seen", "says"),
    [
        (0.5, 4.1, True, "is 0.50 m from"),
        (float("nan"), 4.1, True, "is nan m from"),
        (0.0, 3.6, True, "has 3.60 V left"),
        (0.0, 4.1, False, "nobody reports where"),
    ],
)
def test_nobody_takes_off_where_one_is_not_ready(
    aside: float, volts: float, seen: bool, says: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    flown = wandered(2)
    folder = written(tmp_path, exported("crazyswarm2", flown))
    places = standing(flown, aside)
    known = places if seen else dict.fromkeys(places)
    calls: list[Call] = []
    with pytest.raises(SystemExit, match=says):
        crazyswarm(folder / "fly.py", known, monkeypatch, volts=volts, calls=calls)
    assert not IN_THE_AIR & {name for _, name, _ in calls}


def test_in_simulation_places_that_nobody_reports_are_not_asked_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    flown = wandered(2)
    folder = written(tmp_path, exported("crazyswarm2", flown))
    calls = crazyswarm(folder / "fly.py", dict.fromkeys(standing(flown)), monkeypatch, "--unseen")
    assert {name for _, name, _ in calls} > IN_THE_AIR


@pytest.mark.parametrize(("fails", "last"), [("startTrajectory", "arm"), ("land", "emergency")])
def test_whatever_goes_wrong_in_the_air_everybody_lands_and_if_that_fails_all_motors_stop(
    fails: str, last: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    flown = wandered(2)
    folder = written(tmp_path, exported("crazyswarm2", flown))
    calls: list[Call] = []
    with pytest.raises(RuntimeError, match=f"{fails} failed"):
        crazyswarm(folder / "fly.py", standing(flown), monkeypatch, fails=fails, calls=calls)
    assert "land" in {name for _, name, _ in calls}
    assert [name for who, name, _ in calls if who == "all"][-1] == last


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


# ------------------------------------------------------------------ cflib


@pytest.mark.parametrize("flown", [wandered(2), cramped(wandered(2, 12, 3), 2000)], ids=["raw", "compressed"])
def test_the_cflib_script_uploads_goes_to_the_start_and_starts_absolutely(
    flown: Flight, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    files = exported("cflib", flown)
    calls = with_cflib(written(tmp_path, files) / "fly.py", below(flown), monkeypatch)
    pieces = flown.parts[0].pieces.duration.size
    assert len(calls) == len(flown.parts)
    for each, own in zip(flown.parts, calls.values(), strict=True):
        order = [name for name, _, _ in own]
        assert order == ["param"] * 3 + [
            "write", "define_trajectory", "arm", "takeoff", "go_to", "start_trajectory", "land", "stop", "arm",
        ]  # fmt: skip
        told = {name: (words, named) for name, words, named in own}
        assert {words for name, words, _ in own if name == "param"} >= {("stabilizer.controller", "2")}
        assert told["write"] == ((0, files[f"{each.file}.bin"]), {})
        kind = 0 if len(raw(each.pieces)) <= each.agent.vehicle.memory else 1
        assert told["define_trajectory"] == ((0, 0, pieces), {"type": kind})
        assert told["go_to"][0][:4] == (*each.first, 0.0)
        assert told["go_to"][1] == {"relative": False}
        assert told["start_trajectory"] == (
            (0, 1.0),
            {"relative_position": False, "relative_yaw": False, "reversed": False},
        )


Own = list[tuple[str, tuple[Any, ...], Any]]


def below(flown: Flight, aside: float = 0.0, volts: float = 4.1) -> list[dict[str, float]]:
    """What each vehicle logs that stands below its first point; the first of them so many metres aside."""
    return [
        {"stateEstimate.x": each.first[0] + aside * (not index), "stateEstimate.y": each.first[1], "pm.vbat": volts}
        for index, each in enumerate(flown.parts)
    ]


def with_cflib(
    script: Path,
    logged: list[dict[str, float]],
    monkeypatch: pytest.MonkeyPatch,
    fails: str = "",
    calls: dict[str, Own] | None = None,
) -> dict[str, Own]:
    """Run the script where ``cflib`` is a recorder, of which one command may fail, and time stands still."""
    calls = {} if calls is None else calls

    class Logger:
        def __init__(self, vehicle: Any, wanted: Any) -> None:
            self.seen = {name: vehicle.logged[name] for name in wanted.names}

        def __enter__(self) -> Logger:
            return self

        def __exit__(self, *error: object) -> None:
            pass

        def __iter__(self) -> Any:
            return iter([(0, self.seen, None)])

    class Wanted:
        def __init__(self, name: str, period_in_ms: int) -> None:
            self.names: list[str] = []

        def add_variable(self, name: str, kind: str) -> None:
            assert kind == "float"
            self.names.append(name)

    class Memory:
        trajectory: list[Any]

        def __init__(self, own: list[Any]) -> None:
            self.own = own

        def write_data_sync(self, address: int) -> bool:
            self.own.append(("write", (address, b"".join(bytes(each.pack()) for each in self.trajectory)), {}))
            return True

    class Commander:
        def __init__(self, own: list[Any]) -> None:
            self.own = own

        def __getattr__(self, name: str) -> Callable[..., None]:
            def called(*words: object, **named: object) -> None:
                self.own.append((name, words, named))
                if name == fails:
                    raise RuntimeError(f"{name} failed")

            return called

    class Swarm:
        def __init__(self, uris: list[str], factory: object) -> None:
            self.vehicles = {}
            for uri, seen in zip(uris, logged, strict=True):
                own = calls.setdefault(uri, [])
                memory = Memory(own)
                self.vehicles[uri] = SimpleNamespace(
                    cf=SimpleNamespace(
                        link_uri=uri,
                        param=SimpleNamespace(set_value=lambda *words, own=own: own.append(("param", words, {}))),
                        mem=SimpleNamespace(get_mems=lambda kind, memory=memory: [memory]),
                        high_level_commander=Commander(own),
                        platform=SimpleNamespace(
                            send_arming_request=lambda on, own=own: own.append(("arm", (on,), {}))
                        ),
                        loc=SimpleNamespace(send_emergency_stop=lambda own=own: own.append(("emergency", (), {}))),
                    ),
                    logged=seen,
                )

        def __enter__(self) -> Swarm:
            return self

        def __exit__(self, *error: object) -> None:
            pass

        def reset_estimators(self) -> None:
            pass

        def parallel_safe(self, act: Callable[..., None], args_dict: dict[str, list[Any]] | None = None) -> None:
            for uri, vehicle in self.vehicles.items():
                act(vehicle, *(args_dict[uri] if args_dict else []))

    names = {
        "cflib": module("cflib", crtp=module("cflib.crtp", init_drivers=lambda: None)),
        "cflib.crtp": module("cflib.crtp", init_drivers=lambda: None),
        "cflib.crazyflie": module("cflib.crazyflie"),
        "cflib.crazyflie.log": module("cflib.crazyflie.log", LogConfig=Wanted),
        "cflib.crazyflie.syncLogger": module("cflib.crazyflie.syncLogger", SyncLogger=Logger),
        "cflib.crazyflie.mem": module("cflib.crazyflie.mem", MemoryElement=SimpleNamespace(TYPE_TRAJ=18)),
        "cflib.crazyflie.swarm": module("cflib.crazyflie.swarm", Swarm=Swarm, CachedCfFactory=lambda rw_cache: None),
    }
    for name, made in names.items():
        monkeypatch.setitem(sys.modules, name, made)
    monkeypatch.setattr("time.sleep", lambda seconds: None)
    # Here one vehicle follows the other.
    monkeypatch.setattr("threading.Barrier", lambda parties: SimpleNamespace(wait=lambda: None))
    runpy.run_path(str(script), run_name="__main__")
    return calls


@pytest.mark.parametrize(("aside", "volts", "says"), [(0.5, 4.1, "is 0.50 m from"), (0.0, 3.6, "has 3.60 V left")])
def test_with_cflib_nobody_takes_off_either_where_one_is_not_ready(
    aside: float, volts: float, says: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    flown = wandered(2)
    folder = written(tmp_path, exported("cflib", flown))
    calls: dict[str, Own] = {}
    with pytest.raises(SystemExit, match=says):
        with_cflib(folder / "fly.py", below(flown, aside, volts), monkeypatch, calls=calls)
    assert not {"arm", "takeoff", "land"} & {name for own in calls.values() for name, _, _ in own}


@pytest.mark.parametrize(("fails", "lands", "stops"), [("go_to", 2, 0), ("land", 1, 2)])
def test_with_cflib_too_everybody_lands_and_if_that_fails_all_motors_stop(
    fails: str, lands: int, stops: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    flown = wandered(2)
    folder = written(tmp_path, exported("cflib", flown))
    calls: dict[str, Own] = {}
    with pytest.raises(RuntimeError, match=f"{fails} failed"):
        with_cflib(folder / "fly.py", below(flown), monkeypatch, fails=fails, calls=calls)
    names = [name for own in calls.values() for name, _, _ in own]
    assert (names.count("land"), names.count("emergency")) == (lands, stops)


def test_the_scripts_speak_of_what_cflib_has() -> None:
    """The methods and words that the script uses are those of the real package."""
    import inspect

    commander = pytest.importorskip("cflib.crazyflie.high_level_commander").HighLevelCommander
    swarm = pytest.importorskip("cflib.crazyflie.swarm")
    start = inspect.signature(commander.start_trajectory).parameters
    assert list(start)[1:3] == ["trajectory_id", "time_scale"]
    assert {"relative_position", "relative_yaw", "reversed"} <= set(start)
    assert list(inspect.signature(commander.define_trajectory).parameters)[1:] == [
        "trajectory_id", "offset", "n_pieces", "type",
    ]  # fmt: skip
    assert (commander.TRAJECTORY_TYPE_POLY4D, commander.TRAJECTORY_TYPE_POLY4D_COMPRESSED) == (0, 1)
    go = list(inspect.signature(commander.go_to).parameters)[1:7]
    assert go == ["x", "y", "z", "yaw", "duration_s", "relative"]
    logs, logger, platform, places = (
        pytest.importorskip(f"cflib.crazyflie.{name}")
        for name in ("log", "syncLogger", "platformservice", "localization")
    )
    assert {"name", "period_in_ms"} <= set(inspect.signature(logs.LogConfig.__init__).parameters)
    assert {"__enter__", "__exit__", "__iter__"} <= set(dir(logger.SyncLogger))
    assert list(inspect.signature(platform.PlatformService.send_arming_request).parameters)[1:] == ["do_arm"]
    assert list(inspect.signature(places.Localization.send_emergency_stop).parameters) == ["self"]
    assert "rw_cache" in inspect.signature(swarm.CachedCfFactory.__init__).parameters
    assert list(inspect.signature(swarm.Swarm.parallel_safe).parameters)[1:] == ["func", "args_dict"]


# ------------------------------------------------------------------ names


@pytest.mark.parametrize("name", [HOSTILE, "null", "0x10", "yes", "import os"])
def test_names_stay_names_in_every_language(name: str) -> None:
    yaml = pytest.importorskip("yaml")
    flown = renamed(wandered(2), name)
    for form in ("crazyswarm2", "cflib"):
        files = exported(form, flown)
        space: dict[str, Any] = {"__name__": "read", "__file__": "/nowhere/fly.py"}
        source = files["fly.py"].decode("ascii").replace("from crazyflie_py", "#").replace("import cflib", "#")
        exec(compile(source.replace("from cflib", "#"), "fly.py", "exec"), space)
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
