"""Recordings and messages that are exported are read by other people's readers, and theirs by ours."""

from __future__ import annotations

import io
import json
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import pytest

from missionc.output.export.formats import FORMATS, Exported
from missionc.verification.monitoring.live.mcap_poses import McapPoses
from tests.support.hand_made_flights import place, turning, wandered

pytestmark = pytest.mark.third_party

FLIGHT = turning(wandered(2, 6, 3), 0.25)
PLACES = [(0.5 * second, 1.0, 0.25) for second in range(5)]
TOPICS = {"/cf0/pose": "drone[0]", "/cf1/pose": "drone[1]"}
STAMP = "builtin_interfaces/Time stamp\nstring frame_id"
POSE_STAMPED = f"""std_msgs/Header header
geometry_msgs/Pose pose
{"=" * 80}
MSG: std_msgs/Header
{STAMP}
{"=" * 80}
MSG: geometry_msgs/Pose
geometry_msgs/Point position
geometry_msgs/Quaternion orientation
{"=" * 80}
MSG: geometry_msgs/Point
float64 x
float64 y
float64 z
{"=" * 80}
MSG: geometry_msgs/Quaternion
float64 x
float64 y
float64 z
float64 w
{"=" * 80}
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
"""


def exported(name: str) -> dict[str, bytes]:
    found = FORMATS[name].export(FLIGHT)
    assert isinstance(found, Exported)
    return found.files


def samples(content: bytes) -> list[Any]:
    poses = McapPoses(TOPICS, 3)
    found = [json.loads(line) for line in poses.feed(content)]
    assert poses.over
    return found


EXPECTED = [
    {"t": float(second), "agent": agent, "position": list(where), "heading": pytest.approx(np.pi / 2)}
    for second, where in enumerate(PLACES)
    for agent in TOPICS.values()
]


def test_the_reader_of_mcap_finds_every_checksum_right_and_messages_as_their_schemas_say() -> None:
    pytest.importorskip("mcap")
    from mcap.reader import make_reader

    reader = make_reader(io.BytesIO(exported("mcap")["flight.mcap"]), validate_crcs=True)
    seen: dict[str, int] = {}
    for schema, channel, message in reader.iter_messages():
        assert schema is not None
        if seen.get(channel.topic, 0) % 20 == 0:
            jsonschema.validate(json.loads(message.data), json.loads(schema.data))
        seen[channel.topic] = seen.get(channel.topic, 0) + 1
    poses = seen.pop("/drone0/pose")
    assert poses > 100
    assert seen == {"/drone1/pose": poses, "/drone0/path": 1, "/drone1/path": 1}


def test_rosbags_makes_the_message_of_ros_2_that_our_yaml_says() -> None:
    typesys = pytest.importorskip("rosbags.typesys", reason="there is no rosbags")
    yaml = pytest.importorskip("yaml")
    store = typesys.get_typestore(typesys.Stores.ROS2_JAZZY)
    name = "trajectory_msgs/msg/MultiDOFJointTrajectory"
    content = yaml.safe_load(exported("ros2")["trajectory.yaml"])
    message = made(store, name, content)
    read = store.deserialize_cdr(store.serialize_cdr(message, name), name)
    assert read.joint_names == ["drone[0]", "drone[1]"]
    for point in read.points[:: len(read.points) // 7]:
        time = point.time_from_start.sec + point.time_from_start.nanosec / 1e9
        for part, transform in zip(FLIGHT.parts, point.transforms, strict=True):
            where = transform.translation
            assert [where.x, where.y, where.z] == pytest.approx(place(part, time)[:3].tolist(), abs=1e-6)


def made(store: Any, name: str, content: Any) -> Any:
    """A message out of a dict, which has to have every field of it and no other."""
    fields = store.get_msgdef(name).fields
    assert content.keys() == {each for each, _ in fields}, name
    return store.types[name](**{each: value(store, kind, content[each]) for each, kind in fields})


def value(store: Any, kind: Any, content: Any) -> Any:
    from rosbags.interfaces import Nodetype

    match kind:
        case (Nodetype.NAME, name):
            return made(store, name, content)
        case (Nodetype.ARRAY | Nodetype.SEQUENCE, (item, _)):
            return [value(store, item, each) for each in content]
        case _:
            return content


def test_a_bag_that_rosbags_has_written_is_followed(tmp_path: Path) -> None:
    rosbag2 = pytest.importorskip("rosbags.rosbag2", reason="there is no rosbags")
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_JAZZY)
    of = {
        name.split("/")[-1]: kind
        for name, kind in store.types.items()
        if name.startswith(("geometry", "std", "builtin"))
    }
    name = "geometry_msgs/msg/PoseStamped"
    with rosbag2.Writer(tmp_path / "bag", version=9, storage_plugin=rosbag2.StoragePlugin.MCAP) as bag:
        topics = [bag.add_connection(topic, name, typestore=store) for topic in TOPICS]
        for second, (x, y, z) in enumerate(PLACES):
            stamp = of["Time"](sec=1_700_000_000 + second, nanosec=0)
            turn = of["Quaternion"](x=0.0, y=0.0, z=0.5**0.5, w=0.5**0.5)
            pose = of["Pose"](position=of["Point"](x=x, y=y, z=z), orientation=turn)
            message = of["PoseStamped"](header=of["Header"](stamp=stamp, frame_id="world"), pose=pose)
            for topic in topics:
                bag.write(topic, stamp.sec * 10**9, store.serialize_cdr(message, name))
    (recording,) = (tmp_path / "bag").glob("*.mcap")
    assert samples(recording.read_bytes()) == EXPECTED


def test_a_recording_of_the_writer_for_ros_2_is_followed() -> None:
    writing = pytest.importorskip("mcap_ros2.writer", reason="there is no mcap-ros2-support")
    buffer = io.BytesIO()
    writer = writing.Writer(buffer)
    schema = writer.register_msgdef("geometry_msgs/msg/PoseStamped", POSE_STAMPED)
    for second, (x, y, z) in enumerate(PLACES):
        head = {"stamp": {"sec": second, "nanosec": 0}, "frame_id": "world"}
        turn = {"x": 0.0, "y": 0.0, "z": 0.5**0.5, "w": 0.5**0.5}
        pose = {"position": {"x": x, "y": y, "z": z}, "orientation": turn}
        for topic in TOPICS:
            writer.write_message(topic, schema, {"header": head, "pose": pose}, log_time=second * 10**9)
    writer.finish()
    assert samples(buffer.getvalue()) == EXPECTED
