"""What is exported is read back by programs that are not ours, and is the flight that was verified."""

from __future__ import annotations

import base64
import csv
import io
import json
import math
import re
import struct
import zipfile
from dataclasses import replace
from itertools import combinations, pairwise, product
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from missionc.base.diagnostics.code import NOT_EXPORTED
from missionc.base.diagnostics.model import Diagnostic
from missionc.base.palette import DARK
from missionc.geometry.curves.piecewise_polynomials import Pieces, control_points
from missionc.ir import Box, Vehicle
from missionc.output.export import skybrush, takeoff_and_landing, verified_flight
from missionc.output.export.cflib import compress
from missionc.output.export.fill_templates import render
from missionc.output.export.fly_script import for_templates
from missionc.output.export.formats import FORMATS, Exported, Flight
from missionc.output.export.samples import RATE, sampled
from missionc.output.export.takeoff_and_landing import GROUND, phases
from missionc.output.export.trajectory_memory import raw
from missionc.output.export.verified_flight import Part
from tests.support.hand_made_flights import cramped, place, turning, wandered
from tests.support.legal_plans import still

Array = NDArray[np.float64]

COLUMNS = ["idx", "t", *(kind + axis for kind in "pva" for axis in "xyz"), "yaw", "mode", "ledr", "ledg", "ledb"]
ROUNDING = 1e-5
"""Metres: at a joint either piece may be asked, and float32 numbers of some tens of metres differ by so much."""

FLIGHTS = [
    pytest.param(wandered(2, 6, 2), id="plane"),
    pytest.param(wandered(3, 6, 3), id="volume"),
    pytest.param(wandered(2, 7, 3, 1 / 3), id="thirds of a second"),
]


def exported(name: str, flight: Flight) -> Exported:
    made = FORMATS[name].export(flight)
    assert isinstance(made, Exported), made
    return made


# ------------------------------------------------------------------ memory


@pytest.mark.parametrize("flight", FLIGHTS)
def test_raw_bytes_are_those_that_cflib_packs(flight: Flight) -> None:
    memory = pytest.importorskip("cflib.crazyflie.mem")
    made = exported("cflib", flight).files
    for each in flight.parts:
        pieces = [
            memory.Poly4D(duration, *(memory.Poly4D.Poly(axis) for axis in axes))
            for duration, axes in zip(each.pieces.duration.tolist(), each.pieces.coefficients.tolist(), strict=True)
        ]
        assert uploaded(memory, pieces) == made[f"{each.file}.bin"] == raw(each.pieces)


def uploaded(memory: object, trajectory: list[object]) -> bytes:
    """What cflib's trajectory memory hands to the radio."""
    wrote: list[bytes] = []

    class Handler:
        def write(self, memory: object, address: int, data: bytearray, flush_queue: bool) -> None:
            assert address == 0
            wrote.append(bytes(data))

    own = memory.TrajectoryMemory(1, memory.MemoryElement.TYPE_TRAJ, 4096, Handler())  # type: ignore[attr-defined]
    own.trajectory = trajectory
    assert own.write_data(None) == len(wrote[0]) <= 4096
    return wrote[0]


def nudged(number: float) -> float:
    """So that cflib, which truncates, comes to what was meant."""
    return number + math.copysign(1e-6, number)


@pytest.mark.parametrize("flight", [*FLIGHTS, pytest.param(wandered(1, 40, 3, 0.5), id="long")])
def test_compressed_bytes_are_those_that_cflib_packs(flight: Flight) -> None:
    memory = pytest.importorskip("cflib.crazyflie.mem")
    for each in flight.parts:
        packed = compress(each.pieces)
        assert not isinstance(packed, str)
        start = [nudged(value) for value in packed.points[0, :, 0].tolist()]
        elements: list[object] = [memory.CompressedStart(*start, 0.0)]
        for points, duration in zip(packed.points.tolist(), packed.duration.tolist(), strict=True):
            axes = [[nudged(value) for value in axis[1:]] if len(set(axis)) > 1 else [] for axis in points]
            elements.append(memory.CompressedSegment(nudged(duration), *axes, []))
        elements.append(memory.CompressedSegment(0.0, [], [], [], []))
        assert uploaded(memory, elements) == packed.blob


