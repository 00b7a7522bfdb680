"""Poses come out of a recording as it grows, whatever wrote it; what is no recording is said."""

from __future__ import annotations

import io
import json
import struct
import sys
import threading
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from mcap.writer import CompressionType, Writer

from missionc.base.diagnostics.code import RECORDING_BROKEN
from missionc.cli.app import main
from missionc.output.export import mcap as export
from missionc.verification.monitoring.live.mcap_poses import BrokenRecordingError, McapPoses
from tests.support.live_flights import FLIGHT

PLACES = [(1.0, 1.0), (2.3, 2.3), (3.6, 3.6), (4.5, 4.5), (4.5, 4.5)]
TOPICS = {"/drone0/pose": "drone[0]", "/drone1/pose": "drone[1]"}


def foxglove(time: float, x: float, y: float) -> bytes:
    sec, nsec = divmod(round(time * 1e9), 10**9)
    pose = {"position": {"x": x, "y": y, "z": 1.0}, "orientation": {"x": 0, "y": 0, "z": 0.6, "w": 0.8}}
    return json.dumps({"timestamp": {"sec": sec, "nsec": nsec}, "frame_id": "world", "pose": pose}).encode()


def ros(time: float, x: float, y: float, frame: str = "world", order: str = "<") -> bytes:
    """A ``PoseStamped`` in CDR."""
    sec, nsec = divmod(round(time * 1e9), 10**9)
    name = frame.encode() + b"\0"
    head = struct.pack(f"{order}iII", sec, nsec, len(name)) + name
    head += bytes(-len(head) % 8)
    kind = b"\0\1\0\0" if order == "<" else bytes(4)
    return kind + head + struct.pack(f"{order}7d", x, y, 1.0, 0, 0, 0.6, 0.8)


def recording(
    begin: float = 0.0, compression: CompressionType = CompressionType.ZSTD, as_ros: bool = False, size: int = 400
) -> bytes:
    """Two drones, of which the second stands still, a pose each second."""
    buffer = io.BytesIO()
    writer = Writer(buffer, chunk_size=size, compression=compression)
    writer.start()
    if as_ros:
        schema, encoding, message = writer.register_schema("geometry_msgs/msg/PoseStamped", "ros2msg", b""), "cdr", ros
    else:
        shape = json.dumps(export.ONE).encode()
        schema, encoding, message = (
            writer.register_schema("foxglove.PoseInFrame", "jsonschema", shape),
            "json",
            foxglove,
        )
    channels = [writer.register_channel(topic, encoding, schema) for topic in (*TOPICS, "/rosout")]
    for second, (x, y) in enumerate(PLACES):
        for channel, place in zip(channels, ((x, y), (2.0, 1.0), (0.0, 0.0)), strict=True):
            stamp = round((begin + second) * 1e9)
            writer.add_message(channel, stamp, message(begin + second, *place), stamp)
    writer.finish()
    return buffer.getvalue()


def lines(pieces: Sequence[bytes]) -> list[Any]:
    poses = McapPoses(TOPICS, 2)
    return [json.loads(line) for piece in pieces for line in poses.feed(piece)]


EXPECTED = [
    {"t": float(second), "agent": agent, "position": list(place), "heading": pytest.approx(1.2870022)}
    for second, first in enumerate(PLACES)
    for agent, place in (("drone[0]", first), ("drone[1]", (2.0, 1.0)))
]


@pytest.mark.parametrize("compression", list(CompressionType))
@pytest.mark.parametrize("as_ros", [False, True])
def test_poses_are_read_whoever_wrote_them(compression: CompressionType, as_ros: bool) -> None:
    assert lines([recording(compression=compression, as_ros=as_ros)]) == EXPECTED


def test_times_count_from_the_first_pose_to_the_nanosecond() -> None:
    assert lines([recording(begin=1_700_000_000.0, as_ros=True)]) == EXPECTED


@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize("frame", ["", "w", "map/of/the/hall"])
def test_a_pose_of_ros_is_read_in_either_order_of_bytes(order: str, frame: str) -> None:
    from missionc.verification.monitoring.live.mcap_poses import _ros

    assert _ros(ros(2.5, 3.0, 4.0, frame, order)) == (2_500_000_000, [3.0, 4.0, 1.0], [0.0, 0.0, 0.6, 0.8])


