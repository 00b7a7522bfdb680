"""Export to MCAP, for Foxglove and other readers: poses of each vehicle, as JSON messages of Foxglove's schemas.

Source:
    Foxglove, message schemas PoseInFrame and PosesInFrame; the MCAP specification.
"""

from __future__ import annotations

import io
import json
import math
from collections.abc import Mapping

from missionc.output.export.export_form import Exported, Format
from missionc.output.export.samples import RATE, Samples, clock, sampled
from missionc.output.export.verified_flight import Flight

NAME = "mcap"
FRAME = "world"
LIBRARY = "missionc"
"""Library name in the file, without the version of the writer, which would change the bytes."""


def _object(**properties: object) -> dict[str, object]:
    return {"type": "object", "properties": properties}


def _numbers(letters: str) -> dict[str, object]:
    return _object(**{letter: {"type": "number"} for letter in letters})


TIME = _object(sec={"type": "integer", "minimum": 0}, nsec={"type": "integer", "minimum": 0, "maximum": 999_999_999})
POSE = _object(position=_numbers("xyz"), orientation=_numbers("xyzw"))
ONE = _object(timestamp=TIME, frame_id={"type": "string"}, pose=POSE)
MANY = _object(timestamp=TIME, frame_id={"type": "string"}, poses={"type": "array", "items": POSE})


def write(flight: Flight) -> Exported:
    """File ``flight.mcap`` with ``/NAME/pose`` over time and ``/NAME/path`` at the beginning, for each vehicle."""
    from mcap.writer import CompressionType, Writer

    samples = sampled(flight)
    buffer = io.BytesIO()
    writer = Writer(buffer, compression=CompressionType.NONE)
    writer.start(profile="", library=LIBRARY)
    one = writer.register_schema("foxglove.PoseInFrame", "jsonschema", _json(ONE))
    many = writer.register_schema("foxglove.PosesInFrame", "jsonschema", _json(MANY))
    writer.add_metadata("mission", {"name": flight.mission.name})
    poses = [writer.register_channel(f"/{each.robot}/pose", "json", one) for each in flight.parts]
    paths = [writer.register_channel(f"/{each.robot}/path", "json", many) for each in flight.parts]
    for agent, channel in enumerate(paths):
        whole = [_pose(samples, agent, row) for row in range(samples.times.size)]
        writer.add_message(channel, 0, _json({**_head(0.0), "poses": whole}), 0)
    for row, time in enumerate(samples.times.tolist()):
        stamp = round(time * 1e9)
        for agent, channel in enumerate(poses):
            writer.add_message(channel, stamp, _json({**_head(time), "pose": _pose(samples, agent, row)}), stamp)
    writer.finish()  # type: ignore[no-untyped-call]
    return Exported({"flight.mcap": buffer.getvalue()})


def _head(time: float) -> dict[str, object]:
    sec, nsec = clock(time)
    return {"timestamp": {"sec": sec, "nsec": nsec}, "frame_id": FRAME}


def _pose(samples: Samples, agent: int, row: int) -> dict[str, object]:
    half = float(samples.yaw[agent, row]) / 2
    place = zip("xyz", samples.position[agent, row].tolist(), strict=True)
    turn = {"x": 0.0, "y": 0.0, "z": round(math.sin(half), 9), "w": round(math.cos(half), 9)}
    return {"position": {letter: round(value, 9) for letter, value in place}, "orientation": turn}


def _json(value: Mapping[str, object]) -> bytes:
    return json.dumps(value, ensure_ascii=True, allow_nan=False, separators=(",", ":")).encode()


FORMAT = Format(NAME, f"poses at {RATE} Hz for Foxglove (MCAP)", write, needs="mcap")
