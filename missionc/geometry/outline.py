"""Outlines: combined shapes as polygons, with exact distances of outside points.

``signed_distance`` understates the distance to a difference at the corners of the cut: half a metre of a door of 1.2 m
may be missing. A combination of boxes and polygons has a polygon as its outline, with an exact distance.
Three-dimensional shapes, and combinations with discs, stay unchanged.
"""

from __future__ import annotations

from functools import reduce

import shapely
from shapely.geometry.base import BaseGeometry
from shapely.ops import split

from missionc.ir import Box, Difference, Intersection, Polygon, Shape, Union
from missionc.ir.distances.signed_distance import measured_outside


def outlined(shape: Shape) -> Shape:
    """Same set of points as a union of polygons if that makes distances exact; otherwise the shape itself."""
    if measured_outside(shape):
        return shape
    area = _area(shape)
    if area is None:
        return shape
    parts = [part for part in shapely.get_parts(area) if part.geom_type == "Polygon" and part.area > 0]
    pieces = [piece for part in parts for piece in _without_holes(part)]
    if not pieces:
        return shape
    plain: list[Shape] = [Polygon(tuple((x, y) for x, y in piece.exterior.coords[:-1])) for piece in pieces]
    return reduce(Union, plain)


def _area(shape: Shape) -> BaseGeometry | None:
    """Plane geometry of a shape without heights and with straight sides; None for any other shape."""
    match shape:
        case Box(low, high) if len(low) == 2:
            return shapely.box(*low, *high)
        case Polygon(corners, None):
            return shapely.Polygon(corners)
        case Union(left, right) | Intersection(left, right) | Difference(left, right):
            one, other = _area(left), _area(right)
            if one is None or other is None:
                return None
            operation = {Union: shapely.union, Intersection: shapely.intersection, Difference: shapely.difference}
            result: BaseGeometry = operation[type(shape)](one, other)
            return result
        case _:
            return None


def _without_holes(part: shapely.Polygon) -> list[shapely.Polygon]:
    """Pieces of a polygon after cuts through each of its holes, so that no piece has a hole."""
    if not part.interiors:
        return [part]
    x = shapely.Polygon(part.interiors[0]).centroid.x
    _, low, _, high = part.bounds
    cut = shapely.LineString([(x, low - 1), (x, high + 1)])
    return [piece for half in split(part, cut).geoms for piece in _without_holes(half)]
