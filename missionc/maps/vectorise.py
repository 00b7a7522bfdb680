"""Vectorisation of occupancy grids: occupied cells to few simple polygons, simplified towards safety.

    in   which cells are occupied, and how far a polygon may stray from them
    out  polygons without holes, that cover every occupied cell

Cells are merged; then dents of the border are filled, the smallest first, where what is filled stays near enough to
cells that are occupied. Nothing is ever taken away. What has holes is cut into parts without.

Source:
    Visvalingam and Whyatt, "Line generalisation by repeated elimination of points" (1993), for the order.
"""

from __future__ import annotations

import heapq
import sys
from collections.abc import Callable, Iterator
from typing import TypeAlias

import numpy as np
import shapely
from numpy.typing import NDArray

from missionc.maps.feature import Corners

Cells: TypeAlias = NDArray[np.bool_]
"""(rows, columns): true where a cell is occupied; row 0 is the lowest."""

HALF_A_CELL = 0.5
"""How far a polygon strays from occupied cells where nothing else is asked, in sides of a cell."""

QUARTER = 4
"""Segments of a quarter of a circle, which run inside it."""

ROUNDING = 1e-9
"""What a distance that is computed may be off, in sides of a cell."""


def vectorise(occupied: Cells, stray: float, most_corners: int) -> list[Corners]:
    """Simple polygons that cover all occupied cells, from below and from the left.

    Args:
        occupied: (rows, columns).
        stray: sides of a cell; no point of a polygon is further than that from an occupied cell.
        most_corners: of a polygon, at least 8.

    Returns:
        Corners in sides of a cell, (0, 0) being the lower left corner of the grid.
    """
    merged = shapely.union_all(_rectangles(occupied))
    polygons = []
    for part in shapely.get_parts(merged):
        for whole in shapely.get_parts(_filled(part, stray)):
            polygons += [_corners(piece) for piece in _cut(whole, most_corners)]
    return sorted(polygons, key=lambda corners: min((y, x) for x, y in corners))


def corner_count(occupied: Cells) -> int:
    """Number of corners on the borders of occupied cells; a point at which two cells touch diagonally counts twice."""
    padded = np.pad(occupied, 1)
    low_left, low_right, high_left, high_right = padded[:-1, :-1], padded[:-1, 1:], padded[1:, :-1], padded[1:, 1:]
    single = low_left ^ low_right ^ high_left ^ high_right
    double = (low_left == high_right) & (low_right == high_left) & (low_left != low_right)
    return int(np.count_nonzero(single)) + 2 * int(np.count_nonzero(double))


def _rectangles(occupied: Cells) -> NDArray[np.object_]:
    """Runs of occupied cells, those that are alike in rows above each other as one."""
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
    """A polygon with the dents of its borders filled that are shallow enough."""
    near = _cover_test(shapely.buffer(part, stray + ROUNDING, quad_segs=QUARTER))
    holes = [hole for hole in part.interiors if not near(shapely.Polygon(hole))]
    filled = [shapely.Polygon(part.exterior, holes)]
    for ring, outer in ((part.exterior, True), *((hole, False) for hole in holes)):
        corners = shapely.get_coordinates(ring)[:-1].tolist()
        filled += _fillings(corners[::-1] if ring.is_ccw == outer else corners, near)
    return shapely.simplify(shapely.union_all(filled), 0.0)


def _cover_test(area: shapely.Polygon) -> Callable[[shapely.Polygon], bool]:
    """Test for polygons that an area covers; its time does not grow with the number of holes."""
    outline = shapely.Polygon(area.exterior)
    shapely.prepare(outline)
    holes = shapely.STRtree([shapely.Polygon(hole) for hole in area.interiors])
    return lambda polygon: outline.covers(polygon) and not len(holes.query(polygon, predicate="intersects"))


def _fillings(ring: list[tuple[float, float]], near: Callable[[shapely.Polygon], bool]) -> Iterator[shapely.Polygon]:
    """Triangles that fill dents of a border, the polygon being to the right of it, as far as they are ``near``."""
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
    """Twice the area that is gained where a corner is left out; negative where the corner stands out."""
    (ax, ay), (bx, by), (cx, cy) = ring[low], ring[at], ring[high]
    return (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)


def without_holes(rings: tuple[Corners, ...]) -> list[Corners]:
    """Simple polygons that cover the first ring less the others; all are valid."""
    return [_corners(piece) for piece in _cut(shapely.Polygon(rings[0], rings[1:]), sys.maxsize)]


def _cut(polygon: shapely.Polygon, most_corners: int) -> Iterator[shapely.Polygon]:
    """Parts of a polygon that have no holes and few enough corners, cut along upright or level lines."""
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
