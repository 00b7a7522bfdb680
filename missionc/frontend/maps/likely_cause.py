"""Likely cause of a file whose features lie outside the world: a change that would bring them inside.

in   the settings of the declaration, the extents of the file and of the world
out  one action for the user
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product

from missionc.frontend.maps.local_frame import geographic, local_frame
from missionc.frontend.maps.map_metadata import IMAGES, METADATA, ending
from missionc.frontend.maps.read_map import box
from missionc.ir.places import Extents, FileRequest

UNITS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "km": 1e3}
SMALLEST = 0.05
"""Minimum extent of features from the file's origin, as a ratio of the world's longer side: any file fits if shrunk."""
DEGREES = (180.0, 90.0)
NEAR = 1.0
"""Maximum extent, in degrees, of a file whose coordinates may be longitude and latitude."""


def likely_cause(asked: FileRequest, extents: Extents, world: Extents) -> str:
    """Suggested change of the file or of its declaration that would bring the features into the world.

    Args:
        extents: extents of the features, metres in the mission's world.
        world: extents of the world, in the plane.

    Raises:
        MapError: the geodesy library is not installed.
    """
    corners = [(x - asked.at[0], y - asked.at[1]) for x, y in product(*zip(*extents, strict=True))]
    hypotheses = _on_earth(asked, corners) if asked.origin is not None else _in_the_plane(asked, corners)
    for way_out, moved in hypotheses:
        if _inside(box((x + asked.at[0], y + asked.at[1]) for x, y in moved), asked.at, world):
            return way_out
    return _elsewhere(asked, extents, corners, world)


def _on_earth(
    asked: FileRequest, corners: list[tuple[float, float]]
) -> Iterator[tuple[str, list[tuple[float, float]]]]:
    """Yield suggestions that exchange longitude and latitude, in the file or in the declaration, with the moved
    corners.
    """
    assert asked.origin is not None
    place = asked.sources[0], asked.span
    degrees = [geographic(asked.origin, *place)(*corner) for corner in corners]
    if all(abs(longitude) <= DEGREES[1] for longitude, _ in degrees):
        frame = local_frame(asked.origin, *place)
        way_out = "swap longitude and latitude in the file or in `origin`; longitude comes first"
        yield way_out, [frame(latitude, longitude) for longitude, latitude in degrees]


def _in_the_plane(
    asked: FileRequest, corners: list[tuple[float, float]]
) -> Iterator[tuple[str, list[tuple[float, float]]]]:
    """Yield suggestions with another unit of length, or with exchanged axes, and the moved corners.

    Images of grids are excluded, since they state their own size.
    """
    if ending(asked.sources[0].name) in (*IMAGES, *METADATA):
        return
    for name, unit in UNITS.items():
        factor = unit / (asked.unit or 1.0)
        way_out = f"set the unit of the file with `unit 1 {name}`"
        if factor != 1:
            yield way_out, [(x * factor, y * factor) for x, y in corners]
    yield "swap `x` and `y` in the file", [(y, x) for x, y in corners]


def _elsewhere(asked: FileRequest, extents: Extents, corners: list[tuple[float, float]], world: Extents) -> str:
    """Text that suggests another origin for the file."""
    if asked.origin is not None:
        longitude, latitude = geographic(asked.origin, asked.sources[0], asked.span)(*corners[0])
        return f"set an origin near the objects: `origin ({longitude:.5f} deg, {latitude:.5f} deg)`"
    unit = asked.unit or 1.0
    file = [(x / unit, y / unit) for x, y in (corners[0], corners[-1])]
    degrees = all(abs(x) <= DEGREES[0] and abs(y) <= DEGREES[1] for x, y in file)
    small = all(abs(last - first) <= NEAR for first, last in zip(*file, strict=True))
    if degrees and small and ending(asked.sources[0].name) in (".geojson", ".json"):
        longitude, latitude = file[0]
        at = f"`origin ({longitude:g} deg, {latitude:g} deg)`"
        return f"write {at} in place of `unit` for longitude and latitude"
    x, y = (place + low - first for place, low, first in zip(asked.at, world[0], extents[0], strict=True))
    return f"shift the file into the world with `at ({x:.10g}, {y:.10g})`"


def _inside(extents: Extents | None, zero: tuple[float, float], world: Extents) -> bool:
    """Return whether at least half of the extents lies in the world along each axis, and they are not tiny."""
    if extents is None:
        return False
    (low, high), (least, most) = extents, world
    half = all(
        min(last, end) - max(first, begin) >= (last - first) / 2
        for first, last, begin, end in zip(low, high, least, most, strict=True)
    )
    return half and _longer(box([low, high, zero])) >= SMALLEST * _longer(world)


def _longer(extents: Extents | None) -> float:
    """Length of the longer side of a rectangle, metres."""
    return max(last - first for first, last in zip(*extents, strict=True)) if extents else 0.0
