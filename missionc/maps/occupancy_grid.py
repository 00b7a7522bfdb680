"""Occupancy grids: an image and what its shades mean, to the cells that are occupied, and those to polygons.

    in   the image, its metadata, what the mission says of them
    out  a feature for each polygon
    says MC004 MC033 MC034 MC035 MC038

An image is decoded only after its size was looked at, so that none grows beyond what a mission may hold.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import lru_cache
from io import BytesIO
from posixpath import basename
from typing import Any

import numpy as np
from numpy.typing import NDArray

from missionc.base.figures import counted
from missionc.base.source import Source
from missionc.diagnostics.code import MAP_LEFT_OUT
from missionc.diagnostics.model import Diagnostic, Label
from missionc.maps.companions import IMAGES, ending
from missionc.maps.feature import Area, Asked, Corners, Feature, too_many, unreadable, unsaid, unusable
from missionc.maps.libraries import library
from missionc.maps.map_metadata import MapMetadata, read_metadata
from missionc.maps.read_summary import Reading, box
from missionc.maps.vectorise import HALF_A_CELL, Cells, corner_count, vectorise

FORMS = ("PPM", "PNG", "BMP")
"""Forms of images, as Pillow calls them; PPM is PGM too."""

DECIMALS = 9
"""Decimals of coordinates in metres, so that 1.4 is not shown as 1.4000000000000001."""

SMALLEST = 1e-6
"""Metres of the side of a cell: the corners of smaller ones would coincide when they are rounded."""

RAW = 100.0
"""The shade of a cell that is certainly occupied, if the shades are the map's own numbers."""

MAP_SAVER_UNKNOWN = 205
"""The shade that ``map_saver`` of ROS writes for a cell of which nothing is known."""


def occupancy_grid(asked: Asked) -> Reading:
    """Read one feature for each polygon of occupied cells, from below and from the left.

    Raises:
        MapError: there is no such image, nothing in it, or too much.
    """
    image, metadata = _image_and_metadata(asked)
    metadata = metadata if asked.resolution is None else replace(metadata, resolution=asked.resolution)
    if metadata.resolution < SMALLEST:
        message = f"`{image.name}` has cells of {metadata.resolution:g} m; the least is {SMALLEST:g} m"
        raise unusable(message, asked.span, "state the side of a cell, as in `resolution 5 cm`")
    shades, known = _decoded(image, asked)
    cells = occupied_cells(shades, known, metadata, asked.unknown_free)
    if not cells.any():
        raise unusable(f"`{image.name}` has no occupied cell", asked.span, "leave it out, or look at its thresholds")
    corners = corner_count(cells)
    if corners > asked.limits.map_corners:
        raise too_many(
            image, "corners between free and occupied cells", "map_corners", corners, asked.limits, asked.span
        )
    stray = HALF_A_CELL if asked.within is None else asked.within / metadata.resolution
    polygons = _vectorised(np.packbits(cells).tobytes(), cells.shape, stray, asked.limits.shape_parts)
    if len(polygons) > asked.limits.map_features:
        raise too_many(image, "obstacles", "map_features", len(polygons), asked.limits, asked.span)
    features = [Feature("", Area(((_placed(each, metadata, asked.at),),)), asked.span, asked.span) for each in polygons]
    rows, columns = cells.shape
    frame = box(_placed(((0, 0), (columns, 0), (columns, rows), (0, rows)), metadata, asked.at))
    unknown = int(np.count_nonzero(known & (shades == MAP_SAVER_UNKNOWN)))
    doubtful = unknown and metadata.mode != "raw" and not metadata.negate and not asked.unknown_free
    if not doubtful or metadata.free < (255 - MAP_SAVER_UNKNOWN) / 255:
        return Reading(features, frame=frame)
    message = f"`{image.name}`: {counted(unknown, 'cell')} of shade {MAP_SAVER_UNKNOWN}, which `map_saver` writes for "
    message += f"unknown, {'is' if unknown == 1 else 'are'} free, since `free_thresh` is {metadata.free:g}"
    way_out = "write `free_thresh: 0.196`, or `unknown free` if nothing stands there"
    return Reading(features, (), (Diagnostic(MAP_LEFT_OUT, message, Label(asked.span), help=way_out),), frame)


