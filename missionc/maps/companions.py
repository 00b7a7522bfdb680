"""Companions of a file: the other one that it rests on, such as the image of an occupancy grid."""

from __future__ import annotations

from posixpath import basename, splitext

from missionc.base.late_dataclass import dataclass
from missionc.base.source import Source, Span
from missionc.maps.feature import MapError

IMAGES = (".pgm", ".png", ".bmp")
METADATA = (".yaml", ".yml")


@dataclass(frozen=True, slots=True)
class Companion:
    """``path`` is relative to the file's folder, and empty where there is none; it may be absent unless ``needed``."""

    path: str
    needed: bool


NONE = Companion("", False)


def ending(path: str) -> str:
    """The ending of a file's name, with its dot and in small letters."""
    return splitext(path)[1].lower()


def companion(path: str, source: Source) -> Companion:
    """What a file rests on: an image on what its ``.yaml`` says, that on its image."""
    if ending(path) in IMAGES:
        return Companion(f"{splitext(basename(path))[0]}.yaml", needed=False)
    if ending(path) not in METADATA:
        return NONE
    from missionc.maps.map_metadata import read_metadata

    try:
        return Companion(read_metadata(source, Span(source, 0, 0)).image, needed=True)
    except MapError:
        return NONE  # said once it is read
