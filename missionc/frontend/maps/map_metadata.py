"""Metadata of an occupancy grid in map_server YAML, companion files, and libraries for map formats.

YAML is composed to nodes and never constructed to objects. Each number is read from the text of its node, and checked
with its location in the text.

A companion is another file that a file depends on, such as the image of an occupancy grid. A library for files of other
programs is loaded only if such a file is read, and prints nothing on standard error.

Source:
    wiki.ros.org/map_server, "Map format"; nav2_map_server, ``map_io.cpp``.
"""

from __future__ import annotations

import logging
import math
from importlib import import_module
from posixpath import basename, splitext
from typing import Any

from missionc.base.diagnostics.code import EXTRA_MISSING
from missionc.base.diagnostics.map_error import MapError, unreadable
from missionc.base.late_dataclass import Record
from missionc.base.source import Source, Span
from missionc.base.units import plain_number

IMAGES = (".pgm", ".png", ".bmp")
METADATA = (".yaml", ".yml")


class Companion(Record):
    """Another file that a map file depends on; ``path`` is relative to the file's folder and empty if there is none.

    The file may be absent unless ``needed``.
    """

    path: str
    needed: bool


NONE = Companion("", False)


def ending(path: str) -> str:
    """Extension of a file's name, with its dot and in lower case."""
    return splitext(path)[1].lower()


def companion(path: str, source: Source) -> Companion:
    """Companion of a file: the image that a ``.yaml`` names, or the ``.yaml`` of an image."""
    if ending(path) in IMAGES:
        return Companion(f"{splitext(basename(path))[0]}.yaml", needed=False)
    if ending(path) not in METADATA:
        return NONE

    try:
        return Companion(read_metadata(source, Span(source, 0, 0)).image, needed=True)
    except MapError:
        return NONE  # reported once it is read


def library(module: str, package: str, source: Source, asked: Span) -> Any:
    """Import a module that the extra ``maps`` installs.

    Raises:
        MapError: the module is not installed.
    """
    log = logging.getLogger(module.partition(".")[0])
    if not log.handlers:
        log.addHandler(logging.NullHandler())  # without a handler, its warnings go to standard error
    try:
        return import_module(module)
    except ImportError:
        message = f"`{source.name}` needs the package {package}, which is not installed"
        raise MapError(EXTRA_MISSING, message, asked, "install it with `pip install 'missionc[maps]'`") from None


LONGEST = 1 << 16
"""Maximum number of characters of a metadata file."""

MODES = ("trinary", "scale", "raw")
WRITE = "write the file with `map_saver` of ROS"


class MapMetadata(Record):
    """Metadata of an occupancy grid: resolution, pose, and the meaning of the image's shades.

    ``origin`` is the pose of the lower left corner: metres, metres, radians. A cell is occupied if its darkness, from 0
    to 1, is at least ``occupied``, and free if it is at most ``free``; ``negate`` means that white is occupied.
    """

    image: str
    resolution: float
    origin: tuple[float, float, float] = (0.0, 0.0, 0.0)
    negate: bool = False
    occupied: float = 0.65
    free: float = 0.196
    mode: str = "trinary"


def read_metadata(source: Source, asked: Span) -> MapMetadata:
    """Metadata of an occupancy grid from a YAML file.

    Args:
        asked: the words that request the file.

    Raises:
        MapError: the file is not in the format of ROS.
    """
    yaml = library("yaml", "PyYAML", source, asked)
    whole = Span(source, 0, 0) if source.text else asked
    if not source.text or len(source.text) > LONGEST:
        raise unreadable(source, f"it is empty or has more than {LONGEST} characters", whole, WRITE)
    try:
        root = yaml.compose(source.text, Loader=yaml.SafeLoader)
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        place = Span(source, min(mark.index, len(source.text)), len(source.text)) if mark else whole
        raise unreadable(source, "not valid YAML", place.first_line, WRITE) from None
    except RecursionError:
        raise unreadable(source, "nested too deeply", whole, WRITE) from None
    if not isinstance(root, yaml.MappingNode):
        raise unreadable(source, "not a mapping of keys to values", whole, WRITE)
    entries = _Entries(source, whole, {})
    for key, value in root.value:
        if key.id == "scalar" and key.value in entries.nodes:
            raise entries.wrong(key.value, f"duplicate key `{key.value[:40]}`", "delete one of the keys")
        if key.id == "scalar":
            entries.nodes[key.value] = value
    return entries.read()


class _Entries(Record):
    source: Source
    whole: Span
    nodes: dict[str, Any]

    def read(self) -> MapMetadata:
        plain = MapMetadata("", 0.0)
        resolution = self.number("resolution")
        if resolution <= 0:
            raise self.wrong("resolution", "the cell size, in metres, must be above 0")
        occupied, free = self.number("occupied_thresh", plain.occupied), self.number("free_thresh", plain.free)
        if not 0 <= free <= occupied <= 1:
            raise self.wrong("free_thresh", "`free_thresh` must be at most `occupied_thresh`, both from 0 to 1")
        mode = self.text("mode", plain.mode)
        if mode not in MODES:
            raise self.wrong("mode", f"`mode` must be one of {', '.join(f'`{each}`' for each in MODES)}")
        negate = self.text("negate", "0").lower()
        if negate not in ("0", "1", "false", "true"):
            raise self.wrong("negate", "`negate` must be 0 or 1")
        return MapMetadata(self.text("image"), resolution, self.origin(), negate in ("1", "true"), occupied, free, mode)

    def origin(self) -> tuple[float, float, float]:
        node = self.nodes.get("origin")
        items = node.value if node is not None and node.id == "sequence" else []
        if len(items) not in (2, 3):
            raise self.wrong("origin", "expected an origin `[x, y, yaw]`, in metres and radians")
        x, y = (self.number_at(item) for item in items[:2])
        yaw = self.number_at(items[2], "write the yaw `0.0` for an unrotated map") if len(items) == 3 else 0.0
        return x, y, yaw

    def text(self, key: str, default: str = "") -> str:
        node = self.nodes.get(key)
        if node is None and default:
            return default
        if node is None or node.id != "scalar" or not node.value:
            raise self.wrong(key, f"missing key `{key}`")
        return str(node.value)

    def number(self, key: str, default: float | None = None) -> float:
        node = self.nodes.get(key)
        if node is None and default is not None:
            return default
        if node is None:
            raise self.wrong(key, f"missing key `{key}`")
        return self.number_at(node)

    def number_at(self, node: Any, way_out: str = "write a plain number") -> float:
        value = plain_number(node.value) if node.id == "scalar" else math.nan
        if math.isnan(value):
            shown = f"`{node.value[:40]}`" if node.id == "scalar" else f"a {node.id}"
            raise self.wrong_at(node, f"{shown} is not a number", way_out)
        return value

    def wrong(self, key: str, reason: str, way_out: str = WRITE) -> MapError:
        return self.wrong_at(self.nodes.get(key), reason, way_out)

    def wrong_at(self, node: Any, reason: str, way_out: str) -> MapError:
        span = self.whole if node is None else Span(self.source, node.start_mark.index, node.end_mark.index)
        return unreadable(self.source, reason, span.first_line, way_out)