def occupied_cells(
    shades: NDArray[np.float64], known: NDArray[np.bool_], metadata: MapMetadata, unknown_free: bool
) -> Cells:
    """Which cells are occupied, and which are not known to be free unless ``unknown_free``.

    Args:
        shades: (rows, columns) from 0, black, to 255, the uppermost row first.
        known: (rows, columns); false where the image is transparent.

    Returns:
        (rows, columns), the lowest row first.
    """
    if metadata.mode == "raw":
        darkness = shades / RAW
        known = known & (shades <= RAW)
    else:
        darkness = shades / 255.0 if metadata.negate else (255.0 - shades) / 255.0
    taken = known & (darkness >= metadata.occupied)
    if not unknown_free:
        taken |= ~(known & (darkness <= metadata.free))
    cells: Cells = np.flipud(taken)
    return cells


def _image_and_metadata(asked: Asked) -> tuple[Source, MapMetadata]:
    """The two files, whichever was named; an image alone has the size of its cells from the mission."""
    first, *rest = asked.sources
    if ending(first.name) not in IMAGES:
        metadata = read_metadata(first, asked.span)
        return rest[0], metadata
    if rest:
        metadata = read_metadata(rest[0], asked.span)
        if basename(metadata.image) != basename(first.name):
            reason = f"it describes `{metadata.image[:80]}`, and not `{basename(first.name)}`"
            raise unreadable(rest[0], reason, asked.span, "name the one that describes the image, and not the image")
        return first, metadata
    if asked.resolution is None:
        message = f"how large a cell of `{first.name}` is, nobody says: there is no `.yaml` beside it"
        raise unsaid(
            message, asked.span, "say it as in `resolution 5 cm`, or put the `.yaml` of the map beside the image"
        )
    return first, MapMetadata(first.name, asked.resolution)


def _decoded(source: Source, asked: Asked) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Shades from 0 to 255, and where the image is not transparent; (rows, columns) both."""
    pillow = library("PIL.Image", "Pillow", source, asked.span)
    way_out = "give an image in the form PGM, PNG or BMP"
    try:
        with _unlimited(pillow):
            image = pillow.open(BytesIO(source.content), formats=FORMS)
        width, height = image.size
    except Exception:  # a library that reads what anybody wrote fails in many ways
        raise unreadable(source, "it is no image in the form PGM, PNG or BMP", asked.span, way_out) from None
    if width * height > asked.limits.map_cells:
        raise too_many(source, "cells", "map_cells", width * height, asked.limits, asked.span)
    try:
        deep = image.mode.startswith(("I", "F"))
        pixels = np.asarray(image if deep else image.convert("RGBA"))
    except Exception:
        raise unreadable(source, "its picture ends early or is damaged", asked.span, way_out) from None
    if deep:
        return pixels.astype(np.float64) / 257.0, np.ones(pixels.shape, dtype=bool)
    return pixels[..., :3].mean(axis=-1), pixels[..., 3] == 255


@contextmanager
def _unlimited(pillow: Any) -> Iterator[None]:
    """Pillow opens images of any size, of which it reads no more than the head: the limit is the mission's own."""
    before, pillow.MAX_IMAGE_PIXELS = pillow.MAX_IMAGE_PIXELS, None
    try:
        yield
    finally:
        pillow.MAX_IMAGE_PIXELS = before


@lru_cache(maxsize=8)
def _vectorised(packed: bytes, shape: tuple[int, int], stray: float, most_corners: int) -> tuple[Corners, ...]:
    """An editor asks for the same at every letter."""
    count = shape[0] * shape[1]
    cells = np.unpackbits(np.frombuffer(packed, dtype=np.uint8), count=count).astype(bool).reshape(shape)
    return tuple(vectorise(cells, stray, most_corners))


def _placed(corners: Corners, metadata: MapMetadata, at: tuple[float, float]) -> Corners:
    """Corners in sides of a cell to metres: turned about the lower left corner, which is put at its place."""
    x, y, yaw = metadata.origin
    cosine, sine = math.cos(yaw), math.sin(yaw)
    scaled = ((each[0] * metadata.resolution, each[1] * metadata.resolution) for each in corners)
    return tuple(
        (
            round(at[0] + x + cosine * across - sine * up, DECIMALS),
            round(at[1] + y + sine * across + cosine * up, DECIMALS),
        )
        for across, up in scaled
    )