def unpacked(blob: bytes) -> list[tuple[float, Array]]:
    """Seconds and control points (3, 8) of every piece, by the firmware's description of the format."""
    last = list(struct.unpack_from("<hhhh", blob))
    place, pieces = 8, []
    while True:
        types, lasting = struct.unpack_from("<BH", blob, place)
        place += 3
        if lasting == 0:
            assert place == len(blob)
            return pieces
        points = np.zeros((3, 8))
        for axis in range(4):
            count = (0, 1, 3, 7)[types >> 2 * axis & 3]
            own = [last[axis], *struct.unpack_from(f"<{count}h", blob, place)]
            place += 2 * count
            last[axis] = own[-1]
            assert count in (0, 7)
            if axis < 3:
                points[axis] = own if count else own * 8
        pieces.append((lasting / 1000, points / 1000))


@pytest.mark.parametrize("flight", [*FLIGHTS, pytest.param(wandered(1, 40, 3, 0.5), id="long")])
def test_the_compressed_flight_is_as_near_as_it_says_and_keeps_time(flight: Flight) -> None:
    for each in flight.parts:
        packed = compress(each.pieces)
        assert not isinstance(packed, str)
        begin, farthest = 0.0, 0.0
        for lasting, points in unpacked(packed.blob):
            for share in np.linspace(0, 1, 21):
                weights = [math.comb(7, i) * share**i * (1 - share) ** (7 - i) for i in range(8)]
                there = place(each, begin + share * lasting)[:3]
                farthest = max(farthest, float(np.linalg.norm(points @ weights - there)))
            begin += lasting
        assert 0 < farthest <= packed.deviation < 3e-3
        # Rounded to the nearest, never cut off.
        exact = control_points(each.pieces.coefficients[:, :3], each.pieces.duration)
        assert np.abs(packed.points - exact).max() <= 5.1e-4
        assert abs(begin - flight.duration) <= 5e-4


def test_durations_are_rounded_so_that_their_sum_does_not_drift() -> None:
    coefficients = np.zeros((200, 4, 8))
    durations = np.full(200, np.float32(1 / 30)).astype(np.float64)
    packed = compress(Pieces(durations, coefficients))
    assert not isinstance(packed, str)
    assert abs(packed.duration.sum() - 200 / 30) <= 5e-4
    assert set((packed.duration * 1000).round().astype(int).tolist()) == {33, 34}


@pytest.mark.parametrize(
    ("axis", "value", "word"), [(3, 0.1, "its yaw changes"), (0, 33.0, "32.767 m"), (1, -40.0, "32.767 m")]
)
def test_what_the_compressed_form_cannot_hold_is_said(axis: int, value: float, word: str) -> None:
    coefficients = np.zeros((2, 4, 8))
    coefficients[:, axis, 0] = value
    reason = compress(Pieces(np.ones(2), coefficients))
    assert isinstance(reason, str)
    assert word in reason
    reason = compress(Pieces(np.array([1.0, 70.0]), np.zeros((2, 4, 8))))
    assert isinstance(reason, str)
    assert "70 s" in reason


def test_what_does_not_fit_raw_is_compressed_and_what_that_costs_is_shown() -> None:
    flight = cramped(wandered(2, 12, 3), 2000)
    made = exported("cflib", flight)
    assert "compressed, " in made.notes[0]
    assert len(made.notes) == 3
    for each, note in zip(flight.parts, made.notes[1:], strict=True):
        packed = compress(each.pieces)
        assert not isinstance(packed, str)
        assert made.files[f"{each.file}.bin"] == packed.blob
        assert len(packed.blob) <= 2000 < len(raw(each.pieces))
        told = float(note.partition("at most ")[2].split()[0])
        assert packed.deviation * 1e3 <= told <= packed.deviation * 1e3 + 0.01
        assert f"`{told:.2f}` |\n".encode() in made.files["README.md"]
    pieces = flight.parts[0].pieces.duration.size
    assert f"KIND, PIECES = (1, {pieces})".encode() in made.files["fly.py"]
    refused = FORMATS["crazyswarm2"].export(flight)
    assert isinstance(refused, Diagnostic)
    assert refused.code is NOT_EXPORTED


def test_what_fits_in_neither_form_is_refused_with_both_sizes() -> None:
    flight = cramped(wandered(2, 12, 3), 500)
    refused = FORMATS["cflib"].export(flight)
    assert isinstance(refused, Diagnostic)
    assert refused.code is NOT_EXPORTED
    sizes = [compress(each.pieces) for each in flight.parts]
    most = max(len(each.blob) for each in sizes if not isinstance(each, str))
    assert f"{len(raw(flight.parts[0].pieces))} bytes; the memory has 500" in refused.message
    assert refused.notes == (f"compressed it takes {most} bytes",)


