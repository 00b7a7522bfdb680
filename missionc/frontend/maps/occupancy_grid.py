"""Occupancy grids: conversion of an image to occupied cells, and of the cells to simple polygons.

    in   the image, its metadata, the mission's settings for it
    out  a feature for each polygon
    says MC004 MC033 MC034 MC035 MC038

An image is decoded only after a check of its size, so that none exceeds the limits of a mission.

The polygons have no holes, and cover every occupied cell. Cells are merged; then dents of the border are filled, the
smallest first, while the filled area stays close enough to occupied cells. No area is ever removed. A polygon with
holes is cut into parts without holes.

Source:
    Visvalingam and Whyatt, "Line generalisation by repeated elimination of points" (1993), for the order.
"""

from __future__ import annotations

import heapq
import math
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import lru_cache
from io import BytesIO
from posixpath import basename
from typing import Any, TypeAlias

import numpy as np
import shapely
from numpy.typing import NDArray

from missionc.base.diagnostics.code import MAP_LEFT_OUT
from missionc.base.diagnostics.map_error import too_many, unreadable, unsaid, unusable
from missionc.base.diagnostics.model import Diagnostic, Label
from missionc.base.source import Source
from missionc.base.trace import counted
from missionc.frontend.maps.feature import Area, Corners, Feature
from missionc.frontend.maps.map_metadata import IMAGES, MapMetadata, ending, library, read_metadata
from missionc.frontend.maps.read_map import Reading, box
from missionc.ir.places import FileRequest

Cells: TypeAlias = NDArray[np.bool_]
"""Occupied cells of a grid, (rows, columns), boolean; row 0 is the lowest."""

HALF_A_CELL = 0.5
"""Default maximum distance of a polygon from occupied cells, in side lengths of a cell."""

QUARTER = 4
"""Number of segments that approximate a quarter circle from inside."""

ROUNDING = 1e-9
"""Tolerance of a computed distance, in side lengths of a cell."""


def vectorise(occupied: Cells, stray: float, most_corners: int) -> list[Corners]:
    """Simple polygons that cover all occupied cells, ordered from bottom to top and from left to right.

    Args:
        occupied: (rows, columns), boolean.
        stray: maximum distance of a polygon's points from an occupied cell, in side lengths of a cell.
        most_corners: maximum number of corners of a polygon, at least 8.

    Returns:
        Corners in side lengths of a cell, (0, 0) being the lower left corner of the grid.
    """
    merged = shapely.union_all(_rectangles(occupied))
    polygons = []
    for part in shapely.get_parts(merged):
        for whole in shapely.get_parts(_filled(part, stray)):
            polygons += [_corners(piece) for piece in _cut(whole, most_corners)]
    return sorted(polygons, key=lambda corners: min((y, x) for x, y in corners))


def corner_count(occupied: Cells) -> int:
    """Number of corners of the boundary of all occupied cells.

    A point where two cells touch diagonally counts twice.
    """
    padded = np.pad(occupied, 1)
    low_left, low_right, high_left, high_right = padded[:-1, :-1], padded[:-1, 1:], padded[1:, :-1], padded[1:, 1:]
    single = low_left ^ low_right ^ high_left ^ high_right
    double = (low_left == high_right) & (low_right == high_left) & (low_left != low_right)
    return int(np.count_nonzero(single)) + 2 * int(np.count_nonzero(double))


def _rectangles(occupied: Cells) -> NDArray[np.object_]:
    """Rectangles that cover the occupied cells: runs in a row, merged with equal runs in adjacent rows; (rectangles,).

    Args:
        occupied: (rows, columns), boolean.
    """
    rows, columns = occupied.shape
    padded = np.zeros((rows, columns + 2), dtype=np.int8)
    padded[:, 1:-1] = occupied
    change = np.diff(padded, axis=1)
    row, start = np.nonzero(change == 1)
    _, end = np.nonzero(change == -1)
    order = np.lexsort((row, end, start))
    row, start, end = row[order], start[order], end[order]
    same = (start[1:] == start[:-1]) & (end[1:] == end[:-1]) & (row[1:] == row[:-1] + 1)
    first = np.concatenate(([True], ~same)) if len(row) else np.zeros(0, dtype=bool)
    last = np.concatenate((~same, [True])) if len(row) else first
    boxes: NDArray[np.object_] = shapely.box(start[first], row[first], end[first], row[last] + 1)
    return boxes


