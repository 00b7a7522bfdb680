"""Poses from a growing MCAP recording, converted from bytes to lines of samples.

in   bytes of a recording, in pieces of any size; the topic of each agent's poses
out  a line of JSON for each pose, as ``SampleReader`` reads it

Poses are Foxglove's ``PoseInFrame`` in JSON, as the export to MCAP writes them, or ``geometry_msgs/msg/PoseStamped`` of
ROS 2 in CDR. An incomplete record waits for its remaining bytes. Times count from the first pose.

Source:
    MCAP specification, version 0; OMG, DDS-XTYPES 1.3, 7.4.1 (plain CDR).
"""

from __future__ import annotations

import io
import json
import math
import struct
from collections.abc import Iterator, Mapping
from typing import Any

from missionc.base.limits import Limits
from missionc.base.strict_json import parse_json

MAGIC = b"\x89MCAP0\r\n"
CHUNK, FOOTER = 0x06, 0x02
FOXGLOVE, ROS = "foxglove.PoseInFrame", "geometry_msgs/msg/PoseStamped"

NANO = 1_000_000_000


class BrokenRecordingError(ValueError):
    """Error: the data is not a valid MCAP recording; the text gives the reason."""


class McapPoses:
    """Incremental reader of poses from the part of an MCAP recording received so far.

    Args:
        agents: agent name for each topic with poses.
        dimension: number of coordinates to return, the dimension of the mission.
        limits: limits on the bytes of a record, an unpacked chunk, and all chunks.
    """

    def __init__(self, agents: Mapping[str, str], dimension: int, limits: Limits | None = None) -> None:
        self.limits = limits or Limits()
        self._unpacked_bytes = 0
        self.agents, self.dimension = dict(agents), dimension
        self.over = False
        """True once the recording has been closed."""
        self._rest = bytearray()
        self._begun = False
        self._schemas: dict[int, str] = {}
        self._channels: dict[int, tuple[str, str, str]] = {}
        self._first: int | None = None

    def feed(self, data: bytes) -> Iterator[str]:
        """Process further bytes; yield a line of JSON for each pose that is now complete.

        Raises:
            BrokenRecordingError: the data is not MCAP, or a record cannot be read.
        """
        self._rest += data
        if not self._begun:
            if not MAGIC.startswith(self._rest[: len(MAGIC)]):
                raise BrokenRecordingError("not an MCAP recording")
            if len(self._rest) < len(MAGIC):
                return
            del self._rest[: len(MAGIC)]
            self._begun = True
        at = 0
        try:
            while not self.over and at + 9 <= len(self._rest):
                kind, size = struct.unpack_from("<BQ", self._rest, at)
                self._allow("chunk_bytes", "a record has", size)
                if at + 9 + size > len(self._rest):
                    break
                record = bytes(self._rest[at : at + 9 + size])
                at += 9 + size
                self.over = kind == FOOTER
                if not self.over:
                    yield from self._record(kind, record)
        finally:
            del self._rest[:at]

    def _allow(self, name: str, what: str, size: int) -> None:
        """Check a size in bytes against the limit called ``name``.

        Raises:
            BrokenRecordingError: the size is above the limit.
        """
        most = getattr(self.limits, name)
        if size > most:
            raise BrokenRecordingError(
                f"{what} {size} bytes; the limit is {most}; raise the limit with `--limit {name}={size}`"
            )

    def _record(self, kind: int, record: bytes) -> Iterator[str]:
        from mcap.records import Channel, Message, Schema
        from mcap.stream_reader import StreamReader

        try:
            if kind == CHUNK:
                size = _claimed(record)
                self._unpacked_bytes += size
                self._allow("chunk_bytes", "a chunk unpacks to", size)
                self._allow("recording_bytes", "it unpacks to", self._unpacked_bytes)
                record = _unpacked(record, size)
            # A footer ends the reader of one record.
            closed = io.BytesIO(record + struct.pack("<BQQQI", FOOTER, 20, 0, 0, 0) + MAGIC)
            found = list(StreamReader(closed, skip_magic=True, validate_crcs=True).records)
        except BrokenRecordingError:
            raise
        except Exception as error:  # from the library and its decompressors
            raise BrokenRecordingError(f"a record in it cannot be read ({type(error).__name__})") from None
        for each in found:
            match each:
                case Schema():
                    self._schemas[each.id] = each.name
                case Channel() if each.topic in self.agents:
                    schema = self._schemas.get(each.schema_id, "")
                    self._channels[each.id] = self.agents[each.topic], schema, each.message_encoding
                case Message() if each.channel_id in self._channels:
                    yield self._line(*self._channels[each.channel_id], each.data)

    def _line(self, agent: str, schema: str, encoding: str, data: bytes) -> str:
        try:
            if (schema, encoding) == (FOXGLOVE, "json"):
                time, place, turn = _foxglove(parse_json(data))
            elif (schema, encoding) == (ROS, "cdr"):
                time, place, turn = _ros(data)
            else:
                return json.dumps(f"{schema} in {encoding}")
            since = (time - (time if self._first is None else self._first)) / NANO
        except (ValueError, KeyError, TypeError, OverflowError, struct.error):
            return json.dumps(f"no {schema} for {agent}")
        if self._first is None:
            self._first = time
        x, y, z, w = turn
        heading = math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
        position = place[: self.dimension]
        sample = {"t": since, "agent": agent, "position": position, "heading": heading}
        return json.dumps(sample)


def _claimed(chunk: bytes) -> int:
    """Unpacked size in bytes that a chunk's header states.

    Raises:
        BrokenRecordingError: the chunk is too short.
    """
    if len(chunk) < 41:
        raise BrokenRecordingError("a chunk in it is too short")
    return int(struct.unpack_from("<Q", chunk, 25)[0])


def _unpacked(chunk: bytes, size: int) -> bytes:
    """Decompress a chunk.

    Raises:
        BrokenRecordingError: the chunk does not contain exactly ``size`` bytes.
    """
    begin = 41 + int(struct.unpack_from("<I", chunk, 37)[0])
    compression, packed = chunk[41:begin], chunk[begin + 8 :]
    if compression == b"zstd":
        import zstandard

        data = zstandard.ZstdDecompressor().stream_reader(packed).read(size + 1)
    elif compression == b"lz4":
        import lz4.frame

        data = lz4.frame.LZ4FrameDecompressor().decompress(packed, max_length=size + 1)
    else:
        data = packed
    if len(data) != size:
        raise BrokenRecordingError(f"a chunk states {size} bytes unpacked, but has {len(data)} or more")
    return struct.pack("<BQ", CHUNK, 40 + size) + chunk[9:37] + struct.pack("<IQ", 0, size) + data


def _foxglove(message: Any) -> tuple[int, list[float], list[float]]:
    stamp, pose = message["timestamp"], message["pose"]
    place, turn = pose["position"], pose["orientation"]
    time = int(stamp["sec"]) * NANO + int(stamp["nsec"])
    return time, [float(place[axis]) for axis in "xyz"], [float(turn[axis]) for axis in "xyzw"]


def _ros(data: bytes) -> tuple[int, list[float], list[float]]:
    """Time in nanoseconds, position and orientation (quaternion) of a ROS 2 pose in CDR."""
    order = "<" if data[1:2] == b"\x01" else ">"
    sec, nanosec, length = struct.unpack_from(f"{order}iII", data, 4)
    begin = 4 + -(-(12 + length) // 8) * 8
    numbers = struct.unpack_from(f"{order}7d", data, begin)
    return sec * NANO + nanosec, list(numbers[:3]), list(numbers[3:])