def test_a_rounded_flight_that_comes_too_close_is_refused() -> None:
    """The same flight in a mission that asks for more than it keeps: only what is compressed is judged again."""
    flight = cramped(wandered(2, 12, 2), 2000)
    near = replace(flight, mission=replace(flight.mission, world=replace(flight.mission.world, low=(5.0, 5.0))))
    refused = FORMATS["cflib"].export(near)
    assert isinstance(refused, Diagnostic)
    assert "compressed `flown world` fails" in refused.message


# ------------------------------------------------------------------ tables, messages and shows


@pytest.mark.parametrize("flight", FLIGHTS)
def test_a_px4_table_is_the_flight_in_north_east_down(flight: Flight) -> None:
    made = exported("px4", flight).files
    for each in flight.parts:
        rows = list(csv.DictReader(io.StringIO(made[f"Drone {each.agent.index + 1}.csv"].decode())))
        assert list(rows[0]) == COLUMNS
        assert float(rows[-1]["t"]) == pytest.approx(flight.duration, abs=1e-8)
        assert [int(row["idx"]) for row in rows] == list(range(len(rows)))
        for row in rows:
            for order, letter in enumerate("pva"):
                x, y, z, yaw = place(each, float(row["t"]), order).tolist()
                told = [float(row[letter + axis]) for axis in "xyz"]
                assert told == pytest.approx([x, -y, -z], abs=10.0**order * ROUNDING)
                assert order > 0 or float(row["yaw"]) == pytest.approx(-math.degrees(yaw), abs=1e-6)


@pytest.mark.parametrize("flight", FLIGHTS)
def test_a_ros_message_is_the_flight(flight: Flight) -> None:
    yaml = pytest.importorskip("yaml")
    message = yaml.safe_load(exported("ros2", flight).files["trajectory.yaml"])
    assert set(message) == {"header", "joint_names", "points"}
    assert message["header"] == {"stamp": {"sec": 0, "nanosec": 0}, "frame_id": "world"}
    assert message["joint_names"] == [each.agent.name for each in flight.parts]
    for point in message["points"]:
        time = point["time_from_start"]["sec"] + point["time_from_start"]["nanosec"] * 1e-9
        assert set(point) == {"transforms", "velocities", "accelerations", "time_from_start"}
        assert len(point["velocities"]) == len(point["accelerations"]) == len(flight.parts)
        for each, transform in zip(flight.parts, point["transforms"], strict=True):
            told = [transform["translation"][axis] for axis in "xyz"]
            assert told == pytest.approx(place(each, time)[:3].tolist(), abs=ROUNDING)
            assert transform["rotation"] == {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0}
            assert all(isinstance(number, float) for number in told)
    last = message["points"][-1]
    assert all(abs(value) < 1e-4 for twist in last["velocities"] for value in twist["linear"].values())


@pytest.mark.parametrize("flight", FLIGHTS)
def test_an_mcap_file_holds_the_poses(flight: Flight) -> None:
    reader = pytest.importorskip("mcap.reader")
    content = exported("mcap", flight).files["flight.mcap"]
    seen: dict[str, list[float]] = {}
    robots = {each.robot: each for each in flight.parts}
    for schema, channel, message in reader.make_reader(io.BytesIO(content), validate_crcs=True).iter_messages():
        told = json.loads(message.data)
        assert channel.message_encoding == "json"
        assert set(json.loads(schema.data)["properties"]) == set(told)
        _, robot, kind = channel.topic.split("/")
        assert schema.name == {"pose": "foxglove.PoseInFrame", "path": "foxglove.PosesInFrame"}[kind]
        if kind == "path":
            continue
        time = told["timestamp"]["sec"] + told["timestamp"]["nsec"] * 1e-9
        assert message.log_time == round(time * 1e9)
        seen.setdefault(robot, []).append(time)
        where = [told["pose"]["position"][axis] for axis in "xyz"]
        assert where == pytest.approx(place(robots[robot], time)[:3].tolist(), abs=ROUNDING)
    assert set(seen) == set(robots)
    for times in seen.values():
        assert times[0] == 0
        assert times[-1] == pytest.approx(flight.duration, abs=1e-8)
        assert max(np.diff(times)) <= 0.05 + 1e-8