def _filled(part: shapely.Polygon, stray: float) -> shapely.Geometry:
    """The polygon with the shallow dents of its boundary filled.

    Args:
        stray: maximum distance of filled points from the polygon, in side lengths of a cell.
    """
    near = _cover_test(shapely.buffer(part, stray + ROUNDING, quad_segs=QUARTER))
    holes = [hole for hole in part.interiors if not near(shapely.Polygon(hole))]
    filled = [shapely.Polygon(part.exterior, holes)]
    for ring, outer in ((part.exterior, True), *((hole, False) for hole in holes)):
        corners = shapely.get_coordinates(ring)[:-1].tolist()
        filled += _fillings(corners[::-1] if ring.is_ccw == outer else corners, near)
    return shapely.simplify(shapely.union_all(filled), 0.0)


def _cover_test(area: shapely.Polygon) -> Callable[[shapely.Polygon], bool]:
    """Function that tests whether the area covers a polygon; its time does not grow with the number of holes."""
    outline = shapely.Polygon(area.exterior)
    shapely.prepare(outline)
    holes = shapely.STRtree([shapely.Polygon(hole) for hole in area.interiors])
    return lambda polygon: outline.covers(polygon) and not len(holes.query(polygon, predicate="intersects"))


def _fillings(ring: list[tuple[float, float]], near: Callable[[shapely.Polygon], bool]) -> Iterator[shapely.Polygon]:
    """Yield triangles that fill dents of a boundary, as far as they are ``near``.

    The polygon is to the right of the boundary.
    """
    count = len(ring)
    before, after = [(at - 1) % count for at in range(count)], [(at + 1) % count for at in range(count)]
    waiting = [(_dent(ring, before[at], at, after[at]), at, before[at], after[at]) for at in range(count)]
    waiting = [each for each in waiting if each[0] >= 0]
    heapq.heapify(waiting)
    gone = [False] * count
    left = count
    while waiting and left > 3:
        size, at, low, high = heapq.heappop(waiting)
        if gone[at] or before[at] != low or after[at] != high:
            continue
        if size > 0:
            triangle = shapely.Polygon((ring[low], ring[at], ring[high]))
            if not near(triangle):
                continue
            yield triangle
        gone[at] = True
        left -= 1
        after[low], before[high] = high, low
        for each in (low, high):
            dent = _dent(ring, before[each], each, after[each])
            if dent >= 0:
                heapq.heappush(waiting, (dent, each, before[each], after[each]))


def _dent(ring: list[tuple[float, float]], low: int, at: int, high: int) -> float:
    """Twice the area gained if the corner ``at`` is removed from a boundary; negative for a convex corner."""
    (ax, ay), (bx, by), (cx, cy) = ring[low], ring[at], ring[high]
    return (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)


def without_holes(rings: tuple[Corners, ...]) -> list[Corners]:
    """Valid simple polygons that cover the first ring without the other rings, which are holes."""
    return [_corners(piece) for piece in _cut(shapely.Polygon(rings[0], rings[1:]), sys.maxsize)]