@given(st.lists(st.integers(1, 500), max_size=12))
def test_it_does_not_matter_in_which_pieces_a_recording_comes(sizes: list[int]) -> None:
    whole, pieces, at = recording(), [], 0
    for size in sizes:
        pieces.append(whole[at : at + size])
        at += size
    assert lines([*pieces, whole[at:]]) == EXPECTED


def test_a_recording_that_is_cut_off_says_what_it_has_and_waits() -> None:
    whole = recording()
    poses = McapPoses(TOPICS, 2)
    begun = list(poses.feed(whole[: len(whole) // 3]))
    assert 0 < len(begun) < len(EXPECTED)
    assert not poses.over
    assert len(begun) + len(list(poses.feed(whole[len(whole) // 3 :]))) == len(EXPECTED)
    assert poses.over


def chunk_spoilt() -> bytes:
    """A chunk has a byte in it that is another one than when it was written."""
    whole = bytearray(recording(compression=CompressionType.NONE))
    whole[whole.index(b'"world"', 1500)] ^= 1
    return bytes(whole)


@pytest.mark.parametrize(
    ("content", "why"),
    [
        (b"no recording", "not an MCAP recording"),
        (b"\x89MCAP0\r\n\x05" + struct.pack("<Q", 1 << 40), "a record has"),
        (b"\x89MCAP0\r\n\x06" + struct.pack("<Q", 32) + bytes(16) + struct.pack("<Q", 1 << 40) + bytes(8), "a chunk"),
        (b"\x89MCAP0\r\n\x03" + struct.pack("<Q", 3) + b"abc", "cannot be read"),
        (chunk_spoilt(), "CRCValidationError"),
    ],
)
def test_what_is_no_recording_is_broken(content: bytes, why: str) -> None:
    with pytest.raises(BrokenRecordingError, match=why):
        lines([content])


def monitored(tmp_path: Path, *words: str) -> int:
    mission = tmp_path / "flight.mission"
    mission.write_text(FLIGHT, encoding="utf-8")
    return main(["monitor", str(mission), "--live", "--mcap", str(tmp_path / "flight.mcap"), *words])


def test_a_recording_is_judged_as_it_grows(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    whole, file = recording(), tmp_path / "flight.mcap"
    file.write_bytes(whole[:200])

    def grow() -> None:
        for begin in range(200, len(whole), 700):
            with file.open("ab") as growing:
                growing.write(whole[begin : begin + 700])

    threading.Timer(0.2, grow).start()
    assert monitored(tmp_path) == 0
    assert "flight: satisfied after 5 of 5 steps" in capsys.readouterr().out


def test_topics_of_others_are_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "flight.mcap").write_bytes(recording())
    words = ("--topic", "/drone1/pose=drone[0]", "--topic", "/drone0/pose=drone[1]")
    assert monitored(tmp_path, *words) == 3
    assert "there  violated (final)" in capsys.readouterr().out


def test_a_broken_recording_ends_the_stream(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "flight.mcap").write_bytes(chunk_spoilt())
    assert monitored(tmp_path) == 1
    streams = capsys.readouterr()
    why = "the recording cannot be read further: a record in it cannot be read (CRCValidationError)"
    assert f"error[{RECORDING_BROKEN.name}]: {why}" in streams.err
    assert "flight: not decided" in streams.out


@pytest.mark.parametrize(
    "words", [("--topic", "/a/pose=scout"), ("--udp", "5005"), ("--topic", "/a/pose")], ids=["agent", "udp", "pair"]
)
def test_what_does_not_go_with_a_recording_is_refused(words: tuple[str, ...], tmp_path: Path) -> None:
    (tmp_path / "flight.mcap").write_bytes(recording())
    assert monitored(tmp_path, *words) == 2


def test_without_the_package_it_is_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "flight.mcap").write_bytes(recording())
    monkeypatch.setitem(sys.modules, "mcap", None)
    monkeypatch.setattr("missionc.cli.commands.monitor.find_spec", lambda name: None)
    assert monitored(tmp_path) == 1