def test_a_px4_readme_says_whose_each_table_is() -> None:
    flight = wandered(2, 6, 3)
    readme = exported("px4", flight).files["README.md"].decode()
    for each in flight.parts:
        x, y, z = each.first
        row = (each.agent.name, each.agent.index + 1, f"Drone {each.agent.index + 1}.csv", x, -y, z)
        assert "| " + " | ".join(f"`{word}`" for word in row) + " |" in readme


@pytest.mark.parametrize("late", [75e-9, -75e-9, 0.0])
def test_a_flight_that_ends_beside_a_sample_is_not_sampled_twice_there(late: float) -> None:
    (part, *_) = wandered(1, 6, 3).parts
    duration = part.pieces.duration * ((15.0 + late) / part.pieces.duration.sum())
    long = replace(part, pieces=Pieces(duration, part.pieces.coefficients))
    times = sampled(replace(wandered(1, 6, 3), parts=(long,))).times
    assert times.size == 15 * RATE + 1
    assert times[-1] == pytest.approx(duration.sum(), abs=1e-12)
    assert np.diff(times).min() > 0.04


def show_of(flight: Flight) -> dict[str, Any]:
    with zipfile.ZipFile(io.BytesIO(exported("skybrush", flight).files["show.skyc"])) as archive:
        assert archive.testzip() is None
        assert archive.namelist() == ["show.json"]
        show = json.loads(archive.read("show.json"))
    assert isinstance(show, dict)
    return show


def flown_whole(flight: Flight, each: Part, time: float) -> Array:
    """Where a vehicle is when the whole flight has lasted for so long: x, y, z, yaw."""
    lasting = phases(flight, GROUND)
    begins = lasting.rise + lasting.settle
    there = place(each, min(max(time - begins, 0.0), flight.duration))
    share = np.polynomial.Polynomial([0, 0, 0, 0, 35, -84, 70, -20])
    if time < lasting.rise:
        there[2] *= share(time / lasting.rise)
    sunk = time - begins - flight.duration - lasting.settle
    if sunk > 0:
        there[2] *= 1 - share(min(sunk / lasting.sink, 1.0))
    return there


@pytest.mark.parametrize("flight", FLIGHTS)
def test_a_skybrush_show_flies_within_a_millimetre_from_the_floor_to_the_floor(flight: Flight) -> None:
    made, show = exported("skybrush", flight), show_of(flight)
    assert show["version"] == 1
    drones = show["swarm"]["drones"]
    assert [drone["settings"]["name"] for drone in drones] == [each.agent.name for each in flight.parts]
    bound = float(made.notes[0].rpartition("at most ")[2].split()[0]) / 1000
    assert bound <= 1.01e-3
    farthest, lasting = 0.0, phases(flight, GROUND)
    whole = lasting.rise + lasting.settle + flight.duration + lasting.settle + lasting.sink
    for each, drone in zip(flight.parts, drones, strict=True):
        points = drone["settings"]["trajectory"]["points"]
        assert points[0][0] == drone["settings"]["trajectory"]["takeoffTime"] == 0
        assert points[0][1] == drone["settings"]["home"] == pytest.approx([*each.first[:2], 0], abs=1e-5)
        assert points[-1][1] == drone["settings"]["landAt"] == pytest.approx([*each.last[:2], 0], abs=1e-5)
        assert abs(points[-1][0] - whole) <= 1e-3
        for (begin, first, _), (end, last, inner) in pairwise(points):
            assert round(end * 1000) == pytest.approx(end * 1000, abs=1e-6)
            assert end > begin
            assert len(inner) in (0, 2)
            control = np.array([first, *(inner or [first, last]), last])
            for share in np.linspace(0, 1, 9):
                weights = np.array([math.comb(3, i) * share**i * (1 - share) ** (3 - i) for i in range(4)])
                there = flown_whole(flight, each, begin + share * (end - begin))
                farthest = max(farthest, float(np.linalg.norm(weights @ control - there[:3])))
    assert 0 < farthest <= bound


def test_a_skybrush_show_turns_noses_the_way_they_are_flown() -> None:
    flight = turning(wandered(2, 6, 3), 0.25)
    lasting = phases(flight, GROUND)
    for each, drone in zip(flight.parts, show_of(flight)["swarm"]["drones"], strict=True):
        control = drone["settings"]["yawControl"]
        assert control["version"] == 1
        times, degrees = np.array(control["setpoints"]).T
        assert times[0] == 0
        assert times.size < 20
        for time in np.linspace(0, times[-1], 301).tolist():
            if min(abs(time - lasting.rise - lasting.settle - edge) for edge in (0, flight.duration)) > 0.1:
                flown = -math.degrees(flown_whole(flight, each, time)[3])
                assert np.interp(time, times, degrees) == pytest.approx(flown, abs=0.1)