def _cut(polygon: shapely.Polygon, most_corners: int) -> Iterator[shapely.Polygon]:
    """Yield parts of a polygon without holes and with few enough corners, cut along vertical or horizontal lines."""
    waiting = [polygon]
    while waiting:
        part = waiting.pop()
        west, south, east, north = part.bounds
        if part.interiors:
            bounds = shapely.bounds(list(part.interiors))
        elif len(part.exterior.coords) - 1 > most_corners:
            bounds = np.array([(west, south, east, north)])
        else:
            yield part
            continue
        width, height = bounds[0, 2:] - bounds[0, :2]
        axis = 0 if width >= height else 1
        # Through the median hole, so that the holes are halved.
        cut = float(np.sort(bounds[:, axis] + bounds[:, axis + 2])[len(bounds) // 2]) / 2
        if axis == 0:
            sides = shapely.box(west, south, cut, north), shapely.box(cut, south, east, north)
        else:
            sides = shapely.box(west, south, east, cut), shapely.box(west, cut, east, north)
        for side in sides:
            waiting += [each for each in shapely.get_parts(shapely.intersection(part, side)) if each.area > 0]


def _corners(polygon: shapely.Polygon) -> Corners:
    return tuple((float(x), float(y)) for x, y in shapely.get_coordinates(shapely.simplify(polygon, 0.0))[:-1])


FORMS = ("PPM", "PNG", "BMP")
"""Image formats that are read, with Pillow's names; PPM includes PGM."""

DECIMALS = 9
"""Number of decimals of coordinates in metres, so that 1.4 is not shown as 1.4000000000000001."""

SMALLEST = 1e-6
"""Minimum side length of a cell in metres; corners of smaller cells would coincide after rounding."""

RAW = 100.0
"""Shade of a certainly occupied cell if the shades are the map's own occupancy values."""

MAP_SAVER_UNKNOWN = 205
"""Shade that ``map_saver`` of ROS writes for an unknown cell."""


def occupancy_grid(asked: FileRequest) -> Reading:
    """A feature for each polygon of occupied cells, ordered from bottom to top and from left to right.

    Raises:
        MapError: the image is missing, empty, or too large.
    """
    image, metadata = _image_and_metadata(asked)
    metadata = metadata if asked.resolution is None else replace(metadata, resolution=asked.resolution)
    if metadata.resolution < SMALLEST:
        message = f"`{image.name}` has cells of {metadata.resolution:g} m; the minimum is {SMALLEST:g} m"
        raise unusable(message, asked.span, "set the cell size, for example `resolution 5 cm`")
    shades, known = _decoded(image, asked)
    cells = occupied_cells(shades, known, metadata, asked.unknown_free)
    if not cells.any():
        raise unusable(f"`{image.name}` has no occupied cell", asked.span, "check the thresholds of the map")
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
    message = f"`{image.name}`: {counted(unknown, 'cell')} of shade {MAP_SAVER_UNKNOWN} (`map_saver`: "
    message += f"unknown) {'is' if unknown == 1 else 'are'} read as free, since `free_thresh` is {metadata.free:g}"
    way_out = "write `free_thresh: 0.196`"
    return Reading(features, (), (Diagnostic(MAP_LEFT_OUT, message, Label(asked.span), help=way_out),), frame)


def occupied_cells(
    shades: NDArray[np.float64], known: NDArray[np.bool_], metadata: MapMetadata, unknown_free: bool
) -> Cells:
    """Occupied cells of a grid, from the shades of its image.

    Args:
        shades: (rows, columns) from 0, black, to 255, the uppermost row first.
        known: (rows, columns); false if the image is transparent there.
        unknown_free: True if cells of unknown occupancy count as free, False if they count as occupied.

    Returns:
        (rows, columns), boolean, the lowest row first.
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


def _image_and_metadata(asked: FileRequest) -> tuple[Source, MapMetadata]:
    """Image and metadata of a grid, from a request that names either file.

    The cell size of an image without metadata comes from the mission.
    """
    first, *rest = asked.sources
    if ending(first.name) not in IMAGES:
        metadata = read_metadata(first, asked.span)
        return rest[0], metadata
    if rest:
        metadata = read_metadata(rest[0], asked.span)
        if basename(metadata.image) != basename(first.name):
            reason = f"it describes `{metadata.image[:80]}`, not `{basename(first.name)}`"
            raise unreadable(rest[0], reason, asked.span, "name the `.yaml` file that describes the image")
        return first, metadata
    if asked.resolution is None:
        message = f"the cell size of `{first.name}` is unknown: there is no `.yaml` beside it"
        raise unsaid(message, asked.span, "set the cell size, for example `resolution 5 cm`")
    return first, MapMetadata(first.name, asked.resolution)


def _decoded(source: Source, asked: FileRequest) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Shades of an image from 0 to 255, and a mask of the cells that are not transparent; (rows, columns) both."""
    pillow = library("PIL.Image", "Pillow", source, asked.span)
    way_out = "use a PGM, PNG or BMP image"
    try:
        with _unlimited(pillow):
            image = pillow.open(BytesIO(source.content), formats=FORMS)
        width, height = image.size
    except Exception:  # a library that reads what anybody wrote fails in many ways
        raise unreadable(source, "not a PGM, PNG or BMP image", asked.span, way_out) from None
    if width * height > asked.limits.map_cells:
        raise too_many(source, "cells", "map_cells", width * height, asked.limits, asked.span)
    try:
        deep = image.mode.startswith(("I", "F"))
        pixels = np.asarray(image if deep else image.convert("RGBA"))
    except Exception:
        raise unreadable(source, "the image is truncated or damaged", asked.span, way_out) from None
    if deep:
        return pixels.astype(np.float64) / 257.0, np.ones(pixels.shape, dtype=bool)
    return pixels[..., :3].mean(axis=-1), pixels[..., 3] == 255


@contextmanager
def _unlimited(pillow: Any) -> Iterator[None]:
    """Context without Pillow's size limit for images.

    Pillow only reads the header, and the mission has its own limit.
    """
    before, pillow.MAX_IMAGE_PIXELS = pillow.MAX_IMAGE_PIXELS, None
    try:
        yield
    finally:
        pillow.MAX_IMAGE_PIXELS = before


@lru_cache(maxsize=8)
def _vectorised(packed: bytes, shape: tuple[int, int], stray: float, most_corners: int) -> tuple[Corners, ...]:
    """Polygons of a packed grid, cached because an editor requests the same polygons at every keystroke."""
    count = shape[0] * shape[1]
    cells = np.unpackbits(np.frombuffer(packed, dtype=np.uint8), count=count).astype(bool).reshape(shape)
    return tuple(vectorise(cells, stray, most_corners))


def _placed(corners: Corners, metadata: MapMetadata, at: tuple[float, float]) -> Corners:
    """Corners of a polygon converted from side lengths of a cell to metres, at the pose of the grid."""
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
