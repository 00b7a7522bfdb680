"""Tables of features: a CSV row for each disc, rectangle or point.

in   CSV
out  features in metres
"""

from __future__ import annotations

import math

from missionc.frontend.maps.feature import Area, Circle, Feature, MapPoint
from missionc.frontend.maps.geojson import KINDS
from missionc.frontend.maps.read_map import Reading, count_left_out
from missionc.frontend.maps.table import Row, read_table
from missionc.ir.places import FileRequest

COLUMNS = ("name", "kind", "x", "y", "z", "radius", "width", "depth", "angle", "low", "high")
HEIGHT = {"low", "high"}


def feature_table(asked: FileRequest) -> Reading:
    """Features of the requested kind in a CSV table, and features of rows that state no kind.

    Raises:
        MapError: the file is no such table, or a row describes no valid feature.
    """
    rows = read_table(asked.sources[0], asked.span, COLUMNS, ("x", "y"), asked.limits)
    for row in rows:
        if row.cells.get("kind", asked.kind) not in KINDS:
            known = ", ".join(f"`{each}`" for each in KINDS)
            raise row.wrong(f"unknown kind `{row.cells['kind'][:40]}`", f"use one of {known}")
    read = [row for row in rows if row.cells.get("kind", asked.kind) == asked.kind]
    flattened = [("height", "the world is a plane") for row in read if asked.plane and HEIGHT & row.cells.keys()]
    return Reading([_feature(row, asked) for row in read], count_left_out(flattened))


def _feature(row: Row, asked: FileRequest) -> Feature:
    unit, name = asked.unit or 1.0, row.cells.get("name", "")
    x, y = (place + unit * value for place, value in zip(asked.at, row.numbers("x", "y"), strict=True))
    height = None
    if HEIGHT & row.cells.keys() and not asked.plane:
        height = row.number("low") * unit, row.number("high") * unit
    begin = row.span.start + max(row.span.text.find(name), 0)
    named = row.span.part(begin, begin + len(name)) if name else row.span
    return Feature(name, _shape(row, asked, x, y, unit), row.span, named, height)


def _shape(row: Row, asked: FileRequest, x: float, y: float, unit: float) -> Area | Circle | MapPoint:
    sizes = [column for column in ("radius", "width", "depth", "angle") if column in row.cells]
    if asked.kind == "beacon":
        if sizes:
            raise row.wrong(f"a beacon has no `{sizes[0]}`", "leave this column empty")
        return MapPoint((x, y, *(unit * row.number("z") for _ in range("z" in row.cells))))
    if "z" in row.cells:
        raise row.wrong("only a beacon has a `z`", "set the height with `low` and `high`")
    if sizes == ["radius"]:
        return Circle((x, y), _positive(row, "radius") * unit)
    if "radius" in sizes or not {"width", "depth"} <= set(sizes):
        raise row.wrong("a region or obstacle needs a `radius`, or a `width` and a `depth`", "fill these columns")
    across, up = _positive(row, "width") * unit / 2, _positive(row, "depth") * unit / 2
    angle = math.radians(row.number("angle")) if "angle" in row.cells else 0.0
    cosine, sine = math.cos(angle), math.sin(angle)
    corners = ((-across, -up), (across, -up), (across, up), (-across, up))
    turned = tuple((x + cosine * a - sine * b, y + sine * a + cosine * b) for a, b in corners)
    return Area(((turned,),))


def _positive(row: Row, column: str) -> float:
    value = row.number(column)
    if value <= 0:
        raise row.wrong(f"`{column}` is {value:g}; it must be above 0", "write a size above 0")
    return value