def test_a_skybrush_show_lights_every_drone_in_a_colour_of_its_own() -> None:
    flight = wandered(3, 6, 2)
    drones = show_of(flight)["swarm"]["drones"]
    programs = [base64.b64decode(drone["settings"]["lights"]["data"]) for drone in drones]
    assert [f"#{program[1:4].hex()}" for program in programs] == list(DARK["agents"][:3])
    for program, drone in zip(programs, drones, strict=True):
        assert program[0] == 4
        assert program[-1] == 0
        frames = sum((byte & 0x7F) << 7 * place for place, byte in enumerate(program[4:-1]))
        assert 0 <= frames / 50 - drone["settings"]["trajectory"]["points"][-1][0] <= 0.021


def test_a_skybrush_show_that_cannot_rise_from_the_floor_is_refused() -> None:
    flight = wandered(2)
    x, y, _ = flight.parts[0].first
    table = still(Box((x - 0.3, y - 0.3, 0.0), (x + 0.3, y + 0.3, 0.2)), "table")
    refused = FORMATS["skybrush"].export(replace(flight, mission=replace(flight.mission, obstacles=(table,))))
    assert isinstance(refused, Diagnostic)
    assert refused.code is NOT_EXPORTED
    assert "cannot take off vertically" in refused.message


def test_what_the_clock_on_board_costs_is_said_where_a_firmware_flies() -> None:
    flight = wandered(2)
    moments = np.linspace(0, flight.duration, 601)
    fastest = max(float(np.linalg.norm(place(each, time, 1)[:3])) for each in flight.parts for time in moments)
    for name in ("crazyswarm2", "cflib"):
        readme = exported(name, flight).files["README.md"].decode()
        told = float(readme.partition("displaces a vehicle by at most `")[2].partition("`")[0])
        assert fastest * 2**-10 * 1e3 <= told <= fastest * 2**-10 * 1e3 * 1.3 + 0.1


def test_each_item_of_a_readme_has_a_line_of_its_own() -> None:
    flight = cramped(wandered(2, 12, 3), 2000)
    given = for_templates(flight) | {"kind": "compressed", "pieces": 1, "bytes": 1, "memory": 1}
    within = {"within": dict.fromkeys((each.file for each in flight.parts), "0")}
    for form, in_flight, whole in product(("crazyswarm2", "cflib"), (False, True), (False, True)):
        readme = render(f"{form}/README.md.j2", **given | within | {"in_flight": in_flight, "whole": whole}).decode()
        _, safety = readme.split("## Safety\n\n")
        assert all(each.startswith("- ") for each in safety.splitlines())
        assert not re.search(r"\S *- (?=[A-Z`])", readme)


def test_noses_that_turn_are_exported_where_a_form_knows_them() -> None:
    yaml = pytest.importorskip("yaml")
    flight = turning(wandered(2, 6, 3), 0.25)
    (first, _) = flight.parts
    for row in csv.DictReader(io.StringIO(exported("px4", flight).files["Drone 1.csv"].decode())):
        assert float(row["yaw"]) == pytest.approx(-math.degrees(0.5 + 0.25 * float(row["t"])), abs=1e-4)
    for point in yaml.safe_load(exported("ros2", flight).files["trajectory.yaml"])["points"]:
        time = point["time_from_start"]["sec"] + point["time_from_start"]["nanosec"] * 1e-9
        turn = point["transforms"][0]["rotation"]
        assert 2 * math.atan2(turn["z"], turn["w"]) == pytest.approx(0.5 + 0.25 * time, abs=1e-6)
        assert point["velocities"][0]["angular"] == {"x": 0.0, "y": 0.0, "z": 0.25}
    assert b"0.5)" in exported("cflib", flight).files["fly.py"]
    assert exported("cflib", flight).files["drone0.bin"] == raw(first.pieces)
    refused = FORMATS["cflib"].export(cramped(flight, 1000))
    assert isinstance(refused, Diagnostic)
    assert "`drone[0]` cannot be compressed: its yaw changes" in refused.notes[0]


def test_a_skybrush_show_that_strays_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    """Coordinates in whole micrometres cannot be within a tenth of one."""
    for module in (skybrush, skybrush):
        monkeypatch.setattr(module, "CLOSE", 1e-7)
    refused = FORMATS["skybrush"].export(wandered(2, 6, 2))
    assert isinstance(refused, Diagnostic)
    assert refused.code is NOT_EXPORTED


def sampled_show(show: dict[str, Any]) -> tuple[Array, Array, Array]:
    """Positions at common times, (drones, samples, 3), and of each cubic the heights, (samples,), and velocities."""
    heights, velocities, paths = [], [], []
    shares = np.linspace(0, 1, 41)[:, None]
    times = np.linspace(0, show["swarm"]["drones"][0]["settings"]["trajectory"]["points"][-1][0], 2001)
    for drone in show["swarm"]["drones"]:
        along, passed = [], []
        for (begin, first, _), (end, last, inner) in pairwise(drone["settings"]["trajectory"]["points"]):
            control = np.array([first, *(inner or [first, last]), last])
            if not inner:
                control = np.linspace(control[0], control[-1], 4)
            weights = [math.comb(3, i) * shares**i * (1 - shares) ** (3 - i) for i in range(4)]
            place = np.sum([weight * point for weight, point in zip(weights, control, strict=True)], axis=0)
            slope = np.diff(control, axis=0) * 3 / (end - begin)
            weights = [math.comb(2, i) * shares**i * (1 - shares) ** (2 - i) for i in range(3)]
            velocities.append(np.sum([weight * point for weight, point in zip(weights, slope, strict=True)], axis=0))
            heights.append(place[:, 2])
            along.append(place)
            passed.append(begin + shares[:, 0] * (end - begin))
        place, passed_by = np.concatenate(along), np.concatenate(passed)
        paths.append(np.stack([np.interp(times, passed_by, place[:, axis]) for axis in range(3)], axis=-1))
    return np.array(paths), np.concatenate(heights), np.concatenate(velocities)


def nearest(paths: Array) -> float:
    pairs = combinations(range(len(paths)), 2)
    return min(float(np.linalg.norm(paths[one] - paths[other], axis=-1).min()) for one, other in pairs)


@pytest.mark.parametrize("flight", [*FLIGHTS, pytest.param(wandered(1, 6, 3), id="alone")])
def test_the_limits_of_a_skybrush_show_are_those_that_it_keeps(flight: Flight) -> None:
    show = show_of(flight)
    limits = show["settings"]["validation"]
    paths, heights, velocities = sampled_show(show)
    seen = {
        "maxAltitude": heights.max(),
        "maxVelocityXY": np.linalg.norm(velocities[:, :2], axis=-1).max(),
        "maxVelocityZ": np.abs(velocities[:, 2]).max(),
    }
    for name, value in seen.items():
        assert value <= limits[name] + 1e-9, name
        assert limits[name] <= value * 1.002 + 0.011, name
    assert limits["minDistance"] == pytest.approx(0.3 if len(paths) > 1 else 0.0)
    assert len(paths) == 1 or nearest(paths) >= limits["minDistance"]


def test_vehicles_on_the_floor_that_are_nearer_than_required_in_the_air_are_no_violation(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Above pads vehicles rise in turns, and may stand nearer to each other than they fly."""
    monkeypatch.setattr(takeoff_and_landing, "turns_of", lambda flight: ((0,), (1,)))
    flight = wandered(2, 6, 3)
    show = show_of(replace(flight, mission=replace(flight.mission, separation=30.0)))
    seen = nearest(sampled_show(show)[0])
    assert seen < 30
    assert seen * 0.998 - 0.003 <= show["settings"]["validation"]["minDistance"] <= seen


def test_a_skybrush_show_sinks_to_the_floor_no_faster_than_the_profile_allows() -> None:
    made = wandered(2, 6, 3)
    for speed in (0.5, 0.25):
        slow = tuple(replace(agent, vehicle=Vehicle("slow", vertical_speed=speed)) for agent in made.mission.agents)
        texts = {each.agent.name: each.text for each in made.parts}
        careful = verified_flight.flight(replace(made.mission, agents=slow), made.kernel, made.trace, texts)
        begins = phases(careful).before - phases(careful).hover + phases(careful).settle + careful.duration
        for drone in show_of(careful)["swarm"]["drones"]:
            points = drone["settings"]["trajectory"]["points"]
            for (begin, first, _), (end, last, inner) in pairwise(points):
                control = np.array([first, *(inner or [first, last]), last])[:, 2]
                if end <= phases(careful).rise or begin >= begins:
                    # A cubic may be some millimetres per second faster than the curve that it follows.
                    assert np.abs(np.diff(control)).max() * 3 / (end - begin) <= speed * 1.02
